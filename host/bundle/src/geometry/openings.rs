//! The openings of a mesh, and the sleeves that continue the wall past them.
//!
//! A vessel's surface ends where it was cut, but the instrument goes on. Every opening gets a straight
//! sleeve, so that distances past it and beside its rim are those of a wall that continues. Gaps that
//! are too small for any instrument are closed.

use nalgebra::{Matrix3, Vector3};

use super::mesh::{Mesh, RIM, next};
use super::rims::{Join, RimKind};

/// Length of a sleeve \[m\].
pub(crate) const SLEEVE_M: f64 = 8e-3;
/// Step by which a sleeve is shortened until it is clear of the rest of the vessel; also its least
/// length \[m\].
const SLEEVE_STEP_M: f64 = 0.5e-3;
/// Depth by which a sleeve may touch the wall that it continues \[m\].
const GRAZE_M: f64 = 50e-6;
/// A sleeve follows the taper of its vessel no steeper than this.
const STEEPEST: f64 = 0.3;
/// Mean cosine between wall and cut above which an opening is a hole in a wall and not the end of a
/// tube.
const FLUSH: f64 = 0.7;

/// Where a surface ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Opening {
    /// Mean of the rim, by length \[m\].
    pub centre_m: Vector3<f64>,
    /// Mean distance of the rim from the axis \[m\].
    pub radius_m: f64,
    /// Unit vector along the vessel, outwards; normal to the wall if `is_flush`.
    pub axis: Vector3<f64>,
    /// Whether it is a hole in the wall and not the end of a tube.
    pub is_flush: bool,
    /// Corners of the rim, in order \[m\].
    pub rim_m: Vec<Vector3<f64>>,
    /// Length of its sleeve \[m\]: shorter than [`SLEEVE_M`] if another branch lies in front.
    pub sleeve_m: f64,
}

impl Mesh {
    /// Puts a sleeve on every opening and closes gaps. Facets must face the lumen.
    ///
    /// `depth_m`: distance of a point from the wall before any sleeve, positive in the lumen \[m\].
    /// Returns the openings and the number of gaps.
    pub(crate) fn extend(
        &mut self,
        depth_m: impl Fn(&Vector3<f64>) -> f64,
    ) -> (Vec<Opening>, usize) {
        let (mut openings, mut gaps) = (Vec::new(), 0);
        for rim in self.rims() {
            match self.rim_kind(&rim) {
                // A crack is refused when a mesh is read.
                RimKind::Opening | RimKind::Crack { .. } => {
                    let mut opening = self.opening(&rim);
                    let ways = self.ways_on(&rim, &opening.axis);
                    opening.sleeve_m = clear_m(&opening.rim_m, &ways, &depth_m);
                    self.put_sleeve(&rim, &ways, opening.sleeve_m);
                    openings.push(opening);
                }
                RimKind::Gap => {
                    self.close(&rim, self.opening(&rim).centre_m);
                    gaps += 1;
                }
                RimKind::Slit(joins) => {
                    self.join_sides(&rim, &joins);
                    gaps += 1;
                }
            }
        }
        self.smooth_normals();
        (openings, gaps)
    }

    fn opening(&self, rim: &[usize]) -> Opening {
        let rim_m: Vec<_> = rim.iter().map(|&half_edge| self.start(half_edge)).collect();
        let edge = |k: usize| (rim_m[k], rim_m[(k + 1) % rim_m.len()]);
        let lengths: Vec<_> = (0..rim_m.len()).map(|k| (edge(k).1 - edge(k).0).norm()).collect();
        let around_m: f64 = lengths.iter().sum();
        let mean = |of: &dyn Fn(usize) -> Vector3<f64>| -> Vector3<f64> {
            (0..rim_m.len()).map(|k| of(k) * lengths[k]).sum::<Vector3<f64>>() / around_m
        };
        let centre_m = mean(&|k| 0.5 * (edge(k).0 + edge(k).1));

        let facet = |k: usize| self.area_normal(rim[k] / 3).try_normalize(0.0).unwrap_or_default();
        // Across the rim in the plane of the last facet, out of the vessel.
        let onwards: Vector3<f64> =
            (0..rim.len()).map(|k| (edge(k).1 - edge(k).0).cross(&facet(k))).sum();
        let wall = mean(&facet);
        let is_flush = wall.norm() > FLUSH;
        let axis = if is_flush {
            -wall.normalize()
        } else {
            // The direction that lies in all walls around the rim, whatever the cut.
            let spread: Matrix3<f64> =
                (0..rim.len()).map(|k| facet(k) * facet(k).transpose() * lengths[k]).sum();
            let eigen = spread.symmetric_eigen();
            let along = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
            if along.dot(&onwards) < 0.0 { -along } else { along }
        };
        let from_axis = |k: usize| {
            let from_centre = 0.5 * (edge(k).0 + edge(k).1) - centre_m;
            (from_centre - axis * axis.dot(&from_centre)).norm()
        };
        let radius_m = (0..rim.len()).map(|k| from_axis(k) * lengths[k]).sum::<f64>() / around_m;
        Opening { centre_m, radius_m, axis, is_flush, rim_m, sleeve_m: 0.0 }
    }

    /// Unit vectors along which the wall continues from each corner of a rim: the axis, inclined by
    /// the taper of the wall, which is averaged over an eighth of the rim.
    fn ways_on(&self, rim: &[usize], axis: &Vector3<f64>) -> Vec<Vector3<f64>> {
        let normals: Vec<_> = rim
            .iter()
            .map(|&half_edge| self.normals[self.corner_normal[half_edge] as usize])
            .collect();
        let reach = rim.len() / 16;
        (0..rim.len())
            .map(|k| {
                let window = (0..=2 * reach).map(|i| (k + rim.len() + i - reach) % rim.len());
                let taper =
                    window.map(|i| normals[i].dot(axis)).sum::<f64>() / (2 * reach + 1) as f64;
                let flush = taper.abs() > FLUSH;
                let lean = if flush { 0.0 } else { taper.clamp(-STEEPEST, STEEPEST) };
                (axis - normals[k] * lean).normalize()
            })
            .collect()
    }

    fn put_sleeve(&mut self, rim: &[usize], ways: &[Vector3<f64>], length_m: f64) {
        let count = rim.len();
        let first_vertex = self.positions.len();
        for (&half_edge, way) in rim.iter().zip(ways) {
            self.positions.push(self.start(half_edge) + way * length_m);
            self.beyond_m.push(length_m);
        }
        // Two triangles on the edge from a to b: b, a, far a; b, far a, far b.
        let first = self.vertex.len();
        for (k, &half_edge) in rim.iter().enumerate() {
            let far = |k: usize| (first_vertex + k % count) as u32;
            let (a, b) = (self.vertex[half_edge], self.vertex[next(half_edge)]);
            let own = first + 6 * k;
            let (before, after) =
                (first + 6 * ((k + count - 1) % count), first + 6 * ((k + 1) % count));
            self.vertex.extend([b, a, far(k), b, far(k), far(k + 1)]);
            self.twin.extend(
                [half_edge, before + 5, own + 3, own + 2].map(|half_edge| half_edge as u32),
            );
            self.twin.extend([RIM, (after + 1) as u32]);
            self.twin[half_edge] = own as u32;
        }
    }

    /// Joins the sides of a slit.
    fn join_sides(&mut self, rim: &[usize], joins: &[Join]) {
        let mut edges = rim.to_vec();
        let vertices: Vec<u32> = rim.iter().map(|&half_edge| self.vertex[half_edge]).collect();
        for join in joins {
            match join {
                Join::Edges([a, b]) => {
                    let [a, b] = [edges[*a], edges[*b]];
                    self.twin[a] = b as u32;
                    self.twin[b] = a as u32;
                }
                Join::Facet { edges: [first, second], corners } => {
                    let own = self.vertex.len();
                    let [a, b, c] = corners.map(|corner| vertices[corner]);
                    let [first, second] = [edges[*first], edges[*second]];
                    self.vertex.extend([b, a, c]);
                    self.twin.extend([first as u32, RIM, second as u32]);
                    self.twin[first] = own as u32;
                    self.twin[second] = own as u32 + 2;
                    edges.push(own + 1);
                }
            }
        }
    }

    /// Closes a rim by triangles around a point in its middle.
    fn close(&mut self, rim: &[usize], middle_m: Vector3<f64>) {
        let middle = self.positions.len() as u32;
        self.positions.push(middle_m);
        self.beyond_m.push(0.0);
        let (first, count) = (self.vertex.len(), rim.len());
        for (k, &half_edge) in rim.iter().enumerate() {
            let (a, b) = (self.vertex[half_edge], self.vertex[next(half_edge)]);
            let beside = |k: usize| first + 3 * (k % count);
            self.vertex.extend([b, a, middle]);
            let twins = [half_edge, beside(k + count - 1) + 2, beside(k + 1) + 1];
            self.twin.extend(twins.map(|half_edge| half_edge as u32));
            self.twin[half_edge] = beside(k) as u32;
        }
    }
}

/// Length at which a sleeve would become a wall in the lumen of another branch \[m\].
fn clear_m(
    rim_m: &[Vector3<f64>],
    ways: &[Vector3<f64>],
    depth_m: impl Fn(&Vector3<f64>) -> f64,
) -> f64 {
    let steps = (SLEEVE_M / SLEEVE_STEP_M).round() as usize;
    let blocked = |step: &usize| {
        let along_m = SLEEVE_STEP_M * *step as f64;
        rim_m.iter().zip(ways).any(|(corner, way)| depth_m(&(corner + way * along_m)) > GRAZE_M)
    };
    let first = (1..=steps).find(blocked).unwrap_or(steps + 1);
    SLEEVE_STEP_M * (first - 1).max(1) as f64
}
