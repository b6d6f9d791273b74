//! What a recording can tell before it is made, and what to record next.

pub mod experiment;
pub mod isolability;
pub mod protocol;
pub mod spike;
