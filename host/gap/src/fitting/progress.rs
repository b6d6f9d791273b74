//! Whoever watches a run is told how far it is and what it has found, and may end it.

use std::ops::ControlFlow;

use crate::plant::Parameter;

/// Watches a run.
pub trait Watcher: Sync {
    /// Told after every simulation how many there were; says whether to go on. A run that must stop gives the
    /// best answer that it has.
    fn simulated(&self, simulations: usize) -> ControlFlow<()>;

    /// Told after every round of the search.
    fn found(&self, _best: &BestSoFar) {}
}

impl<F: Fn(usize) -> ControlFlow<()> + Sync> Watcher for F {
    fn simulated(&self, simulations: usize) -> ControlFlow<()> {
        self(simulations)
    }
}

/// Who watches.
pub type Progress<'a> = &'a dyn Watcher;

/// Nobody watches, and the run goes on to its end.
pub fn unwatched(_simulations: usize) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// The most probable set of effects among those that were fitted so far.
#[derive(Clone, Debug, PartialEq)]
pub struct BestSoFar {
    /// None for the nominal model.
    pub effects: Vec<EffectSoFar>,
    /// Share of the gap above the floor that the set closes, on data that its fit had not seen.
    pub closes: f64,
    /// Sets that were fitted, the nominal model among them.
    pub sets: usize,
}

/// An effect with the values that fit best so far.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectSoFar {
    pub id: &'static str,
    /// What it is, in one sentence.
    pub what: &'static str,
    /// In the order of its parameters, each in its own unit.
    pub values: Vec<(Parameter, f64)>,
}
