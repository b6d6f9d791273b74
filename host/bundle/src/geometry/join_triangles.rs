//! From loose triangles to a [`Mesh`]: welded, stitched, facing one way, and checked.

use std::collections::HashMap;

use nalgebra::Vector3;

use super::crossing::Crossing;
use super::figure::Figure;
use super::mesh::{Mesh, MeshCause, RIM, next, turn};
use super::non_manifold::{NonManifold, leave_out};
use super::pieces::PieceDoubts;
use super::rims::RimKind;
use super::stitch::stitch;
use super::wall::Triangle;
use super::weld::weld;

/// Repairs made while reading.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeshRepairs {
    /// Triangles without area that were dropped.
    pub degenerate: usize,
    /// Triangles turned round to face the same way as most of their piece.
    pub flipped: usize,
    /// Triangles that face the lumen in the file, as most of their piece do, and not away from it.
    pub inside_out: usize,
    /// Facets split at a corner of another that lay on their edge.
    pub split: usize,
    /// Separate pieces of the surface.
    pub pieces: usize,
    /// What looks wrong with them.
    pub doubts: PieceDoubts,
    /// Facets that were left out along edges of more than two.
    pub left_out: Option<NonManifold>,
    /// Facets that run through each other.
    pub crossing: Option<Crossing>,
    /// What the surface is by its shape.
    pub figure: Figure,
}

impl Mesh {
    /// Joins triangles into a mesh whose facets all face the same way.
    pub fn from_triangles(triangles: &[Triangle]) -> Result<(Self, MeshRepairs), MeshCause> {
        let (positions, mut vertex) = weld(triangles);
        let degenerate = triangles.len() - vertex.len() / 3;
        if vertex.is_empty() {
            return Err(MeshCause::Degenerate);
        }
        let left_out = leave_out(&positions, &mut vertex)
            .map_err(|(edges, at_mm)| MeshCause::NonManifold { edges, at_mm })?;
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
        let faced = face_one_way(&positions, &mut vertex, &mut twin)?;
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
        let (doubts, volumes_m3) = mesh.check_pieces()?;
        let (crossing, figure) = (mesh.crossing(), mesh.figure(volumes_m3.iter().sum()));
        let repairs = MeshRepairs {
            degenerate,
            flipped: faced.iter().map(|piece| piece.turned).sum(),
            inside_out: inside_out(&faced, &volumes_m3),
            split,
            pieces: faced.len(),
            doubts,
            left_out,
            crossing,
            figure,
        };
        Ok((mesh, repairs))
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
            let at_mm = middle_mm(positions, vertex, half_edge);
            return Err(MeshCause::NonManifold { edges: 1, at_mm });
        }
        twin[half_edge] = other;
        twin[other as usize] = half_edge as u32;
    }
    Ok(twin)
}

/// How the facets of a piece face in the file.
struct Faced {
    triangles: usize,
    /// Those that face the other way than most of the piece.
    turned: usize,
    /// Whether most of them face the other way now.
    is_reversed: bool,
}

/// Triangles of pieces that face the lumen in the file. `volumes_m3`: of each piece as it faces now,
/// negative if its facets face the lumen.
fn inside_out(faced: &[Faced], volumes_m3: &[f64]) -> usize {
    let pieces = faced.iter().zip(volumes_m3);
    let pieces = pieces.filter(|(piece, volume_m3)| (**volume_m3 < 0.0) != piece.is_reversed);
    pieces.map(|(piece, _)| piece.triangles - piece.turned).sum()
}

/// Makes neighbours face the same way. Returns how the facets of each piece faced; the pieces are in the
/// order of their first triangles.
fn face_one_way(
    positions: &[Vector3<f64>],
    vertex: &mut [u32],
    twin: &mut [u32],
) -> Result<Vec<Faced>, MeshCause> {
    let mut faced = Vec::new();
    let mut seen = vec![false; vertex.len() / 3];
    let mut queue = Vec::new();
    for start in 0..seen.len() {
        if seen[start] {
            continue;
        }
        let (mut triangles, mut flipped) = (0, 0);
        seen[start] = true;
        queue.push(start);
        while let Some(triangle) = queue.pop() {
            triangles += 1;
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
        // The piece faces as its first triangle does, which may be the one that is wrong.
        let is_reversed = 2 * flipped > triangles;
        let turned = if is_reversed { triangles - flipped } else { flipped };
        faced.push(Faced { triangles, turned, is_reversed });
    }
    Ok(faced)
}
