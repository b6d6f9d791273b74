//! The control tick: freshness ▶ mechanics ▶ haptics ▶ limits, and the supervisor over them.

#![no_std]
#![forbid(unsafe_code)]

mod faults;
mod io;
mod settings;
mod state;
mod supervisor;

use cathforce_mechanics as mechanics;

pub use faults::{Fault, Reaction};
pub use io::{Command, EncoderSample, Inputs, LimitFlags, Notice, Outputs};
pub use settings::{
    ENCODER_TIMEOUT_HARD_TICKS, FORCE_HARD_N, RAMP_HARD_TICKS, SETTINGS, SettingError, SettingInfo,
    Settings, TICK_S, TORQUE_HARD_N_M,
};
pub use state::State;
pub use supervisor::{Mode, RampCause};

/// What a tick is told and cannot change.
#[derive(Clone, Debug)]
pub struct Config<'a> {
    /// Instrument, entry, wall, solver.
    pub model: mechanics::Model<f32>,
    /// Read in place from the device image.
    pub lumen: mechanics::Lumen<'a>,
    pub settings: Settings,
}

/// One tick. Total: any input, any state, any settings give finite, limited outputs.
pub fn step(_config: &Config<'_>, state: &mut State, _inputs: &Inputs) -> Outputs {
    state.tick = state.tick.wrapping_add(1);
    Outputs {
        mode: state.mode,
        fault: None,
        limited: LimitFlags::none(),
        force_n: 0.0,
        torque_n_m: 0.0,
        contact: mechanics::Outputs::default(),
        encoder_age_ticks: u8::MAX,
        digest: 0,
    }
}
