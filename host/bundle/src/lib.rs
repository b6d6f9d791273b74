//! Rig descriptions and trial bundles, and what the device needs of them.
//!
//! [`Bundle::open`] reads a folder strictly; [`lumen_from_bundle`] turns its vessel into the
//! sparse distance field of `cathforce_mechanics::Lumen`, [`to_description`] its rig into the
//! model's numbers, and [`device_image`] both into the bytes that configure a device.

#![forbid(unsafe_code)]

mod axis;
pub mod bundle;
mod description;
mod doubts;
mod driven;
mod entry;
mod error;
pub mod geometry;
mod image;
mod job;
mod limits;
pub mod lumen;
mod nearest;
mod place;
mod rig;
pub mod setting;
mod table;
mod template;
pub mod tips;
mod trial;
mod unit;
mod vessel;

pub use bundle::{Bundle, Trial};
pub use description::{SolverDefaults, describe, to_description};
pub use entry::{BesideOpening, VesselCause};
pub use error::{BundleError, Cause};
pub use image::{
    ImageBuildError, ImageOptions, ImageReport, check_rig, device_image, rig_description,
};
pub use job::{LumenJob, open_vessel};
pub use nearest::nearest;
pub use place::{Place, Warning};
pub use table::{Numbers, TableCause};
pub use template::{TemplatePlant, template};
pub use vessel::{
    CELL_M, LumenBuildError, LumenReport, LumenTooLarge, Vessel, WallSource, lumen_from_bundle,
};
