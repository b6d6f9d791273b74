//! Calibration of a camera from pictures of a checkerboard.

pub mod bundle_adjustment;
pub mod calibrate;
pub mod file;
pub mod zhang;
