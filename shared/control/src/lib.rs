//! The control tick: freshness ▶ mechanics ▶ haptics ▶ limits, and the supervisor over them.

#![no_std]
#![forbid(unsafe_code)]

mod digest;
mod faults;
mod freshness;
mod haptics;
mod io;
mod limits;
mod passivity;
mod selftest;
mod settings;
mod state;
mod supervisor;
mod tick;
mod words;

use cathforce_mechanics as mechanics;

pub use digest::{OUTPUT_NAMES, OUTPUT_WORDS};
pub use faults::{Fault, Reaction};
pub use io::{Command, EncoderSample, Inputs, LimitFlags, Notice, Outputs};
pub use settings::{
    ENCODER_TIMEOUT_HARD_TICKS, FORCE_HARD_N, RAMP_HARD_TICKS, SETTINGS, SettingError, SettingInfo,
    Settings, TICK_S, TORQUE_HARD_N_M,
};
pub use state::{State, step};
pub use supervisor::{Mode, RampCause};
#[doc(hidden)]
pub use words::Word;

/// What a tick is told and cannot change.
#[derive(Clone, Debug)]
pub struct Config<'a> {
    /// Instrument, entry, wall, solver.
    pub model: mechanics::Model<f32>,
    /// Read in place from the device image.
    pub lumen: mechanics::Lumen<'a>,
    pub settings: Settings,
}
