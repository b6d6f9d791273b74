//! What went wrong, for people and for scripts: a message and an exit code.

use std::process::ExitCode;

use cathforce_bundle::BundleError;
use cathforce_link::LinkError;
use cathforce_recording::{ReadError, ReplayError, WriteError};

/// Exit codes; `cathforce --help` lists them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Code {
    /// Something failed that has no code of its own.
    Failed = 1,
    /// Wrong arguments.
    Usage = 2,
    /// A file or bundle is wrong.
    Input = 3,
    /// The link cannot be opened or is lost.
    Link = 4,
    /// The device refused or reported a fault.
    Device = 5,
    /// A figure missed the threshold that was asked for.
    Threshold = 6,
}

/// A command that did not succeed.
#[derive(Debug)]
pub struct Failure {
    pub code: Code,
    pub message: String,
}

impl Failure {
    pub fn new(code: Code, message: impl Into<String>) -> Self {
        Self { code, message: message.into() }
    }

    /// A file or bundle is wrong.
    pub fn input(error: impl std::fmt::Display) -> Self {
        Self::new(Code::Input, error.to_string())
    }

    /// An output file cannot be written.
    pub fn write(path: &std::path::Path, error: impl std::fmt::Display) -> Self {
        let message = format!(
            "cannot write {}: {error}; check the folder, permissions and free space",
            path.display()
        );
        Self::new(Code::Failed, message)
    }
}

impl From<Failure> for ExitCode {
    fn from(failure: Failure) -> Self {
        Self::from(failure.code as u8)
    }
}

impl From<LinkError> for Failure {
    fn from(error: LinkError) -> Self {
        let code = match error {
            LinkError::Address { .. } => Code::Usage,
            _ => Code::Link,
        };
        Self::new(code, error.to_string())
    }
}

impl From<BundleError> for Failure {
    fn from(error: BundleError) -> Self {
        Self::input(error)
    }
}

impl From<ReadError> for Failure {
    fn from(error: ReadError) -> Self {
        Self::input(error)
    }
}

impl From<ReplayError> for Failure {
    fn from(error: ReplayError) -> Self {
        Self::input(error)
    }
}

impl From<WriteError> for Failure {
    fn from(error: WriteError) -> Self {
        Self::new(Code::Failed, error.to_string())
    }
}
