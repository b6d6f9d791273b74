//! Stiffness of tissue from the cross-sections of a vessel under an ultrasound probe.
//!
//! A probe that presses on tissue deforms the vessels in it. Young's modulus and Poisson's ratio of the
//! tissue are those with which the vessel's cross-sections of a simulation overlap best with the masks
//! that were segmented from images, under known forces at known poses ("3D deformation simulation for
//! vascular tissue with 2D medical imaging").
//!
//! | file | what it holds |
//! | --- | --- |
//! | `block` | the mesh of a block with a hollow vessel |
//! | `probe` | poses, and the forces of the probe's pressure |
//! | `response` | how the vessel moves, for every stiffness from a few solutions |
//! | `section` | the cut of the deformed vessel by the image plane |
//! | `raster` | pixels that a cut covers, and the overlap with a mask |
//! | `png_file`, `description` | masks and the description as files |
//! | `study` | images together with the block, and how well a stiffness explains them |
//! | `fit`, `certainty` | the search, and how well the images tell its result |
//! | `noise`, `render` | masks of a known truth, to try all this with |
//!
//! Lengths are in millimetres, forces in newtons, moduli in kilopascals.

#![forbid(unsafe_code)]

mod block;
mod certainty;
mod description;
mod error;
mod fit;
mod noise;
mod png_file;
mod probe;
mod raster;
mod render;
mod response;
mod section;
mod study;

pub use block::{Block, Elements};
pub use certainty::{Interval, Known};
pub use description::{Description, FORMAT, ImageEntry};
pub use error::UltrasoundError;
pub use fit::{Epoch, Fit, Overlapped, Profiled, fit, fit_reusing};
pub use noise::ImageNoise;
pub use png_file::{mask_png, read_mask};
pub use probe::{OffTheBlock, Pose, unit_forces_n};
pub use raster::{Grid, Mask};
pub use render::{finer, render, sections};
pub use response::{Law, Loaded, Response, Tissue};
pub use section::Section;
pub use study::{Bounds, Image, Registration, Study};

/// A description of a block of gel, as the how-to page has it.
pub const EXAMPLE: &str = include_str!("example.toml");
