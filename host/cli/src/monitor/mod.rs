//! What a bus carries at the moment, gathered frame by frame and drawn for a terminal.

mod advice;
mod state;
mod view;

pub use state::Monitor;
pub use view::draw;
