//! Writes recordings, and files that are written whole or not at all.

pub(crate) mod atomic;
pub(crate) mod background;
pub(crate) mod writer;
