//! The model against problems whose solution is known: closed forms and exact integrals.
//!
//! Each figure is carried with the name of its source.

#[path = "../common/rod.rs"]
mod rod;
#[path = "../common/wall.rs"]
mod wall;

mod bend45;
mod buckling;
mod capstan;
mod dynamics;
mod elastica;
mod tube;

/// The model in double precision, of as many links as the device has.
type Chain = cathforce_mechanics::Model<f64>;
