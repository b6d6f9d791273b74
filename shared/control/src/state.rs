//! State of the tick.

use cathforce_mechanics as mechanics;

use crate::memory_visitor::{MemoryWord, VisitMemory};
use crate::tick::{Estimator, Memory};
use crate::{Band, Config, Inputs, Outputs};

/// State of the tick. It holds no configuration.
#[derive(Clone, Debug)]
pub struct State {
    pub(crate) memory: Memory,
    pub(crate) mechanics: mechanics::State<f32>,
}

impl Default for State {
    fn default() -> Self {
        Self::new()
    }
}

impl State {
    /// The state directly after configuration.
    pub fn new() -> Self {
        // A constant is copied directly to its place. A value built here would be on the stack too.
        Self { memory: Memory::new(), mechanics: const { mechanics::State::new() } }
    }

    /// Resets to [`State::new`] in place, because a whole `State` does not fit on a small stack.
    pub fn reset(&mut self) {
        self.memory = Memory::new();
        self.mechanics.reset();
    }

    /// Ticks since configuration, wrapping.
    pub fn tick(&self) -> u32 {
        self.memory.tick
    }

    /// State of the model, from which results per node are read.
    pub fn mechanics(&self) -> &mechanics::State<f32> {
        &self.mechanics
    }

    /// Visits every number of the controller's own memory, for tests that corrupt it.
    #[doc(hidden)]
    pub fn visit_memory(&mut self, visit: &mut dyn FnMut(MemoryWord<'_>)) {
        self.memory.visit_memory(visit);
    }
}

/// Computes one tick. Any inputs, memory and settings give finite, limited outputs; never panics.
pub fn step(config: &Config<'_>, state: &mut State, inputs: &Inputs) -> Outputs {
    let State { memory, mechanics } = state;
    memory.tick(&config.settings, &mut Tracked { config, mechanics }, inputs)
}

/// The model with its configuration, as the tick's estimator.
pub(crate) struct Tracked<'a, 'l> {
    pub config: &'a Config<'l>,
    pub mechanics: &'a mut mechanics::State<f32>,
}

impl Estimator for Tracked<'_, '_> {
    fn tick_s(&self) -> f32 {
        self.config.model.description().solver.tick_s
    }

    fn reach_m(&self) -> f32 {
        self.config.model.reach_m()
    }

    fn has_guidewire(&self) -> bool {
        self.config.model.description().guidewire.is_some()
    }

    fn tendons(&self) -> usize {
        self.config.model.description().tendons.len()
    }

    fn band(&self) -> Option<&Band> {
        self.config.band.as_ref()
    }

    fn step(&mut self, drives: mechanics::Drives<f32>) -> mechanics::Outputs<f32> {
        mechanics::step(&self.config.model, &self.config.lumen, self.mechanics, drives)
    }

    fn settle(&mut self, drives: mechanics::Drives<f32>) -> bool {
        mechanics::settle(&self.config.model, &self.config.lumen, self.mechanics, drives)
    }

    #[cold]
    fn rebuild(&mut self) {
        self.mechanics.reset();
    }

    fn nodes(&self) -> impl Iterator<Item = [f32; 6]> {
        self.mechanics.node_results()
    }
}
