//! Reduced-order beam and contact model of a catheter in a vessel.
//!
//! One [`step`] takes the drive's encoder positions and gives the contact force at every
//! node, the total force and moment on the vessel and the force and torque at the drive.
//! Formulation and numbered equations: `docs/model.md`.

#![no_std]
#![forbid(unsafe_code)]

mod algebra;
mod coaxial;
mod contact;
mod description;
mod drive_motion;
pub mod effects;
mod energy;
mod feed;
mod grid;
mod joint;
mod link_group;
mod load_sharing;
mod lumen;
mod model;
mod parameters;
mod proximity;
mod segments;
mod solve;
mod state;
mod step;
mod tables;
mod wrench;

pub use cathforce_scalar::{Number, Real};
pub use description::*;
pub use effects::{DriveTrain, EFFECTS, EffectInfo, Effects, Measurement, ParameterInfo};
pub use lumen::*;
pub use model::Model;
pub use parameters::*;
pub use state::{Drive, Drives, Loads, Outputs, State};
pub use step::{settle, settle_loaded, step, step_loaded};

/// Most links (and nodes) inside the vessel, unless a [`Model`] says otherwise.
pub const MAX_LINKS: usize = 64;
