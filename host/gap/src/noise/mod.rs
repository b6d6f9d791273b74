//! The noise floor.

pub mod correlation;
pub mod floor;
