//! Strangers: cases whose rigs, sensors, motions, nuisances and shapes of effects are not those that the
//! diagnosis was tuned on.
//!
//! | module | what it holds |
//! | --- | --- |
//! | `set` | which vessels and instruments tune, and which score |
//! | `path`, `vessels`, `segmentation` | vessels, and how a scan shows them |
//! | `instruments`, `rig` | instruments; a rig as it is and as its bundle states it |
//! | `motions` | what the drive does: not the protocol |
//! | `electronics`, `reading` | what sensors and cameras do to a reading, and what the rig states of it |
//! | `form`, `families`, `draw` | effects of other shapes, their names, and how they are drawn |
//! | `standing`, `moving`, `train`, `sensing` | effects on the rig, over time, in the drive, in the sensor |
//! | `play` | simulates one trial |
//! | `cases`, `make`, `write` | draws cases, makes them, writes their bundles |

mod cases;
mod draw;
mod electronics;
mod families;
mod form;
mod instruments;
mod make;
mod motions;
mod moving;
mod path;
mod play;
mod reading;
mod rig;
mod segmentation;
mod sensing;
mod set;
mod standing;
mod train;
mod vessels;
mod write;

pub use cases::{Stranger, strangers};
pub use electronics::{DropOuts, Electronics, Filter, Stated};
pub use motions::MotionKind;
pub use rig::RigTruth;
pub use set::Set;
