//! The noise floor: what a perfect model would leave.

pub mod correlation;
pub mod floor;
