//! Effects beyond the nominal model: what a real rig may have and its description does not
//! say. All are off unless the description switches them on.
//!
//! | file | effects |
//! | --- | --- |
//! | `table` | every parameter with unit, off value and range |
//! | `drive_train` | drive: latency, scale, backlash, ripple, slip |
//! | `nominal` | those that only change what the tables are made from |
//! | `memory` | wall: motion; entry: drag and guide; what all remember |
//! | `active` | where the recursion asks for effects: softening, guide, wind-up |
//! | `wall_law` | contact, and wall: narrowing, stiffening, relaxation |
//! | `pull` | the tendon |
//! | `stream` | the fluid |
//! | `measurement` | sensor: gain, misalignment, time constant, bias, drift |

pub(crate) mod active;
mod declare;
mod drive_train;
mod fluid;
mod measurement;
pub(crate) mod nominal;
pub(crate) mod state;
mod table;
mod tendon;
pub(crate) mod wall_law;

pub use declare::{EffectInfo, ParameterInfo};
pub use drive_train::{DriveTrain, LONGEST_LATENCY_TICKS};
pub use measurement::Measurement;
pub use table::*;
