//! A catheter in a vessel. Trials are played through the mechanics that the device runs.
//!
//! Four quantities are compared: the force on the phantom (averaged over 20 ms), the force behind the
//! guide, the tip, and the points on the shape. The inputs of the model are the encoders alone; readings
//! of the sensors are used only for the comparison.

mod achieved;
mod check;
mod column;
mod correction;
mod defects;
mod forks;
mod junctions;
mod library;
mod motion;
mod planned;
mod plant;
mod prepare;
mod priors;
mod repeats;
mod segments;
mod sensors;
mod settings;
mod simulate;
mod spike;
mod turns;
mod ways;

pub use achieved::{Achieved, AchievedError, Energy, Left, Runs, Shrink};
pub use check::CatheterError;
pub use planned::{PlannedError, planned};
pub use plant::Catheter;
pub use settings::{Known, Wanted};
pub use spike::Spiking;
