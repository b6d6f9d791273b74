//! Effects against what is known of them, and all of them at once.

#[path = "../common/rod.rs"]
mod rod;
#[path = "../common/wall.rs"]
mod wall;

mod free;
mod pressed;
mod random;
