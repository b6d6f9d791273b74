//! Vessel geometry: signed distance to the wall, from a mesh or from a centreline.

mod bvh;
mod centreline;
mod mesh;
mod openings;
mod pieces;
mod refine;
mod regions;
mod rims;
mod stitch;
mod stl;
mod stl_ascii;
mod surface;
mod weld;

use nalgebra::Vector3;

pub use centreline::{Branch, CentrelineCause, Station, TubeWall, read_centreline};
pub use mesh::{Mesh, MeshCause, MeshRepairs};
pub use openings::Opening;
pub(crate) use openings::SLEEVE_M;
pub use pieces::PieceDoubts;
pub(crate) use regions::RegionalWall;
pub(crate) use rims::GAP_M;
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
    /// Facets from which places beside the wall are drawn at random; none where a wall is only
    /// known by its distance.
    fn facets(&self) -> usize {
        0
    }
    /// One of them, on the wall or near it, its normal into the lumen; `None` past an opening.
    fn facet(&self, _index: usize) -> Option<Triangle> {
        None
    }
}
