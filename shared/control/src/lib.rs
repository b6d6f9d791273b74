//! The control tick: from encoder samples to what the operator feels.
//!
//! [`step`] is all of it: pure, without allocation, total. It is called by the firmware's
//! timer interrupt, by replays and by tests alike. Within a tick, in this order:
//!
//! | file | what it does |
//! | --- | --- |
//! | `freshness` | which encoder samples are believed, and for how long |
//! | `supervisor` | modes and the table of their transitions |
//! | `grip` | which drive's load the operator feels, and whether any |
//! | `tick` | the order of things; runs the model in the modes that track |
//! | `haptics` | forces at the drive → what the operator's axes are asked for |
//! | `passivity` | how large an output may be before an axis gives out too much energy |
//! | `limits` | the last stage: magnitude and slew, whatever came before |
//! | `band` | how far the estimated forces may be off |
//! | `digest` | one number for every bit of every output so far |
//!
//! Output ends in one of two ways. **Ramp**: to zero within `ramp_time_ticks`, no faster
//! than the slew limits. **Cut**: zero in the same tick, the only change that the slew
//! limits do not bind. Which one it is belongs to the fault ([`Fault::reaction`]).

#![no_std]
#![forbid(unsafe_code)]

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

pub use band::{BAND_ROWS, BAND_UNIT_N, BAND_UNKNOWN, Band, BandRow, HalfWidths};
pub use faults::{Fault, Reaction};
pub use grip::{Grip, HapticSource};
pub use io::{Command, EncoderSample, GuidewireSample, Inputs, LimitFlags, Notice, Outputs};
#[doc(hidden)]
pub use memory_visitor::MemoryWord;
pub use settings::{
    ENCODER_TIMEOUT_HARD_TICKS, FORCE_HARD_N, RAMP_HARD_TICKS, SETTINGS, SettingError, SettingInfo,
    Settings, TICK_S, TORQUE_HARD_N_M,
};
pub use state::{State, step};
pub use supervisor::{Mode, RampCause};

/// What a tick is told and cannot change.
#[derive(Clone, Debug)]
pub struct Config<'a> {
    /// Instrument, entry, wall, solver.
    pub model: mechanics::Model<f32>,
    /// Read in place from the device image.
    pub lumen: mechanics::Lumen<'a>,
    pub settings: Settings,
    /// How far the forces may be off, where a diagnosis has said so.
    pub band: Option<Band>,
}
