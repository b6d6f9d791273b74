//! A thread that reads a carrier all the time. So the carrier's buffers do not overflow while the
//! program is busy, and a wait can end at any time, however coarse the carrier's own time-outs are.

use std::collections::VecDeque;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::Duration;

/// The longest that a carrier's own read may block, and so the longest that the thread
/// outlives its link.
pub(crate) const READ_TIMEOUT: Duration = Duration::from_millis(100);

/// Frames that may wait for the program: eight seconds of a full bus of 1 Mbit/s. A sender that floods a
/// socket must not fill the memory; what does not fit is dropped and counted.
const MOST_WAITING: usize = 1 << 16;

/// What the thread has read: frames `F`, with what the carrier says of each.
pub(crate) struct Reader<F> {
    batches: Receiver<io::Result<Vec<F>>>,
    ready: VecDeque<F>,
    shared: Arc<Shared>,
}

#[derive(Default)]
struct Shared {
    stop: AtomicBool,
    /// Frames that the thread has handed over and the program has not taken yet.
    waiting: AtomicUsize,
    dropped: AtomicU64,
}

impl<F: Send + 'static> Reader<F> {
    /// `read` gives what has arrived within [`READ_TIMEOUT`], perhaps nothing; it is called
    /// until it fails or the reader is dropped.
    pub(crate) fn spawn(mut read: impl FnMut() -> io::Result<Vec<F>> + Send + 'static) -> Self {
        let (sender, batches) = mpsc::channel();
        let shared = Arc::new(Shared::default());
        let of_thread = Arc::clone(&shared);
        std::thread::spawn(move || {
            while !of_thread.stop.load(Ordering::Relaxed) {
                let mut batch = read();
                if let Ok(frames) = &mut batch {
                    of_thread.make_fit(frames);
                }
                let last = batch.is_err();
                let empty = batch.as_ref().is_ok_and(Vec::is_empty);
                if !empty && sender.send(batch).is_err() || last {
                    return;
                }
            }
        });
        Self { batches, ready: VecDeque::new(), shared }
    }

    /// The next frame, `None` after `timeout`. An error is final.
    pub(crate) fn receive(&mut self, timeout: Duration) -> io::Result<Option<F>> {
        if let Some(frame) = self.ready.pop_front() {
            return Ok(self.taken(Some(frame)));
        }
        match self.batches.recv_timeout(timeout) {
            Ok(batch) => self.ready.extend(batch?),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Err(io::ErrorKind::NotConnected.into()),
        }
        let frame = self.ready.pop_front();
        Ok(self.taken(frame))
    }

    /// Frames that came while too many waited.
    pub(crate) fn dropped(&self) -> u64 {
        self.shared.dropped.load(Ordering::Relaxed)
    }

    fn taken(&self, frame: Option<F>) -> Option<F> {
        if frame.is_some() {
            self.shared.waiting.fetch_sub(1, Ordering::Relaxed);
        }
        frame
    }
}

impl Shared {
    /// Cuts frames that find no room, and counts them.
    fn make_fit<F>(&self, frames: &mut Vec<F>) {
        let waiting = self.waiting.load(Ordering::Relaxed);
        let room = MOST_WAITING.saturating_sub(waiting).min(frames.len());
        self.dropped.fetch_add((frames.len() - room) as u64, Ordering::Relaxed);
        frames.truncate(room);
        self.waiting.fetch_add(room, Ordering::Relaxed);
    }
}

impl<F> Drop for Reader<F> {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
    }
}

/// Whether the error only says that nothing has arrived in time.
pub(crate) fn is_timeout(error: &io::Error) -> bool {
    use io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
    matches!(error.kind(), Interrupted | TimedOut | WouldBlock)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_is_bounded_and_what_is_dropped_is_counted() {
        const BATCH: usize = 1000;
        let (done, is_done) = mpsc::channel();
        let mut batches = 0;
        let mut reader = Reader::spawn(move || {
            batches += 1;
            if batches > 2 * MOST_WAITING / BATCH {
                done.send(()).unwrap();
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            Ok(vec![batches; BATCH])
        });
        is_done.recv().unwrap();
        let mut taken = 0;
        while let Ok(Some(_)) = reader.receive(Duration::from_secs(5)) {
            taken += 1;
        }
        assert_eq!(taken, MOST_WAITING);
        assert_eq!(reader.dropped() as usize, 2 * MOST_WAITING / BATCH * BATCH - MOST_WAITING);
    }
}
