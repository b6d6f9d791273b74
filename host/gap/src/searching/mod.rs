//! The search for the effects that the data support.

pub mod beam;
pub mod defect_correction;
pub mod requested;
pub mod selection;
pub mod selector;
pub mod singles;
