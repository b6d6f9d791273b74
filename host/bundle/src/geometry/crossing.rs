//! Where a surface runs through itself.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::bvh::Bvh;
use super::mesh::Mesh;
use super::wall::Triangle;

/// Facets that touch without running through each other are no crossing: share of an edge or a facet by
/// which one must pass the other.
const THROUGH: f64 = 1e-6;

/// Pairs of facets that run through each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    pub pairs: usize,
    /// The one nearest to the middle of all \[mm\].
    pub at_mm: [f64; 3],
}

impl Mesh {
    /// Counts pairs of facets that run through each other; neighbours, which share a corner, do not.
    pub(super) fn crossing(&self) -> Option<Crossing> {
        let triangles = (0..self.len()).map(|t| self.triangle(t)).collect::<Vec<_>>();
        let bvh = Bvh::new(triangles.clone());
        let corners = |t: usize| &self.vertex[3 * t..3 * t + 3];
        let of = |first: usize| {
            let mut near = Vec::new();
            bvh.overlapping(&triangles[first], &mut near);
            let others = near.into_iter().filter(|&second| {
                second > first
                    && !corners(first).iter().any(|corner| corners(second).contains(corner))
            });
            others
                .filter_map(|second| crossing_at(&triangles[first], &triangles[second]))
                .collect::<Vec<_>>()
        };
        let places = (0..triangles.len()).into_par_iter().flat_map_iter(of).collect::<Vec<_>>();
        let middle = places.iter().sum::<Vector3<f64>>() / places.len() as f64;
        let nearest = places
            .iter()
            .min_by(|a, b| (*a - middle).norm_squared().total_cmp(&(*b - middle).norm_squared()))?;
        Some(Crossing { pairs: places.len(), at_mm: (nearest * 1e3).into() })
    }
}

/// Where an edge of one triangle passes through the other.
fn crossing_at(a: &Triangle, b: &Triangle) -> Option<Vector3<f64>> {
    let edges = |t: &Triangle| [0, 1, 2].map(|k| (t[k], t[(k + 1) % 3]));
    let of_a = edges(a).into_iter().find_map(|(from, to)| pierced(from, to, b));
    of_a.or_else(|| edges(b).into_iter().find_map(|(from, to)| pierced(from, to, a)))
}

/// Where a segment passes through a triangle. Source: Möller and Trumbore, Fast, minimum storage
/// ray-triangle intersection (1997).
fn pierced(from: Vector3<f64>, to: Vector3<f64>, triangle: &Triangle) -> Option<Vector3<f64>> {
    let [first, second] = [triangle[1] - triangle[0], triangle[2] - triangle[0]];
    let way = to - from;
    let across = way.cross(&second);
    let scale = first.dot(&across);
    // Parallel, to rounding.
    if scale.abs() <= 1e-12 * first.norm() * second.norm() * way.norm() {
        return None;
    }
    let offset = from - triangle[0];
    let u = offset.dot(&across) / scale;
    let beside = offset.cross(&first);
    let v = way.dot(&beside) / scale;
    let share = second.dot(&beside) / scale;
    let is_inside = u > THROUGH && v > THROUGH && u + v < 1.0 - THROUGH;
    (is_inside && share > THROUGH && share < 1.0 - THROUGH).then(|| from + way * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_segment_passes_through_a_triangle_or_touches_it() {
        let triangle = [Vector3::zeros(), Vector3::x(), Vector3::y()];
        let at = |x: f64, y: f64, z: f64| {
            pierced(Vector3::new(x, y, -1.0), Vector3::new(x, y, z), &triangle)
        };
        assert_eq!(at(0.25, 0.25, 1.0), Some(Vector3::new(0.25, 0.25, 0.0)));
        assert_eq!((at(0.25, 0.25, 0.0), at(0.0, 0.5, 1.0), at(1.0, 1.0, 1.0)), (None, None, None));
    }
}
