//! The fit of one set of effects: weighted residuals, robust loss, nuisance parameters, least squares.

pub mod fit;
pub mod loss;
pub mod nuisance;
pub mod problem;
pub mod progress;
pub mod refit;
pub mod search;
pub mod swing;
