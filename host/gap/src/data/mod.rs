//! Checks of the measured data: clock, duplicate trials, axes and units, trials unlike the others.

pub mod clock;
pub mod duplicate_trials;
pub mod sanity;
pub mod unlike_trials;
