//! A guidewire in the catheter: stiffness and pre-curvature where they overlap, forces at both
//! drives, and both through a bend.

#[path = "../common/rod.rs"]
mod rod;
#[path = "../common/wall.rs"]
mod wall;

mod bend;
mod drives;
mod overlap;
mod pair;
