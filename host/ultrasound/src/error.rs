//! Why images cannot be used, or tissue not be computed, and what to do about it.

use std::path::PathBuf;

use cathforce_calibration::RunError;
use cathforce_wall::{GmshError, MeshError, SolveError};
use thiserror::Error;

use crate::probe::OffTheBlock;

/// A fault of a description, of a mask, or of the block's mechanics.
#[derive(Debug, Error)]
pub enum UltrasoundError {
    /// A file is wrong.
    #[error("{}: {cause}\n  fix: {fix}", path.display())]
    File { path: PathBuf, cause: String, fix: String },
    #[error(transparent)]
    Gmsh(#[from] GmshError),
    #[error(transparent)]
    Probe(#[from] OffTheBlock),
    #[error(transparent)]
    Mesh(#[from] MeshError),
    #[error("the block under {force_n} N: {cause}")]
    Solve { force_n: f64, cause: SolveError },
    #[error(
        "no stiffness within the bounds gives a cross-section that meets the masks\n  fix: widen \
         `youngs_modulus_kpa`, and check `origin_mm`, `pixel_mm` and the poses ({0})"
    )]
    Search(#[from] RunError),
    #[error("it was interrupted")]
    Interrupted,
}

impl UltrasoundError {
    pub(crate) fn file(
        path: impl Into<PathBuf>,
        cause: impl Into<String>,
        fix: impl Into<String>,
    ) -> Self {
        Self::File { path: path.into(), cause: cause.into(), fix: fix.into() }
    }
}
