//! The UARTs: SLCAN on UART 0, the log on UART 1.

use core::cell::UnsafeCell;
use core::future::poll_fn;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use core::task::Poll;

use cathforce_bus::Frame;
use cathforce_bus::slcan::{self, Decoder, Line};
use cortex_m::peripheral::NVIC;
use embassy_sync::waitqueue::AtomicWaker;
use heapless::spsc::{Consumer, Producer, Queue};
use static_cell::StaticCell;

use super::interrupts::Irq;
use super::registers::{Uart, uart0, uart1};

/// Size of the receive ring \[bytes\]. More bytes wait in the emulator, which loses none.
const RECEIVE_BYTES: usize = 4096;

/// Bytes that are taken in a tick that runs free. A bus of 1 Mbit/s has at most 1000 / 111 frames of
/// 8 bytes in it, each a line of 22 characters, or 1000 / 47 empty ones of 6: 200 and 128 bytes.
const BYTES_A_TICK: u32 = 400;

const TRANSMIT_FULL: u32 = 1;
const RECEIVE_FULL: u32 = 2;
const RECEIVE_INTERRUPT: u32 = 2;
const TRANSMIT_INTERRUPT: u32 = 1;
const ENABLE_TRANSMIT: u32 = 1;
const ENABLE_TRANSMIT_INTERRUPT: u32 = 0b100;
const ENABLE_RECEIVE_WITH_INTERRUPT: u32 = 0b1010;

type Ring = Queue<u8, RECEIVE_BYTES>;

static ARRIVED: AtomicWaker = AtomicWaker::new();
static TRANSMITTED: AtomicWaker = AtomicWaker::new();

/// Input is limited to [`BYTES_A_TICK`].
static LIMITED: AtomicBool = AtomicBool::new(false);
/// Bytes taken since the last tick.
static TAKEN: AtomicU32 = AtomicU32::new(0);
/// No more are taken before the next tick.
static EXHAUSTED: AtomicBool = AtomicBool::new(false);

/// Input of the ring, which the receive interrupt owns.
struct InterruptEnd(UnsafeCell<Option<Producer<'static, u8>>>);
// SAFETY: written once before the interrupt is enabled, then used by its handler only.
unsafe impl Sync for InterruptEnd {}
static RING_IN: InterruptEnd = InterruptEnd(UnsafeCell::new(None));

/// Input of the SLCAN text.
pub struct BusIn {
    ring: Consumer<'static, u8>,
    decoder: Decoder,
}
/// Output of the SLCAN text.
pub struct BusOut(());
/// Output of the log.
pub struct LogOut(());

/// Ports of the tasks.
pub struct Ports {
    pub bus_in: BusIn,
    pub bus_out: BusOut,
    pub log_out: LogOut,
}

/// Enables the UARTs. Called once, before the receive interrupt is enabled.
pub fn start() -> Ports {
    static RING: StaticCell<Ring> = StaticCell::new();
    let (producer, consumer) = RING.init(Queue::new()).split();
    // SAFETY: the receive interrupt is not enabled yet. The register values follow the manual.
    unsafe {
        *RING_IN.0.get() = Some(producer);
        uart0().baud_divider.write(16);
        uart0().control.write(ENABLE_TRANSMIT | ENABLE_RECEIVE_WITH_INTERRUPT);
        uart1().baud_divider.write(16);
        uart1().control.write(ENABLE_TRANSMIT);
    }
    Ports {
        bus_in: BusIn { ring: consumer, decoder: Decoder::default() },
        bus_out: BusOut(()),
        log_out: LogOut(()),
    }
}

/// Moves everything that UART 0 has received into the ring. Wakes the reader once per line.
///
/// # Safety
/// To be called by the receive interrupt only.
pub unsafe fn on_receive() {
    // SAFETY: this handler owns the producer.
    let Some(ring) = (unsafe { &mut *RING_IN.0.get() }) else { return };
    // Cleared first, so that a byte that arrives meanwhile raises the interrupt again.
    // SAFETY: clears the interrupt being handled.
    unsafe { uart0().interrupt.write(RECEIVE_INTERRUPT) }
    let mut line_ended = false;
    while uart0().state.read() & RECEIVE_FULL != 0 {
        let taken = TAKEN.load(Ordering::Relaxed);
        let exhausted = LIMITED.load(Ordering::Relaxed) && taken >= BYTES_A_TICK;
        if exhausted {
            // The next tick unmasks the interrupt.
            EXHAUSTED.store(true, Ordering::Relaxed);
        }
        if exhausted || !ring.ready() {
            // The reader of the ring unmasks the interrupt.
            NVIC::mask(Irq::Uart0Receive);
            line_ended = true;
            break;
        }
        TAKEN.store(taken.wrapping_add(1), Ordering::Relaxed);
        let byte = uart0().data.read() as u8;
        line_ended |= matches!(byte, b'\r' | b'\x07');
        // Cannot fail: there is room.
        let _ = ring.enqueue(byte);
    }
    if line_ended {
        ARRIVED.wake();
    }
}

/// Limits the input from here on, or does not.
pub fn limit_input(on: bool) {
    LIMITED.store(on, Ordering::Relaxed);
    renew_input();
}

/// Takes up to [`BYTES_A_TICK`] again.
pub fn renew_input() {
    TAKEN.store(0, Ordering::Relaxed);
    if EXHAUSTED.swap(false, Ordering::Relaxed) {
        // SAFETY: no critical section relies on this mask.
        unsafe { NVIC::unmask(Irq::Uart0Receive) }
    }
}

/// UART 0 has room again. For the transmit interrupt.
pub fn on_transmitted() {
    // SAFETY: clears the interrupt being handled, and disables it until somebody waits for it again.
    unsafe {
        uart0().control.modify(|control| control & !ENABLE_TRANSMIT_INTERRUPT);
        uart0().interrupt.write(TRANSMIT_INTERRUPT);
    }
    TRANSMITTED.wake();
}

impl BusIn {
    /// The next line. What the controller of a bus tells comes as the lines of an adapter.
    pub async fn next(&mut self) -> Line {
        loop {
            let byte = self.read().await;
            if let Some(line) = self.decoder.push(byte) {
                return line;
            }
        }
    }

    /// Leaves arriving bytes in the emulator until [`BusIn::next`] finds the ring empty. While ticks run,
    /// an interrupt whose time the host determines could make virtual time depend on the host (see
    /// README.md).
    pub fn pause(&mut self) {
        NVIC::mask(Irq::Uart0Receive);
    }

    /// The next byte. If there is none, waits until a whole line has arrived.
    async fn read(&mut self) -> u8 {
        poll_fn(|context| {
            if let Some(byte) = self.ring.dequeue() {
                return Poll::Ready(byte);
            }
            ARRIVED.register(context.waker());
            if !EXHAUSTED.load(Ordering::Relaxed) {
                // SAFETY: no critical section relies on this mask.
                unsafe { NVIC::unmask(Irq::Uart0Receive) }
            }
            match self.ring.dequeue() {
                Some(byte) => Poll::Ready(byte),
                None => Poll::Pending,
            }
        })
        .await
    }
}

impl BusOut {
    /// Sends a frame.
    pub async fn frame(&mut self, frame: &Frame) {
        self.write(&slcan::encode(frame)).await;
    }

    /// Sends an answer to a command of the adapter.
    pub async fn answer(&mut self, bytes: &'static [u8]) {
        self.write(bytes).await;
    }

    /// Starts the adapter's controller again after bus-off.
    pub async fn reopen(&mut self) {
        self.write(slcan::REOPEN).await;
    }

    /// Writes as much as there is room for, and waits for room. Nobody reads while a host is stopped, and
    /// this task must stay alive.
    async fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            poll_fn(|context| {
                if write(uart0(), byte) {
                    return Poll::Ready(());
                }
                TRANSMITTED.register(context.waker());
                // SAFETY: a bit of this register that only this task and its interrupt change.
                unsafe { uart0().control.modify(|control| control | ENABLE_TRANSMIT_INTERRUPT) }
                if write(uart0(), byte) { Poll::Ready(()) } else { Poll::Pending }
            })
            .await;
        }
    }
}

impl LogOut {
    /// Writes what there is room for. A byte without room is polled for when the watch asks.
    pub async fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            poll_fn(|_| if write(uart1(), byte) { Poll::Ready(()) } else { Poll::Pending }).await;
        }
    }
}

/// Writes to the log's UART from a fault, whatever its state. Returns `false` when nobody reads: the reset
/// must not wait for a reader.
pub fn emergency_log(byte: u8) -> bool {
    /// About 20 µs.
    const ATTEMPTS: u32 = 1000;
    (0..ATTEMPTS).any(|_| write(uart1(), byte))
}

/// Writes a byte if there is room for it. The emulated UART sends it in no time.
fn write(uart: &Uart, byte: u8) -> bool {
    if uart.state.read() & TRANSMIT_FULL != 0 {
        return false;
    }
    // SAFETY: there is room.
    unsafe { uart.data.write(u32::from(byte)) }
    true
}
