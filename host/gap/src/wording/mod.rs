//! Effects, parameters and places in plain words, for the sentence of an answer.

mod catheter;
mod clause;
mod drive;
mod place;
mod told;
mod transmission;

pub use place::{channel, place};
pub use told::{capitalised, name, size, so_far, values};
