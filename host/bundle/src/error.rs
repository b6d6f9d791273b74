//! Errors of a bundle: the file, the place in it, the cause and the fix.

use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::entry::VesselCause;
use crate::geometry::{CentrelineCause, MeshCause, StlCause};
use crate::place::Place;
use crate::rig::RigCause;
use crate::trial::TrialCause;

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
    #[error("trials are numbered files like 000.csv; this name has no number")]
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

/// Reads a file whole.
pub(crate) fn read_bytes(file: &Path) -> Result<Vec<u8>, BundleError> {
    std::fs::read(file).map_err(|error| BundleError::new(file, Place::Whole, error))
}

/// Reads a text file whole.
pub(crate) fn read_text(file: &Path) -> Result<String, BundleError> {
    std::fs::read_to_string(file).map_err(|error| BundleError::new(file, Place::Whole, error))
}
