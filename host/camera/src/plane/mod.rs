//! The plane in which the catheter lies.

pub mod file;
pub mod world;
