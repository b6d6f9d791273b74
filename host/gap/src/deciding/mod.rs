//! The verdict: whether effects may be named, how certain they are, and what they may be mistaken for.

pub mod confidence;
pub mod detectable;
pub mod form;
pub mod interval;
pub mod posterior;
pub mod verdict;
