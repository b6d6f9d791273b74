//! The verdict: whether effects may be named, how certain they are, and what they may be mistaken for.

pub mod calibration;
pub mod confusability;
pub mod prior_limit;
pub mod verdict;
