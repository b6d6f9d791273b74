//! Rig descriptions and trial bundles, and what the device needs of them.
//!
//! [`Bundle::open`] reads a folder strictly; [`lumen_from_bundle`] turns its vessel into the
//! sparse distance field of `cathforce_mechanics::Lumen`.

#![forbid(unsafe_code)]

pub mod bundle;
mod error;
pub mod geometry;
pub mod lumen;
mod nearest;
mod table;
mod vessel;

pub use bundle::{Bundle, Trial};
pub use error::{BundleError, Cause, Place, Warning};
pub use vessel::{
    CELL_M, DEVICE_LUMEN_BYTES, LumenBuildError, LumenReport, Vessel, WallSource, lumen_from_bundle,
};
