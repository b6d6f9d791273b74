//! What is wrong with a bundle: the file, the place in it, the cause and the fix.

use std::fmt;
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::bundle::{RigCause, TrialCause};
use crate::entry::VesselCause;
use crate::geometry::{CentrelineCause, MeshCause, StlCause};

/// Where in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    Whole,
    /// A line, counted from 1.
    Line(usize),
    /// A line and a column, both counted from 1 (for a CSV the column is the field's number).
    LineColumn(usize, usize),
    /// A byte, counted from 0.
    Byte(usize),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Whole => Ok(()),
            Place::Line(line) => write!(f, ":{line}"),
            Place::LineColumn(line, column) => write!(f, ":{line}:{column}"),
            Place::Byte(byte) => write!(f, " at byte {byte}"),
        }
    }
}

/// Why a bundle is refused.
#[derive(Debug, Error)]
pub enum Cause {
    #[error("cannot be read: {0}")]
    Io(#[from] std::io::Error),
    #[error(transparent)]
    Rig(#[from] RigCause),
    #[error(transparent)]
    Trial(#[from] TrialCause),
    #[error(transparent)]
    Stl(#[from] StlCause),
    #[error(transparent)]
    Mesh(#[from] MeshCause),
    #[error(transparent)]
    Centreline(#[from] CentrelineCause),
    #[error(transparent)]
    Vessel(#[from] VesselCause),
    #[error("the bundle has neither vessel.stl nor centreline.csv, so there is no vessel")]
    NoVessel,
    #[error("trials are numbered files like 000.csv; this name is none")]
    TrialName,
    #[error("another file has the number {0} too")]
    TrialTwice(u32),
}

impl Cause {
    /// What to do about it.
    pub fn fix(&self) -> String {
        match self {
            Cause::Io(error)
                if matches!(
                    error.kind(),
                    std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory
                ) =>
            {
                "check the path; a bundle is a folder with rig.toml, vessel.stl or \
                 centreline.csv, and trials/000.csv …"
                    .into()
            }
            Cause::Io(_) => {
                "check that the file exists, is UTF-8 where text, and may be read".into()
            }
            Cause::Rig(cause) => cause.fix(),
            Cause::Trial(cause) => cause.fix(),
            Cause::Stl(cause) => cause.fix(),
            Cause::Mesh(cause) => cause.fix(),
            Cause::Centreline(cause) => cause.fix(),
            Cause::Vessel(cause) => cause.fix(),
            Cause::NoVessel => {
                "add vessel.stl (millimetres) or centreline.csv (branch,s_m,x_m,y_m,z_m,radius_m)"
                    .into()
            }
            Cause::TrialName => "rename it to its number (000.csv), or move it elsewhere".into(),
            Cause::TrialTwice(_) => "give every trial a number of its own".into(),
        }
    }
}

/// A bundle that is refused.
#[derive(Debug, Error)]
#[error("{}{place}: {cause}\n  fix: {}", file.display(), cause.fix())]
pub struct BundleError {
    /// The file, as a path that can be opened.
    pub file: PathBuf,
    /// The place in it.
    pub place: Place,
    /// Why.
    pub cause: Cause,
}

impl BundleError {
    pub(crate) fn new(file: &Path, place: Place, cause: impl Into<Cause>) -> Self {
        Self { file: file.to_path_buf(), place, cause: cause.into() }
    }
}

/// Something that looks wrong but does not stop anything.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    pub file: PathBuf,
    pub place: Place,
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}: {}", self.file.display(), self.place, self.message)
    }
}

/// Reads a file whole.
pub(crate) fn read_bytes(file: &Path) -> Result<Vec<u8>, BundleError> {
    std::fs::read(file).map_err(|error| BundleError::new(file, Place::Whole, error))
}

/// Reads a text file whole.
pub(crate) fn read_text(file: &Path) -> Result<String, BundleError> {
    std::fs::read_to_string(file).map_err(|error| BundleError::new(file, Place::Whole, error))
}
