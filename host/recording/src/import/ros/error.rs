//! Why a bag gives no trial.

/// Why a bag gives no trial.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{problem}; fix: {fix}")]
pub struct RosError {
    pub problem: String,
    pub fix: String,
}

impl RosError {
    pub(super) fn new(problem: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { problem: problem.into(), fix: fix.into() }
    }
}
