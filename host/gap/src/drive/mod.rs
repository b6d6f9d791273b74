//! `plant = "drive"`: one axis of known mass, a force command and a measured position.
//!
//! The command force is compared. It is predicted by inverse dynamics from the measured position alone;
//! the measured command is used only for the comparison. Both pass the same filters.

mod course;
pub(crate) mod effects;
mod error;
mod inertia;
pub(crate) mod misread;
pub(crate) mod motion;
pub(crate) mod noise;
mod plant;
mod prepare;
mod regimes;
mod segments;
mod setpoint;
mod slow;
mod spike;
mod stamps;

pub use effects::{counted_in, listed};
pub use error::DriveError;
pub use plant::Drive;
pub use spike::Spiking;
