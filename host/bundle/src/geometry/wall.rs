//! The wall of a vessel, however it is described.

use nalgebra::Vector3;

/// Corners of a triangle \[m\].
pub type Triangle = [Vector3<f64>; 3];

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
