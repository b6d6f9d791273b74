//! The whole run, from a plant to the answer.

pub mod answer;
pub mod diagnose;
pub mod phase_per_trial;
pub mod report;
mod sentence;
pub mod withheld;

pub use diagnose::{diagnose, diagnose_by, diagnose_given, expected_simulations};
