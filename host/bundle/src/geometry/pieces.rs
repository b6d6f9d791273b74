//! The separate pieces of a surface: which way each faces the lumen, whether one lies in another,
//! and whether one is the wall of a phantom.

use std::collections::HashSet;

use nalgebra::Vector3;

use super::mesh::{Mesh, MeshCause, RIM, next, turn};
use super::wall::Triangle;

/// Number of facets of a piece that are tested for lying inside another piece.
const PROBES: usize = 9;
/// Number of largest pieces that are compared. Smaller ones are debris, and may be many.
const MOST_COMPARED: usize = 16;

/// The pieces of a mesh.
pub(super) struct Pieces {
    /// Piece of each triangle.
    piece: Vec<u32>,
    /// Triangles of each piece.
    triangles: Vec<Vec<usize>>,
    /// Triangles that close the rims of each piece.
    lids: Vec<Vec<Triangle>>,
}

impl Pieces {
    pub(super) fn of(mesh: &Mesh) -> Self {
        let mut piece = vec![u32::MAX; mesh.len()];
        let (mut triangles, mut queue) = (Vec::new(), Vec::new());
        for start in 0..piece.len() {
            if piece[start] != u32::MAX {
                continue;
            }
            let own = triangles.len() as u32;
            let mut of_piece = Vec::new();
            piece[start] = own;
            queue.push(start);
            while let Some(triangle) = queue.pop() {
                of_piece.push(triangle);
                for &other in &mesh.twin[3 * triangle..][..3] {
                    if other != RIM && piece[other as usize / 3] == u32::MAX {
                        piece[other as usize / 3] = own;
                        queue.push(other as usize / 3);
                    }
                }
            }
            triangles.push(of_piece);
        }
        let mut lids = vec![Vec::new(); triangles.len()];
        for rim in mesh.rims() {
            let corners = rim.iter().map(|&half_edge| mesh.start(half_edge));
            let middle = corners.sum::<Vector3<f64>>() / rim.len() as f64;
            let lid = |&h: &usize| [mesh.start(next(h)), mesh.start(h), middle];
            lids[piece[rim[0] / 3] as usize].extend(rim.iter().map(lid));
        }
        Self { piece, triangles, lids }
    }

    /// Signed volume of each piece with its lids; negative if the facets face the lumen \[m³\].
    fn volumes_m3(&self, mesh: &Mesh) -> Vec<f64> {
        let cone = |[a, b, c]: &Triangle| a.dot(&b.cross(c)) / 6.0;
        let lids = self.lids.iter().map(|lids| lids.iter().map(cone).sum());
        let mut volumes: Vec<f64> = lids.collect();
        for (triangle, &piece) in self.piece.iter().enumerate() {
            volumes[piece as usize] += cone(&mesh.triangle(triangle));
        }
        volumes
    }

    /// A place on a piece that lies inside another, and one on a piece that lies partly inside another
    /// \[m\].
    fn within(&self, mesh: &Mesh) -> [Option<Vector3<f64>>; 2] {
        let mut by_size: Vec<(f64, usize)> =
            self.volumes_m3(mesh).into_iter().map(f64::abs).zip(0..).collect();
        by_size.sort_by(|a, b| b.0.total_cmp(&a.0));
        by_size.truncate(MOST_COMPARED);
        let mut partly = None;
        for (larger, &(_, outer)) in by_size.iter().enumerate() {
            let shell: Vec<Triangle> =
                self.triangles[outer].iter().map(|&t| mesh.triangle(t)).collect();
            let shell = || shell.iter().chain(&self.lids[outer]);
            let (low, high) = shell().flatten().fold(
                (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)),
                |(low, high), p| (low.inf(p), high.sup(p)),
            );
            for &(_, inner) in &by_size[larger + 1..] {
                let own = &self.triangles[inner];
                let probe = |k: usize| {
                    let [a, b, c] = mesh.triangle(own[(2 * k + 1) * own.len() / (2 * PROBES)]);
                    (a + b + c) / 3.0
                };
                let is_in = |p: &Vector3<f64>| {
                    (0..3).all(|k| p[k] > low[k] && p[k] < high[k]) && is_around(shell(), p)
                };
                let inside: Vec<_> = (0..PROBES).map(probe).filter(is_in).collect();
                match inside.len() {
                    0 => {}
                    PROBES => return [Some(inside[0]), None],
                    _ => partly = partly.or(Some(inside[0])),
                }
            }
        }
        [None, partly]
    }

    /// Number of handles (topological genus) of the closed pieces: none for a vessel that is closed
    /// at its ends, one for every channel through the wall of a phantom.
    fn handles(&self, mesh: &Mesh) -> usize {
        let has_rim: HashSet<u32> = (0..mesh.twin.len())
            .filter(|&half_edge| mesh.twin[half_edge] == RIM)
            .map(|half_edge| self.piece[half_edge / 3])
            .collect();
        let closed = self.triangles.iter().zip(0..).filter(|(_, own)| !has_rim.contains(own));
        let handles = closed.map(|(triangles, _)| {
            let corners = triangles.iter().flat_map(|t| &mesh.vertex[3 * t..][..3]);
            let vertices = corners.collect::<HashSet<_>>().len();
            // Euler: vertices - edges + facets = 2 - 2 handles, with three edges to two facets.
            (triangles.len() / 2 + 2).saturating_sub(vertices) / 2
        });
        handles.sum()
    }
}

/// Whether a closed shell encloses a point, by the solid angle that it subtends.
/// Source: van Oosterom and Strackee, The solid angle of a plane triangle (1983).
fn is_around<'a>(shell: impl Iterator<Item = &'a Triangle>, p: &Vector3<f64>) -> bool {
    let half_angle = |corners: &Triangle| {
        let [a, b, c] = corners.map(|corner| corner - p);
        let [la, lb, lc] = [a.norm(), b.norm(), c.norm()];
        let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
        a.dot(&b.cross(&c)).atan2(below)
    };
    shell.map(half_angle).sum::<f64>().abs() > std::f64::consts::PI
}

/// What looks wrong with the pieces of a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PieceDoubts {
    /// Where a piece reaches into another \[mm\].
    pub overlap_mm: Option<[f64; 3]>,
    /// Channels through closed pieces.
    pub channels: usize,
}

impl Mesh {
    /// Refuses pieces within others. Returns what else looks wrong, and the volume of each piece with its
    /// lids, negative if its facets face the lumen \[m³\].
    pub(super) fn check_pieces(&self) -> Result<(PieceDoubts, Vec<f64>), MeshCause> {
        let pieces = Pieces::of(self);
        let mut doubts = PieceDoubts::default();
        if pieces.triangles.len() > 1 {
            let [within, partly] =
                pieces.within(self).map(|place| place.map(|at| (1e3 * at).into()));
            if let Some(at_mm) = within {
                return Err(MeshCause::Nested { at_mm });
            }
            doubts.overlap_mm = partly;
        }
        doubts.channels = pieces.handles(self);
        Ok((doubts, pieces.volumes_m3(self)))
    }

    /// The triangles, facing away from the lumen as a surface's do \[m\].
    pub fn facing_outwards(&self) -> Vec<Triangle> {
        let pieces = Pieces::of(self);
        let volumes_m3 = pieces.volumes_m3(self);
        let outwards = |(triangle, &piece): (usize, &u32)| {
            let [a, b, c] = self.triangle(triangle);
            if volumes_m3[piece as usize] < 0.0 { [a, c, b] } else { [a, b, c] }
        };
        pieces.piece.iter().enumerate().map(outwards).collect()
    }

    /// Turns every piece so that its facets face the lumen, by the volume that they and lids over
    /// its rims enclose.
    pub(super) fn face_lumen(&mut self) {
        let pieces = Pieces::of(self);
        let faces_lumen: Vec<bool> =
            pieces.volumes_m3(self).into_iter().map(|volume_m3| volume_m3 < 0.0).collect();
        let mut turned = vec![false; self.normals.len()];
        for triangle in 0..self.len() {
            if faces_lumen[pieces.piece[triangle] as usize] {
                continue;
            }
            turn(triangle, &mut self.vertex, &mut self.twin);
            // Corner 0 stays, corners 1 and 2 change places.
            self.corner_normal.swap(3 * triangle + 1, 3 * triangle + 2);
            for corner in 3 * triangle..3 * triangle + 3 {
                turned[self.corner_normal[corner] as usize] = true;
            }
        }
        for (normal, turned) in self.normals.iter_mut().zip(turned) {
            if turned {
                *normal = -*normal;
            }
        }
    }
}
