//! `plant = "drive"`: one axis of known mass, a force command and a measured position.
//!
//! Compared is the command force. It is predicted from the measured position alone, by inverse
//! dynamics; the measured command enters nothing but the comparison. Both pass the same filters.

mod effects;
mod inertia;
mod misread;
mod motion;
mod noise;
mod plant;
mod segments;
mod setpoint;
mod spike;
mod stamps;

pub use effects::{counted_in, listed};
pub use plant::{Drive, DriveError};
pub use spike::Spiking;
