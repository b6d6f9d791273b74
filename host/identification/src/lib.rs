//! Identification of a steerable catheter from dynamic experiments: features of what was measured, the
//! same experiments simulated, and the search that brings the two together.
//!
//! | file | what it holds |
//! | --- | --- |
//! | `weight_release` | a weight at the tip is cut off, and the tip swings to its rest |
//! | `rod` | density, modulus, air drag, damping and tip mass from such releases |
//! | `hysteresis` | a tendon is pulled back and forth, and the tip follows late |
//! | `tendon` | static and sliding friction and dead zone from such loops |
//! | `pulse` | the tip in a pulsating flow; amplitude, phase and drag coefficient from it |
//! | `search` | multi-start on a coarse simulation, local search on a fine one, intervals |
//! | `spread` | nominal value and bounds over trials |
//! | `noise` | a sensor's noise, and what it makes of features |
//!
//! Source: Salehizadeh et al., Dynamic Modeling and Identification of a Robotic Intracardiac Echo
//! Catheter, section V.

#![forbid(unsafe_code)]

mod crossing;
mod hysteresis;
mod noise;
mod pulse;
mod rod;
mod search;
mod spread;
mod tendon;
mod weight_release;

pub use hysteresis::{LoopError, LoopFeatures, PulledTip, loop_features};
pub use noise::{Noise, feature_sd};
pub use pulse::{
    FlowSetup, FlowValues, InFlow, PulseError, PulseFeatures, PulseRecord, measured_pulse,
    pulse_features,
};
pub use rod::{ReleaseSetup, Releases, RodValues, measured_releases};
pub use search::{Effort, Experiment, Identified, Inseparable, Measured, SearchError, identify};
pub use spread::Spread;
pub use tendon::{LoopRecord, OpenVessel, PullSetup, Pulls, TendonValues, measured_loops};
pub use weight_release::{Release, ReleaseError, ReleaseFeatures, Suspended, release_features};
