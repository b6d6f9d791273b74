//! Global searches.

pub mod choice;
pub mod cma_es;
pub mod cross_entropy;
mod draw;
pub mod multi_start;
