//! Whether every task still runs (P11). The tick asks and feeds the watchdog when all have answered.

use core::future::{Future, poll_fn};
use core::pin::pin;
use core::sync::atomic::{AtomicBool, Ordering};

use embassy_sync::waitqueue::AtomicWaker;

use crate::board;

/// Ticks from one question to the next. A task that hangs behind its answer is asked after these, and
/// the watchdog ends 10 ms after the last feed: a reset within 15 ms.
pub const ASK_EVERY_TICKS: u8 = 4;

/// The boot is over, and the tick feeds the watchdog.
static BOOTED: AtomicBool = AtomicBool::new(false);

/// A task's sign of life.
pub struct Pulse {
    name: &'static str,
    answered: AtomicBool,
    waker: AtomicWaker,
}

/// Every task, by falling priority: the first of those that hang is the one that keeps the others from
/// running.
static TASKS: [&Pulse; 4] = [&RECEIVE, &SEND, &LOG, &SERVICE];

pub static RECEIVE: Pulse = Pulse::new("receive");
pub static SEND: Pulse = Pulse::new("send");
pub static LOG: Pulse = Pulse::new("log");
pub static SERVICE: Pulse = Pulse::new("service");

impl Pulse {
    const fn new(name: &'static str) -> Self {
        Self { name, answered: AtomicBool::new(true), waker: AtomicWaker::new() }
    }

    /// The task itself. Each time that it has been polled to the end it has answered.
    pub async fn over<F: Future>(&self, task: F) -> F::Output {
        let mut task = pin!(task);
        poll_fn(|context| {
            self.waker.register(context.waker());
            let polled = task.as_mut().poll(context);
            self.advance();
            polled
        })
        .await
    }

    /// A sign of life in the middle of long work.
    pub fn advance(&self) {
        self.answered.store(true, Ordering::Relaxed);
    }

    fn has_answered(&self) -> bool {
        self.answered.load(Ordering::Relaxed)
    }
}

/// Ticks feed the watchdog from here on.
pub fn booted() {
    BOOTED.store(true, Ordering::Relaxed);
}

/// The service, or before its time the boot, advances in long work.
pub fn service_works() {
    if BOOTED.load(Ordering::Relaxed) {
        SERVICE.advance();
    } else {
        board::feed_watchdog();
    }
}

/// Every task has run since it was asked; then all are asked anew. For the tick.
pub fn all_have_run() -> bool {
    if !TASKS.iter().all(|task| task.has_answered()) {
        return false;
    }
    for task in TASKS {
        task.answered.store(false, Ordering::Relaxed);
        task.waker.wake();
    }
    true
}

/// Bits and names of the tasks that have not answered.
pub fn hung() -> (u8, impl Iterator<Item = &'static str>) {
    let silent = || TASKS.iter().enumerate().filter(|(_, task)| !task.has_answered());
    (silent().fold(0, |bits, (i, _)| bits | 1 << i), silent().map(|(_, task)| task.name))
}
