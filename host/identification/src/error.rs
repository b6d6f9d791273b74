//! Why nothing is identified, and what to do about it.

use thiserror::Error;

use crate::search::SearchError;

/// A fault of a description, of a record, or of a search.
#[derive(Debug, Error)]
pub enum IdentificationError {
    /// A file is wrong. `place`: the file, and its line where there is one.
    #[error("{place}: {cause}\n  fix: {fix}")]
    File { place: String, cause: String, fix: String },
    /// The experiment cannot be simulated.
    #[error(
        "the simulation of the experiment: {0}\n  fix: check [catheter] and the bounds in [parameters]"
    )]
    Simulation(String),
    /// `trial`: number from 1.
    #[error("trial {trial}: {}\n  fix: {}", cause_of(.error), fix_of(.error))]
    Search { trial: usize, error: SearchError },
    #[error("it was interrupted")]
    Interrupted,
}

impl IdentificationError {
    pub(crate) fn file(
        place: impl Into<String>,
        cause: impl Into<String>,
        fix: impl Into<String>,
    ) -> Self {
        Self::File { place: place.into(), cause: cause.into(), fix: fix.into() }
    }
}

/// What went wrong, without the advice that the error ends with.
fn cause_of(error: &SearchError) -> String {
    let whole = error.to_string();
    match error {
        SearchError::Start(_) | SearchError::NoSlope => {
            whole.split(';').next().unwrap_or_default().to_owned()
        }
        SearchError::NothingTold => whole.split(". ").next().unwrap_or_default().to_owned(),
        _ => whole,
    }
}

fn fix_of(error: &SearchError) -> &'static str {
    match error {
        SearchError::Start(_) | SearchError::NoSlope | SearchError::Global(_) => {
            "narrow the bounds in [parameters] to where the experiment works, and check [catheter]"
        }
        SearchError::NothingTold => {
            "measure with less noise, or excite the catheter more; check the unit of `noise_m`"
        }
        SearchError::Noise { .. } => {
            "check `noise_m`, and that the records are not numbers of a simulation without noise"
        }
        SearchError::Parameter(_) | SearchError::Local(_) | SearchError::Interrupted => {
            "check the bounds in [parameters]"
        }
    }
}
