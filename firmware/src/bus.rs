//! Tasks of the bus: receive text, pass frames to the service or the control loop, send frames and
//! answers.

use core::cell::UnsafeCell;
use core::future::poll_fn;
use core::task::Poll;

use cathforce_bus::service::BLOCK_SIZE;
use cathforce_bus::slcan::{self, Line};
use cathforce_bus::{Frame, Id};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::waitqueue::AtomicWaker;
use heapless::spsc::{Consumer, Producer, Queue};
use static_cell::StaticCell;

use crate::board::{BusIn, BusOut};
use crate::device::{self, FrameOutcome, GRANT_USED, Outgoing};
use crate::placement::PLACEMENT;
use crate::{requests, watch};

/// Length of the queue of the tick's frames: those of more ticks than a host leaves unread.
const TICK_FRAMES: usize = 256;
/// Length of the queue of the tasks' answers: a block of service frames.
const ANSWERS: usize = BLOCK_SIZE as usize;

/// An item to send.
enum Out {
    Frame(Frame),
    /// An answer to a command of the adapter.
    Answer(&'static [u8]),
    /// Starts the controller again after bus-off.
    Reopen,
}

static OUT: Channel<CriticalSectionRawMutex, Out, ANSWERS> = Channel::new();

/// Input of the queue of the tick's frames. It cannot panic, and nobody but the tick uses it.
struct TickEnd(UnsafeCell<Option<Producer<'static, Out>>>);
// SAFETY: written once before ticks run, then used by the tick only.
unsafe impl Sync for TickEnd {}
static TICK_END: TickEnd = TickEnd(UnsafeCell::new(None));
static TICK_HAS_SENT: AtomicWaker = AtomicWaker::new();

/// Output of the queue of the tick's frames, for the sending task.
pub struct TickFrames(Consumer<'static, Out>);

/// Makes the queue of the tick's frames. Called once, before ticks run.
pub fn start() -> TickFrames {
    static QUEUE: StaticCell<Queue<Out, TICK_FRAMES>> = StaticCell::new();
    let (input, output) = QUEUE.init(Queue::new()).split();
    // SAFETY: no tick runs yet.
    unsafe { *TICK_END.0.get() = Some(input) };
    TickFrames(output)
}

/// Where the tick's frames go.
pub struct Bus(());

impl Bus {
    /// The bus of the tick's interrupt.
    ///
    /// # Safety
    /// To be called by the tick only, which nothing interrupts.
    pub unsafe fn of_the_tick() -> Self {
        Self(())
    }

    fn put(&self, out: Out) -> bool {
        // SAFETY: the tick alone has a `Bus`.
        let input = unsafe { &mut *TICK_END.0.get() };
        input.as_mut().is_some_and(|input| input.enqueue(out).is_ok())
    }
}

impl Outgoing for Bus {
    fn send(&self, frame: Frame) -> bool {
        self.put(Out::Frame(frame))
    }

    fn tick_ends(&self) {
        TICK_HAS_SENT.wake();
    }

    fn reopen(&self) {
        // A queue that is full has room at the next attempt.
        self.put(Out::Reopen);
    }
}

/// Sends a frame of a task as soon as there is room for it.
pub async fn send_frame(frame: Frame) {
    OUT.send(Out::Frame(frame)).await;
}

/// Sends both queues, the tick's frames first. It begins with an empty line, which tells the host that
/// frames are accepted.
#[embassy_executor::task]
pub async fn send(mut port: BusOut, mut ticks: TickFrames) {
    watch::SEND
        .over(async {
            port.answer(slcan::ANSWER_DONE).await;
            loop {
                let out = poll_fn(|context| {
                    if let Some(out) = ticks.0.dequeue() {
                        return Poll::Ready(out);
                    }
                    TICK_HAS_SENT.register(context.waker());
                    match ticks.0.dequeue() {
                        Some(out) => Poll::Ready(out),
                        None => OUT.poll_receive(context),
                    }
                });
                match out.await {
                    Out::Frame(frame) => port.frame(&PLACEMENT.exchange(frame)).await,
                    Out::Answer(bytes) => port.answer(bytes).await,
                    Out::Reopen => port.reopen().await,
                }
            }
        })
        .await
}

/// Receives lines in order. After a SYNC the next line waits until the granted ticks have run, so that
/// the tick of a frame never depends on its time of arrival.
#[embassy_executor::task]
pub async fn receive(port: BusIn) {
    watch::RECEIVE.over(pass_on(port)).await
}

async fn pass_on(mut port: BusIn) {
    loop {
        let line = match port.next().await {
            Line::Frame(frame) => Line::Frame(PLACEMENT.exchange(frame)),
            other => other,
        };
        match line {
            Line::Frame(frame) if Id::from_raw(frame.id()) == Some(Id::ServiceRequest) => {
                requests::take(frame).await;
            }
            Line::Frame(frame) => {
                if let FrameOutcome::Granted = device::on_frame(&frame) {
                    port.pause();
                    GRANT_USED.wait().await;
                }
            }
            Line::Foreign => device::on_foreign(),
            Line::Open | Line::Close | Line::BitRate(_) => {
                OUT.send(Out::Answer(slcan::ANSWER_DONE)).await;
            }
            Line::BusOff(off) => device::on_bus_state(off),
            // A bare carriage return ends a truncated line.
            Line::Done | Line::Error => {}
            Line::Bad(bad) => {
                device::count(bad.counter());
                OUT.send(Out::Answer(slcan::ANSWER_ERROR)).await;
            }
        }
    }
}
