//! Tetrahedra with ten nodes, and what of them is loaded and held.

use std::collections::HashMap;

use nalgebra::Vector3;
use thiserror::Error;

/// Corners of the six edges of a tetrahedron, in the order of its nodes 4 to 9.
pub(crate) const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];
/// Corners of the three edges of a triangle, in the order of its nodes 3 to 5.
pub(crate) const SIDES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// A mesh of a wall. The first [`Self::corners`] nodes are corners; the others lie on edges.
#[derive(Clone, Debug)]
pub struct WallMesh {
    /// \[mm\]
    pub nodes_mm: Vec<Vector3<f64>>,
    pub corners: usize,
    /// Corners, then the middles of [`EDGES`].
    pub tetrahedra: Vec<[u32; 10]>,
    /// Triangles of the loaded surface: corners, then the middles of [`SIDES`]. Their normal by the
    /// right hand points out of the material, into the lumen.
    pub inner: Vec<[u32; 6]>,
    /// Nodes that do not move.
    pub fixed: Vec<u32>,
}

/// Why a mesh is refused.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum MeshError {
    #[error("the mesh has no tetrahedron\n  fix: mesh the wall's volume, not its surface alone")]
    Empty,
    #[error(
        "tetrahedron {index} of {total} at ({:.2}, {:.2}, {:.2}) mm has no volume or is turned inside \
         out\n  fix: choose larger elements than the wall is thick, a thinner wall, or a smoother \
         surface", at_mm[0], at_mm[1], at_mm[2]
    )]
    Inverted { index: usize, total: usize, at_mm: [f64; 3] },
    #[error("no node of the wall is held, so that it would fly away\n  fix: {0}")]
    Loose(&'static str),
}

impl WallMesh {
    /// Adds the middles of edges to linear tetrahedra.
    ///
    /// `inner`: triangles of the loaded surface; `held`: corners that do not move. The middle of an
    /// edge whose two corners are held is held too. `middle` places the middle of an edge that does
    /// not lie between its corners, and turns tetrahedra that stand on their head.
    pub fn quadratic(
        corners_mm: Vec<Vector3<f64>>,
        mut tetrahedra: Vec<[u32; 4]>,
        inner: &[[u32; 3]],
        held: &[u32],
        middle: impl Fn(&Vector3<f64>, &Vector3<f64>) -> Vector3<f64>,
    ) -> Result<Self, MeshError> {
        if tetrahedra.is_empty() {
            return Err(MeshError::Empty);
        }
        for tetrahedron in &mut tetrahedra {
            if signed_volume(&corners_mm, tetrahedron) < 0.0 {
                tetrahedron.swap(0, 1);
            }
        }
        let corners = corners_mm.len();
        let mut nodes_mm = corners_mm;
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        let mut middle_of = |a: u32, b: u32| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                let at = middle(&nodes_mm[a as usize], &nodes_mm[b as usize]);
                nodes_mm.push(at);
                (nodes_mm.len() - 1) as u32
            })
        };
        let with_middles = |t: &[u32; 4]| {
            let mut nodes = [t[0], t[1], t[2], t[3], 0, 0, 0, 0, 0, 0];
            for (node, [a, b]) in nodes[4..].iter_mut().zip(EDGES) {
                *node = middle_of(t[a], t[b]);
            }
            nodes
        };
        let tetrahedra: Vec<[u32; 10]> = tetrahedra.iter().map(with_middles).collect();
        let inner = inner.iter().map(|t| {
            let side = |[a, b]: [usize; 2]| middles[&[t[a].min(t[b]), t[a].max(t[b])]];
            [t[0], t[1], t[2], side(SIDES[0]), side(SIDES[1]), side(SIDES[2])]
        });
        let inner = inner.collect();
        let mut is_held = vec![false; corners];
        for &corner in held {
            is_held[corner as usize] = true;
        }
        let mut fixed = held.to_vec();
        let both = |edge: &[u32; 2]| is_held[edge[0] as usize] && is_held[edge[1] as usize];
        fixed.extend(middles.iter().filter(|(edge, _)| both(edge)).map(|(_, middle)| *middle));
        fixed.sort_unstable();
        fixed.dedup();
        Ok(Self { nodes_mm, corners, tetrahedra, inner, fixed })
    }
}

/// Six times the volume of a tetrahedron \[mm³\].
pub(crate) fn signed_volume(corners_mm: &[Vector3<f64>], t: &[u32; 4]) -> f64 {
    let [a, b, c, d] = t.map(|corner| corners_mm[corner as usize]);
    (b - a).cross(&(c - a)).dot(&(d - a))
}
