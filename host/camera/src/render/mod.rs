//! Renders pictures of boards and catheters of known shape, as a camera with a real lens, uneven light
//! and noise would take them. Tests and reproductions measure the rest of this crate by it.

pub mod camera;
pub mod curve;
pub mod film;
pub mod lab;
pub mod scene;
pub mod stand;
pub mod study;
