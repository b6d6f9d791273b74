//! Why a text of another tool is not read.

use std::io::{self, Read};

/// The fault of a text, and its place.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}{}: {problem}; fix: {fix}", .column.map_or(String::new(), |column| format!(":{column}")))]
pub struct ImportError {
    pub line: u64,
    /// Number of the field, from 1; `None` if the fault is in no single field.
    pub column: Option<usize>,
    pub problem: String,
    pub fix: String,
}

impl ImportError {
    pub(super) fn new(line: u64, problem: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { line, column: None, problem: problem.into(), fix: fix.into() }
    }
}

pub(super) fn read_text(log: &mut impl Read) -> Result<String, ImportError> {
    let mut bytes = Vec::new();
    let failed =
        |e: io::Error| ImportError::new(1, format!("cannot be read: {e}"), "copy it again");
    log.read_to_end(&mut bytes).map_err(failed)?;
    String::from_utf8(bytes).map_err(|e| {
        let whole = e.as_bytes().get(..e.utf8_error().valid_up_to()).unwrap_or_default();
        let line = 1 + whole.iter().filter(|b| **b == b'\n').count() as u64;
        ImportError::new(line, "this is no UTF-8 text", "give a text file, or save it as UTF-8")
    })
}
