//! Single effects against closed forms, and all effects at once.

#[path = "../common/rod.rs"]
mod rod;
#[path = "../common/wall.rs"]
mod wall;

mod free;
mod pressed;
mod random;
mod tendons;
