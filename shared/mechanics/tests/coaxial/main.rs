//! A guidewire in the catheter: stiffness and pre-curvature of the overlap, loads on both drives, and both
//! instruments through a bend.

#[path = "../common/rod.rs"]
mod rod;
#[path = "../common/wall.rs"]
mod wall;

mod bend;
mod drives;
mod overlap;
mod pair;
