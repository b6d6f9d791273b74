//! Progress of the work, and its end before time.

use std::sync::atomic::{AtomicU64, Ordering};

use thiserror::Error;

/// Why a part of a system has no figures.
#[derive(Debug, Error)]
pub enum Trouble {
    /// Whoever started it asked for its end.
    #[error("it was interrupted")]
    Stopped,
    /// A solver has no solution, or the model refuses the case.
    #[error("{0:#}")]
    Failed(#[from] anyhow::Error),
}

/// Work of one step of the reference solver, in ticks of the model that take as long. On the pages'
/// cases (about 200 nodes) a step takes 1 to 2 ms, a tick of 64 links 30 to 60 µs.
pub const TICKS_A_STEP: u64 = 30;

/// Counts what is done of the work, and carries the wish to stop.
pub struct Meter<'a> {
    done: AtomicU64,
    total: u64,
    tell: &'a (dyn Fn(u64, u64) + Sync),
    stop: &'a (dyn Fn() -> bool + Sync),
}

impl<'a> Meter<'a> {
    /// `tell` gets the work done and the work in all; `stop` says whether to end.
    pub fn new(
        total: u64,
        tell: &'a (dyn Fn(u64, u64) + Sync),
        stop: &'a (dyn Fn() -> bool + Sync),
    ) -> Self {
        Self { done: AtomicU64::new(0), total, tell, stop }
    }

    /// Reports that much more work. Fails once the end is asked for.
    pub fn add(&self, work: u64) -> Result<(), Trouble> {
        let done = self.done.fetch_add(work, Ordering::Relaxed) + work;
        (self.tell)(done.min(self.total), self.total);
        if (self.stop)() { Err(Trouble::Stopped) } else { Ok(()) }
    }

    /// Sets the work done to what it must be here, because parts state their work beforehand only
    /// approximately.
    pub fn at(&self, done: u64) {
        self.done.store(done, Ordering::Relaxed);
        (self.tell)(done.min(self.total), self.total);
    }

    /// Whether the end is asked for.
    pub fn is_stopped(&self) -> bool {
        (self.stop)()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    #[test]
    fn work_is_counted_and_never_exceeds_the_whole() {
        let told = Mutex::new(Vec::new());
        let tell = |done, total| told.lock().unwrap().push((done, total));
        let meter = Meter::new(10, &tell, &|| false);
        meter.add(4).unwrap();
        meter.add(9).unwrap();
        meter.at(7);
        assert_eq!(*told.lock().unwrap(), [(4, 10), (10, 10), (7, 10)]);
        let stopped = Meter::new(10, &tell, &|| true);
        assert!(matches!(stopped.add(1), Err(Trouble::Stopped)) && stopped.is_stopped());
    }
}
