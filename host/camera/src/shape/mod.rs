//! Tip and shape of the catheter in a picture.

pub mod centreline;
pub mod contrast;
pub mod mask;
pub mod path;
pub mod thin;
pub mod track;
