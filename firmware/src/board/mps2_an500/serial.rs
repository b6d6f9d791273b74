//! The UARTs: SLCAN on UART 0, the log on UART 1.

use core::cell::UnsafeCell;
use core::future::poll_fn;
use core::task::Poll;

use cortex_m::peripheral::NVIC;
use embassy_sync::waitqueue::AtomicWaker;
use heapless::spsc::{Consumer, Producer, Queue};
use static_cell::StaticCell;

use super::interrupts::Irq;
use super::registers::{Uart, uart0, uart1};

/// Size of the receive ring \[bytes\]. More bytes wait in the emulator, which loses none.
const RECEIVE_BYTES: usize = 4096;

const TRANSMIT_FULL: u32 = 1;
const RECEIVE_FULL: u32 = 2;
const RECEIVE_INTERRUPT: u32 = 2;
const ENABLE_TRANSMIT: u32 = 1;
const ENABLE_RECEIVE_WITH_INTERRUPT: u32 = 0b1010;

type Ring = Queue<u8, RECEIVE_BYTES>;

static ARRIVED: AtomicWaker = AtomicWaker::new();

/// Input of the ring, which the receive interrupt owns.
struct InterruptEnd(UnsafeCell<Option<Producer<'static, u8>>>);
// SAFETY: written once before the interrupt is enabled, then used by its handler only.
unsafe impl Sync for InterruptEnd {}
static RING_IN: InterruptEnd = InterruptEnd(UnsafeCell::new(None));

/// Input of the SLCAN text.
pub struct BusIn(Consumer<'static, u8>);
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
    Ports { bus_in: BusIn(consumer), bus_out: BusOut(()), log_out: LogOut(()) }
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
        if !ring.ready() {
            // The reader of the ring unmasks the interrupt.
            NVIC::mask(Irq::Uart0Receive);
            line_ended = true;
            break;
        }
        let byte = uart0().data.read() as u8;
        line_ended |= matches!(byte, b'\r' | b'\x07');
        // Cannot fail: there is room.
        let _ = ring.enqueue(byte);
    }
    if line_ended {
        ARRIVED.wake();
    }
}

impl BusIn {
    /// Leaves arriving bytes in the emulator until [`BusIn::read`] finds the ring empty. While ticks run,
    /// an interrupt whose time the host determines could make virtual time depend on the host (see
    /// README.md).
    pub fn pause(&mut self) {
        NVIC::mask(Irq::Uart0Receive);
    }

    /// The next byte. If there is none, waits until a whole line has arrived.
    pub async fn read(&mut self) -> u8 {
        poll_fn(|context| {
            if let Some(byte) = self.0.dequeue() {
                return Poll::Ready(byte);
            }
            ARRIVED.register(context.waker());
            // SAFETY: no critical section relies on this mask.
            unsafe { NVIC::unmask(Irq::Uart0Receive) }
            match self.0.dequeue() {
                Some(byte) => Poll::Ready(byte),
                None => Poll::Pending,
            }
        })
        .await
    }
}

impl BusOut {
    pub fn write(&mut self, bytes: &[u8]) {
        write(uart0(), bytes);
    }
}

impl LogOut {
    pub fn write(&mut self, bytes: &[u8]) {
        write(uart1(), bytes);
    }
}

/// Writes to the log's UART from a fault, whatever its state.
pub fn emergency_log(bytes: &[u8]) {
    write(uart1(), bytes);
}

/// Busy-waits for room, which costs nothing because the emulated UART sends a byte in no time.
fn write(uart: &Uart, bytes: &[u8]) {
    for &byte in bytes {
        while uart.state.read() & TRANSMIT_FULL != 0 {}
        // SAFETY: there is room.
        unsafe { uart.data.write(u32::from(byte)) }
    }
}
