//! Reads recordings and surveys their frames.

mod contents;
pub(crate) mod reader;
pub(crate) mod survey;
