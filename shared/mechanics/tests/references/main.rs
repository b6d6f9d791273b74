//! The model against problems whose solution is known: closed forms and exact integrals.
//!
//! Each figure is carried with the name of its source.

#[path = "../common/rod.rs"]
mod rod;
#[path = "../common/wall.rs"]
mod wall;

mod bend45;
mod dynamics;
mod elastica;
