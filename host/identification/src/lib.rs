//! Identification of a steerable catheter from dynamic experiments: features of what was measured, and
//! the same experiments simulated, so that a search can compare the two.
//!
//! | file | experiment |
//! | --- | --- |
//! | `weight_release` | a weight at the tip is cut off, and the tip swings to its rest |
//! | `hysteresis` | a tendon is pulled back and forth, and the tip follows late |
//!
//! Source: Salehizadeh et al., Dynamic Modeling and Identification of a Robotic Intracardiac Echo
//! Catheter, section V. The search itself is not here.

#![forbid(unsafe_code)]

mod crossing;
mod hysteresis;
mod weight_release;

pub use hysteresis::{LoopError, LoopFeatures, PulledTip, loop_features};
pub use weight_release::{Release, ReleaseError, ReleaseFeatures, Suspended, release_features};
