//! From a wall in finite elements to the wall that the device runs.
//!
//! The device's wall is a bed of springs: a piece of instrument of one contact spacing presses with
//! N = k φ_h(i) on an indentation i (docs/explanation/model.md (10) and (39)). The reduction presses
//! one such piece on the finite elements, station by station along the centre lines, and finds
//!
//! * k at each station, from loads so small that the wall is linear: the stiffness field;
//! * the two parameters of φ_h, one pair for the whole vessel, from large loads at a few stations: the
//!   stiffening curve.
//!
//! A bed of springs has no memory of its neighbours, and a wall has: what a load moves one contact
//! spacing away is reported as [`Field::spread`], and is the largest error of a bed of springs where an
//! instrument lies on the wall.

mod curve;
mod errors;
mod field;

pub use curve::{Curve, Stiffening, indentation_mm};
pub use errors::Errors;
pub use field::{Field, Probe, Station, StationStiffness, probes, stations, stiffness_field};
