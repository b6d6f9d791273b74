//! A triangle mesh as half-edges, with normals that are smooth except across creases.
//!
//! Half-edge `3 t + k` runs from corner k to corner k + 1 of triangle t, and corner
//! `3 t + k` is where it begins.

use std::collections::HashMap;

use nalgebra::Vector3;
use thiserror::Error;

use super::pieces::PieceDoubts;
use super::rims::RimKind;
use super::stitch::stitch;
use super::stl::Triangle;
use super::weld::weld;

/// No half-edge on the other side: the rim of an opening.
pub(crate) const RIM: u32 = u32::MAX;
/// Facets that meet at a larger angle meet at a crease: their normals are not averaged.
const CREASE_RAD: f64 = 40.0 * std::f64::consts::PI / 180.0;

/// Why a surface is no lumen.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MeshCause {
    #[error("every triangle of the surface is degenerate")]
    Degenerate,
    #[error("more than two triangles share the edge at ({:.3}, {:.3}, {:.3}) mm", at_mm[0], at_mm[1], at_mm[2])]
    NonManifold { at_mm: [f64; 3] },
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
    pub(crate) fn fix(&self) -> String {
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

/// What was put right while reading.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeshRepairs {
    /// Triangles without area that were dropped.
    pub degenerate: usize,
    /// Triangles turned round to face the same way as their neighbours.
    pub flipped: usize,
    /// Facets split at a corner of another that lay on their edge.
    pub split: usize,
    /// Separate pieces of the surface.
    pub pieces: usize,
    /// What they look like.
    pub doubts: PieceDoubts,
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
    /// Joins triangles into a mesh whose facets all face the same way.
    pub fn from_triangles(triangles: &[Triangle]) -> Result<(Self, MeshRepairs), MeshCause> {
        let (positions, mut vertex) = weld(triangles);
        let degenerate = triangles.len() - vertex.len() / 3;
        if vertex.is_empty() {
            return Err(MeshCause::Degenerate);
        }
        let mut twin = twins(&positions, &vertex)?;
        let mut split = 0;
        loop {
            let more = stitch(&positions, &mut vertex, &twin);
            if more == 0 {
                break;
            }
            split += more;
            twin = twins(&positions, &vertex)?;
        }
        let (flipped, pieces) = face_one_way(&positions, &mut vertex, &mut twin)?;
        let mut mesh = Self {
            beyond_m: vec![0.0; positions.len()],
            positions,
            vertex,
            twin,
            corner_normal: Vec::new(),
            normals: Vec::new(),
        };
        mesh.smooth_normals();
        mesh.check_rims()?;
        let doubts = mesh.check_pieces()?;
        Ok((mesh, MeshRepairs { degenerate, flipped, split, pieces, doubts }))
    }

    fn check_rims(&self) -> Result<(), MeshCause> {
        for rim in self.rims() {
            if let RimKind::Crack { at, length_m } = self.rim_kind(&rim) {
                let at_mm = (at * 1e3).into();
                return Err(MeshCause::Cracked { at_mm, length_mm: 1e3 * length_m });
            }
        }
        Ok(())
    }

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

fn middle_mm(positions: &[Vector3<f64>], vertex: &[u32], half_edge: usize) -> [f64; 3] {
    let ends = [half_edge, next(half_edge)].map(|h| positions[vertex[h] as usize]);
    ((ends[0] + ends[1]) * 500.0).into()
}

/// The half-edge on the other side of each edge, whichever way its triangle faces.
fn twins(positions: &[Vector3<f64>], vertex: &[u32]) -> Result<Vec<u32>, MeshCause> {
    let mut open = HashMap::with_capacity(vertex.len());
    let mut twin = vec![RIM; vertex.len()];
    for half_edge in 0..vertex.len() {
        let (a, b) = (vertex[half_edge], vertex[next(half_edge)]);
        let Some(&other) = open.get(&(a.min(b), a.max(b))) else {
            open.insert((a.min(b), a.max(b)), half_edge as u32);
            continue;
        };
        if twin[other as usize] != RIM {
            return Err(MeshCause::NonManifold { at_mm: middle_mm(positions, vertex, half_edge) });
        }
        twin[half_edge] = other;
        twin[other as usize] = half_edge as u32;
    }
    Ok(twin)
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

/// Makes neighbours face the same way. Returns how many were turned and how many pieces
/// there are.
fn face_one_way(
    positions: &[Vector3<f64>],
    vertex: &mut [u32],
    twin: &mut [u32],
) -> Result<(usize, usize), MeshCause> {
    let (mut flipped, mut pieces) = (0, 0);
    let mut seen = vec![false; vertex.len() / 3];
    let mut queue = Vec::new();
    for start in 0..seen.len() {
        if seen[start] {
            continue;
        }
        pieces += 1;
        seen[start] = true;
        queue.push(start);
        while let Some(triangle) = queue.pop() {
            for half_edge in 3 * triangle..3 * triangle + 3 {
                let other = twin[half_edge];
                if other == RIM {
                    continue;
                }
                let neighbour = other as usize / 3;
                let same_way = vertex[half_edge] != vertex[other as usize];
                if seen[neighbour] {
                    if !same_way {
                        let at_mm = middle_mm(positions, vertex, half_edge);
                        return Err(MeshCause::OneSided { at_mm });
                    }
                    continue;
                }
                if !same_way {
                    turn(neighbour, vertex, twin);
                    flipped += 1;
                }
                seen[neighbour] = true;
                queue.push(neighbour);
            }
        }
    }
    Ok((flipped, pieces))
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
