//! The model against problems whose solution is known: closed forms and exact integrals.
//!
//! Each figure is carried with the name of its source, a file of ../shared/references; of every
//! file every row is here, but for those that the model cannot be held to:
//!
//! - `timoshenko_cantilever`, `reissner_shear_cantilever` beyond GA → ∞: they need shear.
//! - `buckling`, twisted columns (Greenhill, Michell's ring, the localised helix): the far end is
//!   held against turning, or a ring closed; the model's tip is free, and a guide that were a hinge
//!   would hand on its torque along the tangent. Clamped–clamped ones are four free ones end to end.
//! - `cantilever_dynamics`, `explicit_dt_bounds`: limits of explicit steps; these are implicit.
//! - `bend45`, Bathe & Bolourchi at 300: itself 2.9 % of the motion off the exact solution.
//! - `rod_in_tube`, the pair of forces where a bend without clearance begins, and what compression presses
//!   with; `capstan`, a rod that is pushed: a stored tube has clearance, in which a pushed rod bows.
//! - `salehizadeh_ICE`, parameters of another catheter and of a stream, and no motion that they
//!   should give; its drag goes with the square of the stream's speed, docs/explanation/model.md (36) has the force itself.
//! - `published.md`, but for its material laws: errors and sweeps of other simulators on vessels
//!   that are not there. `peers.md` is of `cargo xtask bench`.

#[path = "../common/rod.rs"]
mod rod;
#[path = "../common/wall.rs"]
mod wall;

mod bend45;
mod buckling;
mod capstan;
mod columns;
mod dynamics;
mod elastica;
mod energy;
mod published;
mod tube;

/// The model in double precision, of as many links as the device has.
type Chain = cathforce_mechanics::Model<f64>;
