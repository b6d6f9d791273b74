//! What a tick remembers.

use cathforce_mechanics as mechanics;

use crate::Mode;

/// Memory of the tick. Configuration never lives here.
#[derive(Clone, Debug)]
pub struct State {
    pub(crate) tick: u32,
    pub(crate) mode: Mode,
    pub(crate) mechanics: mechanics::State<f32>,
}

impl Default for State {
    fn default() -> Self {
        Self::new()
    }
}

impl State {
    /// Just configured: nothing measured, nothing settled, nothing output.
    pub fn new() -> Self {
        Self { tick: 0, mode: Mode::Boot, mechanics: mechanics::State::new() }
    }

    /// Ticks since configuration, wrapping.
    pub fn tick(&self) -> u32 {
        self.tick
    }

    /// The model's memory: where per-node results are read.
    pub fn mechanics(&self) -> &mechanics::State<f32> {
        &self.mechanics
    }
}
