//! Effects beyond the nominal model: properties that a real rig may have but its nominal description
//! leaves out. All are off unless the description switches them on.
//!
//! | file | effects |
//! | --- | --- |
//! | `table` | every parameter with unit, off value and range |
//! | `drive_train` | drive: latency, scale, backlash, ripple, slip |
//! | `nominal` | effects that only change the numbers from which tables are made |
//! | `state` | wall: motion; entry: drag and guide; the state of all effects |
//! | `active` | effects in the recursion: softening, guide, wind-up |
//! | `relaxation` | bending of the instrument that relaxes |
//! | `wall_law` | contact, and wall: narrowing, stiffening, relaxation |
//! | `tendon` | the tendon with a fixed pull |
//! | `driven_tendons` | tendons that drives pull |
//! | `fluid` | drag of the fluid |
//! | `measurement` | sensor: gain, misalignment, time constant, bias, drift |

pub(crate) mod active;
mod declare;
mod drive_train;
pub(crate) mod driven_tendons;
mod fluid;
mod measurement;
pub(crate) mod nominal;
pub(crate) mod relaxation;
pub(crate) mod state;
mod table;
mod tendon;
pub(crate) mod wall_law;

pub use declare::{EffectInfo, ParameterInfo};
pub use drive_train::{DriveTrain, LONGEST_LATENCY_TICKS};
pub use measurement::Measurement;
pub use table::*;
