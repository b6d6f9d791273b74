//! The held-out score of a fitted model, and when one score is better than another.

pub mod candidate;
pub mod folds;
pub mod metric;
pub mod score;
