//! Finds a checkerboard in a picture.

pub mod candidates;
pub mod find;
pub mod grid;
pub mod refine;
