//! A thread that reads a carrier all the time. So the carrier's buffers do not overflow while the
//! program is busy, and a wait can end at any time, however coarse the carrier's own time-outs are.

use std::collections::VecDeque;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::Duration;

/// The longest that a carrier's own read may block, and so the longest that the thread
/// outlives its link.
pub(crate) const READ_TIMEOUT: Duration = Duration::from_millis(100);

/// What the thread has read: frames `F`, with what the carrier says of each.
pub(crate) struct Reader<F> {
    batches: Receiver<io::Result<Vec<F>>>,
    ready: VecDeque<F>,
    stop: Arc<AtomicBool>,
}

impl<F: Send + 'static> Reader<F> {
    /// `read` gives what has arrived within [`READ_TIMEOUT`], perhaps nothing; it is called
    /// until it fails or the reader is dropped.
    pub(crate) fn spawn(mut read: impl FnMut() -> io::Result<Vec<F>> + Send + 'static) -> Self {
        let (sender, batches) = mpsc::channel();
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        std::thread::spawn(move || {
            while !stopped.load(Ordering::Relaxed) {
                let batch = read();
                let last = batch.is_err();
                let empty = batch.as_ref().is_ok_and(Vec::is_empty);
                if !empty && sender.send(batch).is_err() || last {
                    return;
                }
            }
        });
        Self { batches, ready: VecDeque::new(), stop }
    }

    /// The next frame, `None` after `timeout`. An error is final.
    pub(crate) fn receive(&mut self, timeout: Duration) -> io::Result<Option<F>> {
        if let Some(frame) = self.ready.pop_front() {
            return Ok(Some(frame));
        }
        match self.batches.recv_timeout(timeout) {
            Ok(batch) => self.ready.extend(batch?),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Err(io::ErrorKind::NotConnected.into()),
        }
        Ok(self.ready.pop_front())
    }
}

impl<F> Drop for Reader<F> {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// Whether the error only says that nothing has arrived in time.
pub(crate) fn is_timeout(error: &io::Error) -> bool {
    use io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
    matches!(error.kind(), Interrupted | TimedOut | WouldBlock)
}
