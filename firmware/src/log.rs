//! The log: defmt frames go into a ring, from which a task sends them.
//!
//! Logging never masks the tick, so the tick itself does not log. Frames that do not fit into the ring
//! are lost, which the reader sees by defmt's framing.

use core::cell::UnsafeCell;
use core::future::poll_fn;
use core::sync::atomic::{AtomicBool, Ordering};
use core::task::Poll;

use cortex_m::register::{basepri, basepri_max};
use embassy_sync::waitqueue::AtomicWaker;
use heapless::spsc::Queue;

use crate::board::{self, LogOut};
use crate::watch;

const RING_BYTES: usize = 4096;
/// Masks every interrupt except the tick's, whose priority is 0.
const ALL_BUT_THE_TICK: u8 = 0x40;

struct Shared {
    ring: UnsafeCell<Queue<u8, RING_BYTES>>,
    encoder: UnsafeCell<defmt::Encoder>,
    restore: UnsafeCell<u8>,
    taken: AtomicBool,
}

// SAFETY: `encoder`, `restore` and the ring's input belong to the one context that has acquired the log.
// The ring's output belongs to `send`, or to a fault.
unsafe impl Sync for Shared {}

static LOG: Shared = Shared {
    ring: UnsafeCell::new(Queue::new()),
    encoder: UnsafeCell::new(defmt::Encoder::new()),
    restore: UnsafeCell::new(0),
    taken: AtomicBool::new(false),
};
static WAITING: AtomicWaker = AtomicWaker::new();

#[defmt::global_logger]
struct Logger;

fn put(bytes: &[u8]) {
    for &byte in bytes {
        // SAFETY: the log is acquired, and the two ends of the queue may be used at the same time.
        let _ = unsafe { (*LOG.ring.get()).split().0.enqueue(byte) };
    }
}

// SAFETY: `acquire` masks every context that logs until `release`.
unsafe impl defmt::Logger for Logger {
    fn acquire() {
        let before = basepri::read();
        basepri_max::write(ALL_BUT_THE_TICK);
        if LOG.taken.swap(true, Ordering::Acquire) {
            // Only a panic while logging gets here; it starts a new frame.
            // SAFETY: the interrupted context never continues.
            unsafe { *LOG.encoder.get() = defmt::Encoder::new() };
        }
        // SAFETY: the log is taken.
        unsafe {
            *LOG.restore.get() = before;
            (*LOG.encoder.get()).start_frame(put);
        }
    }

    unsafe fn flush() {}

    unsafe fn release() {
        // SAFETY: the log is taken.
        let before = unsafe {
            (*LOG.encoder.get()).end_frame(put);
            *LOG.restore.get()
        };
        LOG.taken.store(false, Ordering::Release);
        WAITING.wake();
        // SAFETY: as it was before `acquire`.
        unsafe { basepri::write(before) };
    }

    unsafe fn write(bytes: &[u8]) {
        // SAFETY: the log is taken.
        unsafe { (*LOG.encoder.get()).write(bytes, put) }
    }
}

// Wraps after about three minutes.
defmt::timestamp!("{=u32:us}", board::time_us());

/// Sends the log.
#[embassy_executor::task]
pub async fn send(mut port: LogOut) {
    let next = || {
        poll_fn(|context| {
            // SAFETY: this task is the only reader while no fault has happened.
            let mut output = unsafe { (*LOG.ring.get()).split().1 };
            if let Some(byte) = output.dequeue() {
                return Poll::Ready(byte);
            }
            WAITING.register(context.waker());
            output.dequeue().map_or(Poll::Pending, Poll::Ready)
        })
    };
    watch::LOG
        .over(async {
            loop {
                port.write(&[next().await]).await;
            }
        })
        .await
}

/// Sends the whole log at once, from a fault, when nothing else runs any more.
pub fn flush_in_fault() {
    // SAFETY: interrupts are off for good.
    let mut output = unsafe { (*LOG.ring.get()).split().1 };
    while let Some(byte) = output.dequeue() {
        if !board::emergency_log(byte) {
            return;
        }
    }
}
