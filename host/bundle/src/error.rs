//! Errors of a bundle: the file, the place in it, the cause and the fix.

use std::fmt::{Display, Formatter};
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

/// A bundle that is refused, with everything that is wrong with one of its files.
#[derive(Debug, Error)]
pub struct BundleError {
    /// The file, as a path that can be opened.
    pub file: PathBuf,
    /// The place in it.
    pub place: Place,
    /// Why. On the heap, so that a result stays small.
    pub cause: Box<Cause>,
    /// Its other faults.
    pub others: Vec<(Place, Cause)>,
}

impl BundleError {
    pub(crate) fn new(file: &Path, place: Place, cause: impl Into<Cause>) -> Self {
        Self { file: file.to_path_buf(), place, cause: Box::new(cause.into()), others: Vec::new() }
    }

    /// Of a file with several faults.
    pub(crate) fn of_all<C: Into<Cause>>(
        file: &Path,
        first: (Place, C),
        others: impl IntoIterator<Item = (Place, C)>,
    ) -> Self {
        let others = others.into_iter().map(|(place, cause)| (place, cause.into()));
        Self { others: others.collect(), ..Self::new(file, first.0, first.1) }
    }
}

/// All faults in the order of their lines, each with its fix.
impl Display for BundleError {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let line = |place: &Place| match *place {
            Place::Whole => 0,
            Place::Line(line) | Place::LineColumn(line, _) => line,
            Place::Byte(_) => usize::MAX,
        };
        let others = self.others.iter().map(|(place, cause)| (place, cause));
        let mut all: Vec<_> = std::iter::once((&self.place, &*self.cause)).chain(others).collect();
        all.sort_by_key(|(place, _)| line(place));
        for (index, (place, cause)) in all.into_iter().enumerate() {
            let new_line = if index > 0 { "\n" } else { "" };
            write!(f, "{new_line}{}{place}: {cause}\n  fix: {}", self.file.display(), cause.fix())?;
        }
        Ok(())
    }
}

/// Refuses what is no file: a device may have no end. What cannot be looked at is refused when it is read.
fn refuse_special(file: &Path) -> Result<(), BundleError> {
    let is_special = |found: std::fs::Metadata| !found.is_file() && !found.is_dir();
    match file.metadata().is_ok_and(is_special) {
        true => {
            let error = std::io::Error::other("it is a pipe or a device, not a file");
            Err(BundleError::new(file, Place::Whole, error))
        }
        false => Ok(()),
    }
}

/// Reads a file whole.
pub(crate) fn read_bytes(file: &Path) -> Result<Vec<u8>, BundleError> {
    refuse_special(file)?;
    std::fs::read(file).map_err(|error| BundleError::new(file, Place::Whole, error))
}

/// Reads a text file whole.
pub(crate) fn read_text(file: &Path) -> Result<String, BundleError> {
    refuse_special(file)?;
    std::fs::read_to_string(file).map_err(|error| BundleError::new(file, Place::Whole, error))
}
