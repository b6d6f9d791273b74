//! The model against problems whose solution is known: closed forms and exact integrals.
//!
//! Each figure is carried with the name of its source. What the model cannot be held to: rows
//! that need shear (`timoshenko_cantilever`, `reissner_shear_cantilever` beyond GA → ∞), columns
//! whose far end is clamped or twisted (`buckling`: clamped–clamped, Michell's ring, the
//! localised helix; the model's tip is free), and `salehizadeh_ICE`, which has parameters of
//! another catheter but no figure that they should give.

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
mod tube;

/// The model in double precision, of as many links as the device has.
type Chain = cathforce_mechanics::Model<f64>;
