//! Vessel geometry: signed distance to the wall, from a mesh or from a centreline.

mod bvh;
mod centreline;
mod mesh;
mod openings;
mod refine;
mod regions;
mod stl;
mod surface;

use nalgebra::Vector3;

pub use centreline::{Branch, CentrelineCause, Station, TubeWall, read_centreline};
pub use mesh::{Mesh, MeshCause, MeshRepairs};
pub use openings::Opening;
pub(crate) use openings::{GAP_M, SLEEVE_M};
pub(crate) use regions::RegionalWall;
pub use stl::{StlCause, Triangle, read_stl};
pub use surface::{MeshWall, SurfaceModel};

/// The wall as seen from one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallPoint {
    /// Signed distance \[m\], positive inside the lumen.
    pub distance_m: f64,
    /// Unit normal into the lumen.
    pub normal: Vector3<f64>,
    /// How far past an opening the point lies \[m\]; 0 beside the wall.
    pub beyond_m: f64,
}

/// A wall that can be asked for its distance anywhere.
pub trait Wall: Sync {
    /// The wall as seen from `p` \[m\].
    fn sample(&self, p: &Vector3<f64>) -> WallPoint;
    /// Lowest and highest corner of a box around the wall \[m\].
    fn bounds_m(&self) -> (Vector3<f64>, Vector3<f64>);
    /// Its stiffness at `p` \[m\] over the nominal one.
    fn stiffness_ratio(&self, _p: &Vector3<f64>) -> f64 {
        1.0
    }
}
