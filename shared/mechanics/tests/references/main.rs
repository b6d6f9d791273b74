//! The model against problems with known solutions: closed forms and exact integrals.
//!
//! Each figure names its source, a file of ../shared/references. All rows of these files are tested, except
//! those that the model cannot reproduce:
//!
//! - `timoshenko_cantilever`, `reissner_shear_cantilever` beyond GA → ∞: they need shear.
//! - `buckling`, twisted columns (Greenhill, Michell's ring, the localised helix): their far end cannot
//!   rotate, or the ring is closed. The model's tip is free, and a hinge at the guide would transmit its
//!   torque along the tangent. Columns clamped at both ends are four free ones end to end.
//! - `cantilever_dynamics`, `explicit_dt_bounds`: limits of explicit steps. The model's steps are implicit.
//! - `bend45`, Bathe & Bolourchi at 300: it deviates by 2.9 % of the motion from the exact solution.
//! - `rod_in_tube`, the pair of forces at the begin of a bend without clearance, and the pressure of a
//!   compressed rod; `capstan`, a pushed rod: a stored tube has clearance, in which a pushed rod bows.
//! - `salehizadeh_ICE`: it has parameters of another catheter and of a flow, but no resulting motion. Its
//!   drag grows with the square of the speed; docs/explanation/model.md (45) takes the force itself.
//! - `published.md`, except for its material laws: errors and parameter sweeps of other simulators on
//!   vessels that are not available. `cargo xtask bench` uses `peers.md`.

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

/// The model in double precision, with as many links as on the device.
type Chain = cathforce_mechanics::Model<f64>;
