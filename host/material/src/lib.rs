//! Laws of a wall's material, and their fits to tensile tests.
//!
//! A [`Material`] is one of four isotropic laws with its parameters. Stress and energy are those of
//! an incompressible material; a finite element adds its own resistance to a change of volume.
//! [`Curve`] is a tensile test, read from a CSV file. [`fit`] finds the parameters of a law that
//! follow it best, with intervals.

#![forbid(unsafe_code)]

mod curve;
mod error;
mod fit;
mod law;
mod names;
mod printed;
mod read;
mod stability;

pub use curve::{Curve, Point, StressMeasure};
pub use error::{CurveCause, CurveError};
pub use fit::{Fit, FitError, Parameter, fit};
pub use law::{Law, LawError, Material};
pub use printed::Form;
pub use read::{ReadOptions, Specimen, read_curve};
pub use stability::unstable_at;
