//! From a wall to the lumen that the device reads: bricks of stored distances and normals.

mod beside;
mod build;
mod grid;
mod options;
mod quality;
mod stored;

pub(crate) use beside::widest_m;
pub use build::build_lumen;
pub(crate) use build::may_fit;
pub use options::{BuiltLumen, DEVICE_LUMEN_BYTES, LumenOptions};
pub use quality::{LumenQuality, Spread, interpolate, measure, measure_against};
pub use stored::{StoredBrick, StoredNode, stored_bricks, stored_normal};
