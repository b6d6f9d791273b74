//! Reads recordings and surveys their frames.

pub(crate) mod reader;
pub(crate) mod survey;
