//! Reduced-order beam and contact model of a catheter in a vessel.
//!
//! The instrument is a discrete Kirchhoff rod of stretchable links, solved by an articulated-body
//! recursion. One [`step`] takes the positions of the drives and computes the contact force at every
//! node, the total force and moment on the vessel, and the force and torque at the drives.
//! `docs/explanation/model.md` has the formulation with numbered equations.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(not(target_os = "none"))]
extern crate alloc;

#[cfg(not(target_os = "none"))]
mod abreast;
#[cfg(not(target_os = "none"))]
mod abreast_chains;
#[cfg(not(target_os = "none"))]
mod abreast_tick;
mod algebra;
mod assembly;
mod catheter_solve;
mod chain;
mod coaxial;
mod compiled;
mod contact;
mod creep;
mod description;
mod drive_motion;
pub mod effects;
mod energy;
mod feed;
mod grid;
mod io;
mod joint;
mod link_group;
mod load_sharing;
mod lumen;
mod math;
mod model;
mod outputs;
mod overlap;
mod parameters;
mod predict;
mod proximity;
mod scheme;
mod segments;
mod settle;
mod solve;
mod state;
mod step;
mod tables;
mod validation;
mod wall_sampling;
mod wrench;

#[cfg(not(target_os = "none"))]
pub use abreast::{Attendant, Found, Kind, side_by_side};
pub use cathforce_scalar::{Number, Real};
pub use compiled::{Compiled, MOST_LINKS, settle, settle_loaded, step, step_loaded};
#[cfg(not(target_os = "none"))]
pub use compiled::{CompiledAbreast, step_abreast};
pub use description::*;
pub use effects::{DriveTrain, EFFECTS, EffectInfo, Effects, Measurement, ParameterInfo};
pub use io::{Drive, Drives, Loads, Outputs};
pub use lumen::*;
pub use model::Model;
pub use parameters::*;
pub use state::State;
pub use validation::DescriptionError;

/// Largest number of links (and nodes) inside the vessel, by default.
pub const MAX_LINKS: usize = 64;
