//! Where the gap lies and how large it is: estimates with intervals, figures, places, shapes.

pub mod band;
pub mod descriptors;
pub mod figures;
pub mod increments;
pub mod locate;
pub mod map;
pub mod on_vessel;
pub mod remainder;
pub mod series;
pub mod snaps;
