//! `plant = "transmission"`: what carries a motion from where it is driven to where it is used.
//!
//! The measured output is compared with the one that the stated transmission makes of the measured input.

mod compensation;
mod effects;
mod model;
mod plant;
mod prepare;
mod segments;
mod spike;

pub use compensation::{Achieved, Compensation, CompensationError, Row};
pub use effects::{counted_in, listed};
pub use model::Model;
pub use plant::{Transmission, TransmissionError};
pub use spike::Spiking;
