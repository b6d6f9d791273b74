//! Where a surface ends: the rims of openings, gaps and cracks.

use std::collections::HashMap;

use nalgebra::Vector3;

use super::mesh::{Mesh, RIM, next};

/// A rim that encloses less than this share of a circle of the same circumference is a slit, like a
/// rectangle thirty times as long as wide, or the two sides of a crack.
const THIN: f64 = 0.1;
/// Openings that enclose no more than a circle of this radius are gaps, and closed \[m\].
pub(crate) const GAP_M: f64 = 0.3e-3;
/// A slit with more corners counts as a crack without a closer look.
const MOST_CORNERS: usize = 4000;

/// A rim has a crack where it comes within `CRACK_M` of itself after more than `FOLDED_M` \[m\].
const CRACK_M: f64 = 5e-6;
const FOLDED_M: f64 = 1e-3;

/// Kinds of rims.
#[derive(Debug)]
pub(super) enum RimKind {
    Opening,
    /// Nothing passes through it.
    Gap,
    /// A gap without width: its sides are joined, as [`Join`] says.
    Slit(Vec<Join>),
    /// Two sides that should be one.
    Crack {
        at: Vector3<f64>,
        length_m: f64,
    },
}

/// A step in joining the sides of a slit. Edges are those of the rim by their place in it, then
/// the outer ones of the facets in their order.
#[derive(Debug)]
pub(super) enum Join {
    /// A facet on two edges that follow each other; its corners by their place in the rim.
    Facet { edges: [usize; 2], corners: [usize; 3] },
    /// Two edges that are the same.
    Edges([usize; 2]),
}

impl Mesh {
    /// The half-edges of every rim, in order. Where rims touch in a corner they are parted, so
    /// that none visits a corner twice.
    pub(super) fn rims(&self) -> Vec<Vec<usize>> {
        let mut seen = vec![false; self.twin.len()];
        let mut rims = Vec::new();
        for start in (0..self.twin.len()).filter(|&half_edge| self.twin[half_edge] == RIM) {
            let mut rim: Vec<usize> = Vec::new();
            let mut place_of = HashMap::new();
            let mut at = start;
            while !seen[at] {
                seen[at] = true;
                if let Some(place) = place_of.insert(self.vertex[at], rim.len()) {
                    let parted = rim.split_off(place);
                    for &half_edge in &parted[1..] {
                        place_of.remove(&self.vertex[half_edge]);
                    }
                    place_of.insert(self.vertex[at], place);
                    rims.push(parted);
                }
                rim.push(at);
                // Around the vertex at its end, to the next half-edge without a twin.
                at = next(at);
                while self.twin[at] != RIM {
                    at = next(self.twin[at] as usize);
                }
            }
            if !rim.is_empty() {
                rims.push(rim);
            }
        }
        rims
    }

    pub(super) fn start(&self, half_edge: usize) -> Vector3<f64> {
        self.positions[self.vertex[half_edge] as usize]
    }

    /// The kind of a rim, by its shape.
    pub(super) fn rim_kind(&self, rim: &[usize]) -> RimKind {
        let points: Vec<_> = rim.iter().map(|&half_edge| self.start(half_edge)).collect();
        let edges = || points.iter().zip(points.iter().cycle().skip(1));
        let length_m: f64 = edges().map(|(a, b)| (b - a).norm()).sum();
        let fan = |(a, b): (&Vector3<f64>, &Vector3<f64>)| (a - points[0]).cross(&(b - points[0]));
        let area_m2 = 0.5 * edges().map(fan).sum::<Vector3<f64>>().norm();
        let is_gap = |area_m2: f64| (area_m2 / std::f64::consts::PI).sqrt() < GAP_M;
        if 4.0 * std::f64::consts::PI * area_m2 >= THIN * length_m * length_m {
            return match fold(&points) {
                _ if is_gap(area_m2) => RimKind::Gap,
                Some((at, length_m)) => RimKind::Crack { at, length_m },
                None => RimKind::Opening,
            };
        }
        if points.len() <= MOST_CORNERS {
            let vertices: Vec<u32> = rim.iter().map(|&h| self.vertex[h]).collect();
            let (joins, area_m2) = join(&points, &vertices);
            if is_gap(area_m2) {
                return RimKind::Slit(joins);
            }
        }
        RimKind::Crack { at: narrowest(&points), length_m: 0.5 * length_m }
    }
}

/// Joins the sides of a rim by facets over its shortest diagonals. Also returns their area \[m²\].
fn join(points: &[Vector3<f64>], vertices: &[u32]) -> (Vec<Join>, f64) {
    // The remaining rim: each corner with the edge that begins there.
    let mut left: Vec<(usize, usize)> = (0..points.len()).map(|k| (k, k)).collect();
    let (mut joins, mut area_m2, mut edges) = (Vec::new(), 0.0, points.len());
    while left.len() > 1 {
        let count = left.len();
        let corners = |k: usize| [0, 1, 2].map(|step| left[(k + step) % count].0);
        let diagonal_m = |k: usize| {
            let [a, _, c] = corners(k);
            if vertices[a] == vertices[c] { -1.0 } else { (points[a] - points[c]).norm() }
        };
        let Some(k) = (0..count).min_by(|&a, &b| diagonal_m(a).total_cmp(&diagonal_m(b))) else {
            break;
        };
        let of = [left[k].1, left[(k + 1) % count].1];
        let [a, b, c] = corners(k);
        if vertices[a] == vertices[c] {
            joins.push(Join::Edges(of));
            // The later one is removed first, so that the other keeps its index.
            left.remove(k.max((k + 1) % count));
            left.remove(k.min((k + 1) % count));
        } else {
            joins.push(Join::Facet { edges: of, corners: [a, b, c] });
            area_m2 += 0.5 * (points[b] - points[a]).cross(&(points[c] - points[a])).norm();
            left[k].1 = edges;
            edges += 1;
            left.remove((k + 1) % count);
        }
    }
    (joins, area_m2)
}

/// Where a crack runs into the rim of an opening: the rim returns to a place where it was before.
/// Also returns the length of the crack \[m\].
fn fold(points: &[Vector3<f64>]) -> Option<(Vector3<f64>, f64)> {
    if points.len() > MOST_CORNERS {
        return None;
    }
    let mut along_m = vec![0.0];
    for (k, point) in points.iter().enumerate() {
        let edge = points[(k + 1) % points.len()] - point;
        along_m.push(along_m[k] + edge.norm());
    }
    let around_m = along_m[points.len()];
    for (k, point) in points.iter().enumerate() {
        for (edge, from) in points.iter().enumerate() {
            let path_m = |place: usize| {
                let one_way_m = (along_m[place] - along_m[k]).abs();
                one_way_m.min(around_m - one_way_m)
            };
            let path_m = path_m(edge).min(path_m(edge + 1));
            let along = points[(edge + 1) % points.len()] - from;
            let share = ((point - from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
            if path_m > FOLDED_M && (from + along * share - point).norm() < CRACK_M {
                return Some((*point, 0.5 * path_m));
            }
        }
    }
    None
}

/// Where two edges of a rim that do not follow each other are nearest.
fn narrowest(points: &[Vector3<f64>]) -> Vector3<f64> {
    // A part of a long rim will do: its sides run along each other.
    let count = points.len();
    let middle = |k: usize| 0.5 * (points[k % count] + points[(k + 1) % count]);
    let mut nearest = (f64::INFINITY, points[0]);
    for k in 0..count.min(MOST_CORNERS) {
        for other in k + 2..count.min(MOST_CORNERS) {
            let distance_m = (middle(k) - middle(other)).norm();
            if distance_m < nearest.0 && (other + 1) % count != k {
                nearest = (distance_m, middle(k));
            }
        }
    }
    nearest.1
}
