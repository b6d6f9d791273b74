//! A command that failed: a message for people and an exit code for scripts.

use std::process::ExitCode;

use cathforce_bundle::BundleError;
use cathforce_link::LinkError;
use cathforce_recording::{ReadError, ReplayError, WriteError};

/// Exit codes; `cathforce --help` lists them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Code {
    /// A failure without a code of its own.
    Failed = 1,
    /// The arguments are wrong.
    Usage = 2,
    /// A file or a bundle is wrong.
    Input = 3,
    /// The link cannot be opened, or was lost.
    Link = 4,
    /// The device refused, or it reported a fault.
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

    /// The failure of a file or a bundle that is wrong.
    pub fn input(error: impl std::fmt::Display) -> Self {
        Self::new(Code::Input, error.to_string())
    }

    /// The failure of a file that cannot be written.
    pub fn write(path: &std::path::Path, error: impl std::fmt::Display) -> Self {
        let message = format!(
            "cannot write {}: {error}\n  fix: check the folder, its permissions and the free space",
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

#[cfg(feature = "camera")]
impl From<cathforce_camera::CameraError> for Failure {
    fn from(error: cathforce_camera::CameraError) -> Self {
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
