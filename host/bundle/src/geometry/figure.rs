//! What a surface is, by its shape: how wide its lumen is, whether its ends are capped, and whether it is
//! the wall of a phantom.

use nalgebra::Vector3;

use super::mesh::{Mesh, RIM, next};

/// Facets that meet at a smaller angle lie in one plane.
const FLAT_COS: f64 = 0.9962; // 5°
/// Facets that meet at a larger angle meet at an edge of the solid; such an edge is not curved.
const EDGE_COS: f64 = 0.766; // 40°
/// A flat part is a cap if it encloses this share of the area of a circle of its circumference.
const ROUND: f64 = 0.7;
/// Facets of a cap at least; two may be the side of a box.
const FEWEST_FACETS: usize = 3;
/// Caps that are named.
const MOST_CAPS: usize = 8;
/// Share of the curved surface that is hollow, from which on it is the wall of a phantom. The wall of a
/// vessel is hollow only where branches meet, a tube of constant thickness by half.
const HOLLOW: f64 = 0.35;

/// The shape of a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Figure {
    /// Half of volume over area, which of a tube is its radius \[m\].
    pub radius_m: f64,
    /// Length of the box around it, from corner to corner \[m\].
    pub span_m: f64,
    /// Flat ends of a closed surface, and the middles of the first ones \[mm\].
    pub caps: usize,
    pub caps_mm: [[f64; 3]; MOST_CAPS],
    /// Share of its curved parts that is curved inwards.
    pub hollow: f64,
}

impl Figure {
    /// The middles of caps that are named \[mm\].
    pub fn named_caps_mm(&self) -> &[[f64; 3]] {
        &self.caps_mm[..self.caps.min(MOST_CAPS)]
    }

    /// Whether a surface with loops is the wall of a phantom around its channels.
    pub fn is_phantom(&self) -> bool {
        self.hollow > HOLLOW
    }
}

impl Mesh {
    /// The shape of a surface whose volume, closed by lids over its rims, is given \[m³\]; negative if the
    /// facets face the lumen.
    pub(super) fn figure(&self, volume_m3: f64) -> Figure {
        let normals: Vec<_> = (0..self.len())
            .map(|t| self.area_normal(t).try_normalize(0.0).unwrap_or_default())
            .collect();
        let area_m2: f64 = (0..self.len()).map(|t| 0.5 * self.area_normal(t).norm()).sum();
        let infinite = Vector3::repeat(f64::INFINITY);
        let box_of =
            |(low, high): (Vector3<f64>, Vector3<f64>), p: &Vector3<f64>| (low.inf(p), high.sup(p));
        let (low, high) = self.positions.iter().fold((infinite, -infinite), box_of);
        let is_closed = self.twin.iter().all(|&twin| twin != RIM);
        let caps = if is_closed { self.caps_mm(&normals) } else { Vec::new() };
        let mut figure = Figure {
            radius_m: if area_m2 > 0.0 { 2.0 * volume_m3.abs() / area_m2 } else { 0.0 },
            span_m: (high - low).norm(),
            caps: caps.len(),
            hollow: self.hollow(&normals, volume_m3.signum()),
            ..Figure::default()
        };
        for (place, cap) in figure.caps_mm.iter_mut().zip(caps) {
            *place = cap;
        }
        figure
    }

    /// Share of the curvature that bends inwards, over edges that are none of the solid.
    fn hollow(&self, normals: &[Vector3<f64>], outwards: f64) -> f64 {
        let (mut inwards, mut all) = (0.0, 0.0);
        for half_edge in 0..self.vertex.len() {
            let twin = self.twin[half_edge];
            if twin == RIM || (twin as usize) < half_edge {
                continue;
            }
            let (own, other) = (normals[half_edge / 3], normals[twin as usize / 3]);
            let cos = own.dot(&other);
            if cos < EDGE_COS {
                continue;
            }
            let edge = self.start(next(half_edge)) - self.start(half_edge);
            // Positive where the surface bends away from its normals.
            let bend = own.cross(&other).dot(&edge) * outwards;
            all += bend.abs();
            inwards += (-bend).max(0.0);
        }
        if all > 0.0 { inwards / all } else { 0.0 }
    }

    /// Middles of flat round parts that edges of the solid bound \[mm\].
    fn caps_mm(&self, normals: &[Vector3<f64>]) -> Vec<[f64; 3]> {
        let mut seen = vec![false; self.len()];
        let mut caps = Vec::new();
        for start in 0..self.len() {
            if seen[start] {
                continue;
            }
            seen[start] = true;
            let (mut part, mut queue) = (vec![start], vec![start]);
            while let Some(facet) = queue.pop() {
                for half_edge in 3 * facet..3 * facet + 3 {
                    let other = self.twin[half_edge] as usize / 3;
                    if self.twin[half_edge] == RIM
                        || seen[other]
                        || normals[start].dot(&normals[other]) < FLAT_COS
                    {
                        continue;
                    }
                    seen[other] = true;
                    part.push(other);
                    queue.push(other);
                }
            }
            caps.extend(self.cap_mm(&part, normals));
        }
        caps
    }

    fn cap_mm(&self, part: &[usize], normals: &[Vector3<f64>]) -> Option<[f64; 3]> {
        if part.len() < FEWEST_FACETS {
            return None;
        }
        let is_own: std::collections::HashSet<usize> = part.iter().copied().collect();
        let (mut around_m, mut sharp_m) = (0.0, 0.0);
        let mut middle = Vector3::zeros();
        for half_edge in part.iter().flat_map(|facet| 3 * facet..3 * facet + 3) {
            let other = self.twin[half_edge] as usize / 3;
            if is_own.contains(&other) {
                continue;
            }
            let (from, to) = (self.start(half_edge), self.start(next(half_edge)));
            let length_m = (to - from).norm();
            around_m += length_m;
            middle += 0.5 * length_m * (from + to);
            if normals[half_edge / 3].dot(&normals[other]) < EDGE_COS {
                sharp_m += length_m;
            }
        }
        let area_m2: f64 = part.iter().map(|&facet| 0.5 * self.area_normal(facet).norm()).sum();
        let is_round = 4.0 * std::f64::consts::PI * area_m2 > ROUND * around_m * around_m;
        (around_m > 0.0 && is_round && sharp_m > 0.9 * around_m)
            .then(|| (middle * (1e3 / around_m)).into())
    }
}
