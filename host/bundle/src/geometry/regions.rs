//! A wall whose stiffness varies by region.

use nalgebra::Vector3;

use super::wall::{Triangle, Wall, WallPoint};
use crate::rig::WallRegion;

/// A wall with regions that are stiffer or softer than the rest.
pub(crate) struct RegionalWall {
    pub wall: Box<dyn Wall>,
    pub regions: Vec<WallRegion>,
}

impl Wall for RegionalWall {
    fn sample(&self, p: &Vector3<f64>) -> WallPoint {
        self.wall.sample(p)
    }

    fn bounds_m(&self) -> (Vector3<f64>, Vector3<f64>) {
        self.wall.bounds_m()
    }

    fn facets(&self) -> usize {
        self.wall.facets()
    }

    fn facet(&self, index: usize) -> Option<Triangle> {
        self.wall.facet(index)
    }

    fn stiffness_ratio(&self, p: &Vector3<f64>) -> f64 {
        let holds =
            |region: &&WallRegion| (p - Vector3::from(region.centre_m)).norm() <= region.radius_m;
        self.regions.iter().rev().find(holds).map_or(1.0, |region| region.stiffness_ratio)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::TubeWall;

    #[test]
    fn the_last_region_that_holds_a_point_counts() {
        let region = |x_m: f64, stiffness_ratio: f64| WallRegion {
            centre_m: [x_m, 0.0, 0.0],
            radius_m: 0.01,
            stiffness_ratio,
        };
        let wall = RegionalWall {
            wall: Box::new(TubeWall::new(&[])),
            regions: vec![region(0.0, 4.0), region(0.015, 0.5)],
        };
        for (x_m, ratio) in [(-0.0101, 1.0), (-0.0099, 4.0), (0.004, 4.0), (0.006, 0.5)] {
            assert_eq!(wall.stiffness_ratio(&Vector3::new(x_m, 0.0, 0.0)), ratio, "{x_m}");
        }
    }
}
