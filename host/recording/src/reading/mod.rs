//! Reads recordings and surveys their frames.

pub(crate) mod container;
mod contents;
pub(crate) mod reader;
pub(crate) mod survey;
