//! What a bus carries at the moment, gathered frame by frame and drawn for a terminal.

mod advice;
mod state;
mod targets;
mod view;

pub use state::Monitor;
pub use targets::Targets;
pub use view::draw;
