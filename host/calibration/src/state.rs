//! The file from which an interrupted run goes on: what it was, and every answer so far.

use std::io::Write as _;
use std::path::Path;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::ask::Answer;
use crate::methods::choice::Method;
use crate::parameter::Parameter;

/// The layout of the file.
const FORMAT: &str = "cathforce-calibration-state/1";

/// A run and what is known of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    format: String,
    /// What the objective depends on besides the parameters, such as a hash of the data.
    pub objective: String,
    pub method: Method,
    pub seed: u64,
    pub parameters: Vec<Parameter>,
    /// In the order in which they were asked for, whole batches only.
    pub answers: Vec<Answer>,
}

/// Why a run cannot go on, or cannot be kept.
#[derive(Debug, Error)]
pub enum StateError {
    #[error("{path}: cannot be read: {error}\n  fix: check the path, or begin without resuming")]
    Read { path: String, error: std::io::Error },
    #[error(
        "{path}:{line}: not a state that this program wrote: {why}\n  fix: begin without resuming"
    )]
    Format { path: String, line: usize, why: String },
    #[error(
        "{path}: it is the state of another run: {what}\n  fix: give the same arguments as before, or \
             begin without resuming"
    )]
    Other { path: String, what: String },
    #[error("{path}: cannot be written: {error}\n  fix: check the folder and the free space")]
    Write { path: String, error: std::io::Error },
}

impl State {
    pub fn new(objective: String, method: Method, seed: u64, parameters: &[Parameter]) -> Self {
        let (format, parameters) = (FORMAT.to_owned(), parameters.to_vec());
        Self { format, objective, method, seed, parameters, answers: Vec::new() }
    }

    pub fn read(path: &Path) -> Result<Self, StateError> {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path)
            .map_err(|error| StateError::Read { path: name.clone(), error })?;
        let state: Self = serde_json::from_str(&text).map_err(|error| StateError::Format {
            path: name.clone(),
            line: error.line(),
            why: error.to_string(),
        })?;
        if state.format != FORMAT {
            let why = format!("its format is `{}`, not `{FORMAT}`", state.format);
            return Err(StateError::Format { path: name, line: 1, why });
        }
        Ok(state)
    }

    /// Refuses to go on with the run of another state.
    pub fn check_same(&self, path: &Path, other: &Self) -> Result<(), StateError> {
        let what = if self.objective != other.objective {
            "its data or options are others".to_owned()
        } else if self.method != other.method {
            format!("its method is {}", self.method.name())
        } else if self.seed != other.seed {
            format!("its seed is {}", self.seed)
        } else if self.parameters != other.parameters {
            let all = self.parameters.iter();
            let own: Vec<String> =
                all.map(|own| format!("{}={}..{}", own.name, own.low, own.high)).collect();
            format!("its parameters are {}", own.join(", "))
        } else {
            return Ok(());
        };
        Err(StateError::Other { path: path.display().to_string(), what })
    }

    /// Writes the file whole or not at all.
    pub fn write(&self, path: &Path) -> Result<(), StateError> {
        let failed = |error| StateError::Write { path: path.display().to_string(), error };
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let mut file =
            tempfile::NamedTempFile::new_in(folder.unwrap_or(Path::new("."))).map_err(failed)?;
        let text = serde_json::to_string(self).map_err(|error| failed(error.into()))?;
        writeln!(file, "{text}").map_err(failed)?;
        file.persist(path).map_err(|error| failed(error.error))?;
        Ok(())
    }
}
