//! Why a sensor gives no forces.

/// What is wrong with a sensor, and what mends it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{problem}\n  fix: {fix}")]
pub struct SensorError {
    pub problem: String,
    pub fix: String,
}

impl SensorError {
    pub(super) fn new(problem: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { problem: problem.into(), fix: fix.into() }
    }
}
