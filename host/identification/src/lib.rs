//! Identification of a steerable catheter from dynamic experiments: features of what was measured, the
//! same experiments simulated, and the search that brings the two together.
//!
//! | file | what it holds |
//! | --- | --- |
//! | `clamped` | the catheter of all experiments as a problem of the simulations |
//! | `weight_release` | a weight at the tip is cut off, and the tip swings to its rest |
//! | `rod` | density, modulus, air drag, damping and tip mass from such releases |
//! | `hysteresis` | a tendon is pulled back and forth, and the tip follows late |
//! | `tendon` | static and sliding friction and dead zone from such loops |
//! | `pulse` | the tip in a pulsating flow; amplitude, phase and drag coefficient from it |
//! | `search` | multi-start on a coarse simulation, which then follows a fine one; intervals |
//! | `spread` | nominal value and bounds over trials |
//! | `noise` | a sensor's noise, and what it makes of features |
//! | `quantity` | units and limits of the parameters, and how each is measured without a search |
//! | `description`, `record` | what somebody measured, as files |
//! | `replay` | loops of a tendon that follow a recorded drive |
//! | `expected` | features as a noisy sensor gives them, and their covariance |
//! | `trials` | the records of a description, and their features |
//! | `study` | the search for the parameters of its trials |
//! | `found` | what is found: values with intervals, and the spread over trials |
//! | `example` | made records of a catheter that is known |
//!
//! Source: Salehizadeh et al., Dynamic Modeling and Identification of a Robotic Intracardiac Echo
//! Catheter, section V.

#![forbid(unsafe_code)]

mod clamped;
mod crossing;
mod description;
mod error;
mod example;
mod expected;
mod found;
mod hysteresis;
mod noise;
mod pulse;
mod quantity;
mod record;
mod replay;
mod rod;
mod search;
mod spread;
mod study;
mod tendon;
mod trials;
mod weight_release;

pub use clamped::{Bends, Chamber, ClampedCatheter, Mesh, TipTendon};
pub use description::{Description, FORMAT, Kind, Range, Surroundings, TrialFiles};
pub use error::IdentificationError;
pub use example::{DESCRIPTION, TRUE_FLOW, TRUE_ROD, TRUE_TENDON, example};
pub use found::{Found, Known, PairFound, ParameterFound, SpreadFound, TrialFound};
pub use hysteresis::{LoopError, LoopFeatures, PulledTip, loop_features};
pub use noise::{Noise, feature_sd};
pub use pulse::{
    FlowSetup, FlowValues, InFlow, PulseError, PulseFeatures, PulseRecord, measured_pulse,
    pulse_features,
};
pub use quantity::{OF_FLOW, OF_LOOP, OF_RELEASE, Quantity};
pub use rod::{ReleaseSetup, Releases, RodValues, measured_releases};
pub use search::{Effort, Experiment, Identified, Inseparable, Measured, SearchError, identify};
pub use spread::Spread;
pub use study::Study;
pub use tendon::{LoopRecord, OpenVessel, PullSetup, Pulls, TendonValues, measured_loops};
pub use weight_release::{Release, ReleaseError, ReleaseFeatures, Suspended, release_features};
