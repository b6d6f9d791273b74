//! What the diagnosis knows of a rig. Nothing here depends on catheters or drives.

mod altered;
mod interface;
mod silhouette;

pub use altered::Altered;
pub use interface::{
    Along, Anchor, At, BROKEN_DOWN, Channel, Effect, Impostor, Nuisance, Parameter, Plant, Point,
    Quantity, Repeat, STANDING_M_PER_S, Sample, Segment, Swing, Trial, Units, are_confused,
};
pub use silhouette::Silhouette;
