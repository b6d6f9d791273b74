//! The control tick: from encoder samples to what the operator feels.
//!
//! [`step`] computes one tick. It is a pure function of its arguments, does not allocate, and gives
//! finite, limited outputs for any input. The firmware's timer interrupt, replays and tests call it.
//! Within a tick, in this order:
//!
//! | file | what it does |
//! | --- | --- |
//! | `freshness` | which encoder samples are accepted, and for how long |
//! | `supervisor` | modes and their transition table |
//! | `grip` | which drive's load the operator feels, and whether any |
//! | `tick` | the order of the stages; runs the model in the modes that track |
//! | `haptics` | from forces at the drive to the demands on the operator's axes |
//! | `passivity` | largest output that keeps an axis within its energy budget |
//! | `limits` | the last stage: limits of magnitude and slew |
//! | `band` | uncertainty of the estimated forces |
//! | `digest` | hash of all outputs so far |
//!
//! Output stops in one of two ways, which each fault determines ([`Fault::reaction`]). A **ramp** goes
//! to zero within `ramp_time_ticks`, no faster than the slew limits. A **cut** is zero in the same
//! tick; it is the only change that may exceed the slew limits.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(not(target_os = "none"))]
extern crate alloc;

#[cfg(not(target_os = "none"))]
mod abreast;
mod band;
mod digest;
mod faults;
mod freshness;
mod grip;
mod haptics;
mod io;
mod limits;
mod memory_visitor;
mod passivity;
mod selftest;
mod settings;
mod state;
mod supervisor;
mod tick;

use cathforce_mechanics as mechanics;

#[cfg(not(target_os = "none"))]
pub use abreast::{Ticks, kind, step_abreast};
pub use band::{BAND_ROWS, BAND_UNIT_N, BAND_UNKNOWN, Band, BandRow, HalfWidths};
pub use faults::{Fault, Reaction};
pub use grip::{Grip, HapticSource};
pub use io::{
    Command, EncoderSample, GuidewireSample, Inputs, LimitFlags, Notice, Outputs, TENDON_PAIRS,
    TendonPair,
};
#[doc(hidden)]
pub use memory_visitor::MemoryWord;
pub use settings::{
    ENCODER_TIMEOUT_HARD_TICKS, FORCE_HARD_N, RAMP_HARD_TICKS, SETTINGS, SettingError, SettingInfo,
    Settings, TICK_S, TORQUE_HARD_N_M,
};
pub use state::{State, step};
pub use supervisor::{Mode, RampCause};

/// Configuration of the tick.
#[derive(Clone, Debug)]
pub struct Config<'a> {
    /// The model of instrument, entry and wall, with its solver.
    pub model: mechanics::Model<f32>,
    /// The lumen, read in place from the device image.
    pub lumen: mechanics::Lumen<'a>,
    pub settings: Settings,
    /// Uncertainty of the estimated forces, if a diagnosis has measured it.
    pub band: Option<Band>,
}
