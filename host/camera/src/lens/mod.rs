//! The lens, and poses of planes before it.

pub mod model;
pub mod pose;
