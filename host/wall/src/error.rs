//! Why a load is not solved.

use cathforce_sparse::Singular;
use thiserror::Error;

use crate::mesh::MeshError;

/// Why a load is not solved.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SolveError {
    #[error(transparent)]
    Mesh(#[from] MeshError),
    #[error(
        "the wall's equations have no solution of their own\n  fix: hold the wall at its openings, and \
         check that its mesh hangs together"
    )]
    Singular,
    #[error(
        "no equilibrium was found beyond {:.1} % of the load: the wall buckles or is torn through \
         there, or elements are crushed\n  fix: give a smaller load, a larger patch, a finer mesh, or \
         another law", 100.0 * share
    )]
    Lost { share: f64 },
}

impl From<Singular> for SolveError {
    fn from(_: Singular) -> Self {
        Self::Singular
    }
}
