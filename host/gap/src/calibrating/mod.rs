//! Calibration: the parameters of the first effect of plants, which are the settings that somebody names,
//! fitted to all their trials.

mod case;
mod fit;

pub use case::Case;
pub use fit::{Calibration, Errors, Fitted, Value};
