//! Reference solver for the host, against which the device's model is measured.
//!
//! A discrete elastic rod in absolute coordinates (node positions and the twist of each edge),
//! on a fine mesh, implicit in time, solved to convergence in every step, with Signorini's and
//! Coulomb's laws met exactly by a semi-smooth Newton method. It has no code, coordinates,
//! integrator or friction treatment in common with the device's model, and depends on no other
//! package of the project.

#![forbid(unsafe_code)]

mod balance;
mod band;
mod beyond;
mod contact;
mod curve;
mod drive;
mod joint;
mod lumen;
mod problem;
mod rod;
mod sample;
mod simulation;
mod state;

pub use beyond::{BRANCHES, Fall, Memory, Relaxing};
pub use contact::Touch;
pub use curve::{Station, Tube, TubePath};
pub use drive::{Drive, Schedule};
pub use lumen::{Lumen, WallPoint};
pub use problem::{Beyond, Entry, Flow, Integrator, Numerics, Problem, TipLoad, WallLaw};
pub use rod::{Curve, Rod, Section};
pub use sample::Sample;
pub use simulation::{Effort, Simulation, SolveError, run};
