//! A triangle mesh as half-edges, with normals that are smooth except across creases.
//!
//! Half-edge `3 t + k` runs from corner k to corner k + 1 of triangle t, and corner
//! `3 t + k` is where it begins.

use std::collections::HashMap;

use nalgebra::Vector3;
use thiserror::Error;

use super::wall::Triangle;

/// No half-edge on the other side: the rim of an opening.
pub(crate) const RIM: u32 = u32::MAX;
/// Facets that meet at a larger angle meet at a crease: their normals are not averaged.
const CREASE_RAD: f64 = 40.0 * std::f64::consts::PI / 180.0;

/// Why a surface is no lumen.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MeshCause {
    #[error("every triangle of the surface is degenerate")]
    Degenerate,
    #[error(
        "more than two triangles share {edges} edges (the mesh is not manifold), the first at ({:.3}, {:.3}, {:.3}) \
         mm, and too many of them to leave some out", at_mm[0], at_mm[1], at_mm[2]
    )]
    NonManifold { edges: usize, at_mm: [f64; 3] },
    #[error("the surface is one-sided (like a Möbius strip) at ({:.3}, {:.3}, {:.3}) mm", at_mm[0], at_mm[1], at_mm[2])]
    OneSided { at_mm: [f64; 3] },
    #[error(
        "the mesh is cracked along {length_mm:.1} mm, at ({:.3}, {:.3}, {:.3}) mm: two sides that \
         should share their edges do not", at_mm[0], at_mm[1], at_mm[2]
    )]
    Cracked { at_mm: [f64; 3], length_mm: f64 },
    #[error(
        "a piece of the surface, at ({:.1}, {:.1}, {:.1}) mm, lies within another: which of them \
         is the lumen cannot be told", at_mm[0], at_mm[1], at_mm[2]
    )]
    Nested { at_mm: [f64; 3] },
}

impl MeshCause {
    /// What to do about it.
    pub fn fix(&self) -> String {
        match self {
            MeshCause::Degenerate => "export the surface again, in millimetres".into(),
            MeshCause::NonManifold { .. } | MeshCause::OneSided { .. } => {
                "repair the mesh (one closed sheet, no inner walls, no doubled facets) and export \
                 it again"
                    .into()
            }
            MeshCause::Cracked { .. } => {
                "merge close vertices (in MeshLab: Merge Close Vertices), close what stays open, and \
                 export it again"
                    .into()
            }
            MeshCause::Nested { .. } => {
                "export the lumen alone: of a phantom the inner surface only, without the outer \
                 one; of a scan without the pieces that float in it"
                    .into()
            }
        }
    }
}

/// A mesh of half-edges.
#[derive(Clone, Debug)]
pub struct Mesh {
    pub(crate) positions: Vec<Vector3<f64>>,
    /// How far past an opening each vertex lies \[m\]; 0 on the surface itself.
    pub(crate) beyond_m: Vec<f64>,
    /// Vertex where each half-edge begins.
    pub(crate) vertex: Vec<u32>,
    /// Opposite half-edge, or [`RIM`].
    pub(crate) twin: Vec<u32>,
    /// Normal at each corner, an index into `normals`; shared except across creases.
    pub(crate) corner_normal: Vec<u32>,
    pub(crate) normals: Vec<Vector3<f64>>,
}

pub(crate) fn next(half_edge: usize) -> usize {
    if half_edge % 3 == 2 { half_edge - 2 } else { half_edge + 1 }
}

impl Mesh {
    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.vertex.len() / 3
    }

    /// Whether the mesh has no triangles; never true of one that was read.
    pub fn is_empty(&self) -> bool {
        self.vertex.is_empty()
    }

    /// Corners of a triangle \[m\].
    pub fn triangle(&self, triangle: usize) -> Triangle {
        [0, 1, 2].map(|k| self.positions[self.vertex[3 * triangle + k] as usize])
    }

    /// Twice the area times the unit normal of a triangle \[m²\].
    pub(crate) fn area_normal(&self, triangle: usize) -> Vector3<f64> {
        let [a, b, c] = self.triangle(triangle);
        (b - a).cross(&(c - a))
    }

    /// Angle of the corner where a half-edge begins \[rad\].
    pub(crate) fn corner_angle(&self, half_edge: usize) -> f64 {
        let at = self.positions[self.vertex[half_edge] as usize];
        let after = self.positions[self.vertex[next(half_edge)] as usize] - at;
        let before = self.positions[self.vertex[next(next(half_edge))] as usize] - at;
        after.cross(&before).norm().atan2(after.dot(&before))
    }

    /// Weight of a facet in the normal of its corner, exact for vertices on a sphere: the sine
    /// of the angle over the lengths of its edges. Source: Max, Weights for computing vertex
    /// normals from facet normals (1999).
    fn corner_weight(&self, half_edge: usize) -> f64 {
        let at = self.positions[self.vertex[half_edge] as usize];
        let after = self.positions[self.vertex[next(half_edge)] as usize] - at;
        let before = self.positions[self.vertex[next(next(half_edge))] as usize] - at;
        let lengths = after.norm_squared() * before.norm_squared();
        if lengths > 0.0 { after.cross(&before).norm() / lengths } else { 0.0 }
    }

    /// Normals averaged by angle over the facets around a vertex, those beyond a crease apart.
    pub(crate) fn smooth_normals(&mut self) {
        let facets: Vec<_> = (0..self.len())
            .map(|t| self.area_normal(t).try_normalize(0.0).unwrap_or_default())
            .collect();
        let mut groups = Groups::new(self.vertex.len());
        for half_edge in 0..self.vertex.len() {
            let twin = self.twin[half_edge] as usize;
            if self.twin[half_edge] == RIM || twin < half_edge {
                continue;
            }
            let (a, b) = (facets[half_edge / 3], facets[twin / 3]);
            // A facet without area has no normal; it never parts its neighbours.
            let flat = a == Vector3::zeros() || b == Vector3::zeros();
            if flat || a.dot(&b) > CREASE_RAD.cos() {
                groups.join(half_edge, next(twin));
                groups.join(next(half_edge), twin);
            }
        }
        let mut sums = HashMap::new();
        let roots: Vec<_> = (0..self.vertex.len()).map(|corner| groups.root(corner)).collect();
        for (corner, &root) in roots.iter().enumerate() {
            *sums.entry(root).or_insert_with(Vector3::zeros) +=
                facets[corner / 3] * self.corner_weight(corner);
        }
        let mut index_of = HashMap::new();
        self.normals.clear();
        self.corner_normal = roots
            .iter()
            .map(|root| {
                *index_of.entry(*root).or_insert_with(|| {
                    self.normals.push(sums[root].try_normalize(0.0).unwrap_or_default());
                    self.normals.len() as u32 - 1
                })
            })
            .collect();
    }

    /// Every vertex: does it lie on the rim of an opening?
    pub(crate) fn rim_vertices(&self) -> Vec<bool> {
        let mut rim = vec![false; self.positions.len()];
        for half_edge in 0..self.vertex.len() {
            if self.twin[half_edge] == RIM {
                rim[self.vertex[half_edge] as usize] = true;
                rim[self.vertex[next(half_edge)] as usize] = true;
            }
        }
        rim
    }
}

/// Turns one triangle round: corners 1 and 2 change places, hence edges 0 and 2.
pub(super) fn turn(triangle: usize, vertex: &mut [u32], twin: &mut [u32]) {
    let (first, last) = (3 * triangle, 3 * triangle + 2);
    vertex.swap(first + 1, last);
    twin.swap(first, last);
    for at in [first, last] {
        if twin[at] != RIM {
            twin[twin[at] as usize] = at as u32;
        }
    }
}

/// Disjoint sets of corners.
struct Groups(Vec<u32>);

impl Groups {
    fn new(corners: usize) -> Self {
        Self((0..corners as u32).collect())
    }

    fn root(&mut self, corner: usize) -> u32 {
        let mut at = corner;
        while self.0[at] as usize != at {
            self.0[at] = self.0[self.0[at] as usize];
            at = self.0[at] as usize;
        }
        at as u32
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a as usize] = b;
    }
}
