//! A diagnosis while it runs: who is told how far it is, and what ends it.

use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use cathforce_gap::report::Diagnosis;
use cathforce_gap::{BestSoFar, Watcher};

use crate::failure::Failure;
use crate::ui::Progress;

/// Shows a diagnosis elsewhere while it runs.
pub trait Onlooker: Sync {
    /// The search begins. `expected`: about how many simulations it takes. `budget`: ends it.
    fn begins(&self, expected: u64, budget: Option<Duration>);
    fn simulated(&self, simulations: u64);
    fn found(&self, best: &BestSoFar);
    fn ends(&self, answer: &Diagnosis) -> Result<(), Failure>;
}

/// A search that shows its progress, and ends with its budget or by Ctrl-C.
pub struct Watched<'a> {
    pub progress: Mutex<Progress>,
    pub start: Instant,
    pub budget: Option<Duration>,
    pub interrupted: &'a AtomicBool,
    pub onlooker: Option<&'a dyn Onlooker>,
}

impl Watcher for Watched<'_> {
    fn simulated(&self, simulations: usize) -> ControlFlow<()> {
        if let Ok(mut progress) = self.progress.lock() {
            progress.set(simulations as u64);
        }
        if let Some(onlooker) = self.onlooker {
            onlooker.simulated(simulations as u64);
        }
        let is_late = self.budget.is_some_and(|budget| self.start.elapsed() >= budget);
        match is_late || self.interrupted.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }

    fn found(&self, best: &BestSoFar) {
        if let Some(onlooker) = self.onlooker {
            onlooker.found(best);
        }
    }
}
