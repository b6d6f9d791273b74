//! What is wrong with a settings file, line by line.

use std::path::Path;

use crate::failure::Failure;

/// One thing that is wrong with a file, and how to correct it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    pub line: usize,
    pub message: String,
    pub fix: String,
}

/// All problems of a file as one failure, in the order of their lines.
pub fn refused(path: &Path, problems: &[Problem]) -> Failure {
    let line = |Problem { line, message, fix }: &Problem| {
        format!("{}:{line}: {message}\n  fix: {fix}", path.display())
    };
    Failure::input(problems.iter().map(line).collect::<Vec<_>>().join("\n"))
}
