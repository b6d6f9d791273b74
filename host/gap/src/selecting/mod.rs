//! The search for the effects that the data support.

pub mod defect_correction;
pub mod exchange;
pub mod extend;
pub mod impostor;
pub mod pairs;
pub mod prune;
pub mod requested;
pub mod reselect;
pub mod select;
pub mod selection;
