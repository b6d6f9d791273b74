//! From the surface of a lumen to the wall around it: layers of prisms, cut into tetrahedra.

use std::collections::HashMap;

use nalgebra::Vector3;
use thiserror::Error;

use crate::mesh::{MeshError, WallMesh, signed_volume};

/// Each round makes the wall this much thinner where it is turned inside out.
const THINNER: f64 = 0.8;
/// Rounds until a wall is given up: it would have a tenth of its thickness.
const ROUNDS: usize = 10;
/// A tetrahedron whose volume is below this share of that of an even one is turned inside out.
const LEAST_VOLUME: f64 = 0.02;

/// Triangles of a lumen's surface; their normal by the right hand points into the lumen.
#[derive(Clone, Debug, Default)]
pub struct Surface {
    /// \[mm\]
    pub vertices_mm: Vec<Vector3<f64>>,
    pub triangles: Vec<[u32; 3]>,
}

/// Why a surface has no wall.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ExtrudeError {
    #[error("the surface has no triangle\n  fix: give the surface of the lumen")]
    Empty,
    #[error(
        "a thickness of {0} mm is no wall\n  fix: give the thickness of the wall in millimetres, above 0"
    )]
    Thickness(f64),
    #[error("the surface has no rim, so that nothing holds the wall\n  fix: cut its ends open")]
    NoRim,
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// A wall, and where it had to be made thinner.
#[derive(Clone, Debug)]
pub struct Extruded {
    pub mesh: WallMesh,
    /// Vertices at which the wall is thinner than asked for: at the crotch of a branching, where
    /// two walls would go through each other.
    pub thinner: usize,
    /// Of the thinnest place over the thickness asked for.
    pub least: f64,
}

/// Puts a wall around a lumen, held at the rims of the surface.
pub fn extrude(
    surface: &Surface,
    thickness_mm: f64,
    layers: usize,
) -> Result<Extruded, ExtrudeError> {
    if surface.triangles.is_empty() {
        return Err(ExtrudeError::Empty);
    }
    if !(thickness_mm.is_finite() && thickness_mm > 0.0) {
        return Err(ExtrudeError::Thickness(thickness_mm));
    }
    let rim = rim(surface);
    if rim.is_empty() {
        return Err(ExtrudeError::NoRim);
    }
    let outwards = outwards(surface);
    let mut shares = vec![1.0; surface.vertices_mm.len()];
    let tetrahedra = prisms(surface, layers);
    let mut corners = corners(surface, &outwards, &shares, thickness_mm, layers);
    for _ in 0..ROUNDS {
        let crushed = crushed(surface, &tetrahedra, &corners);
        if crushed.is_empty() {
            break;
        }
        for vertex in crushed {
            shares[vertex as usize] *= THINNER;
        }
        corners = self::corners(surface, &outwards, &shares, thickness_mm, layers);
    }
    let count = surface.vertices_mm.len() as u32;
    let held: Vec<u32> = rim
        .iter()
        .flat_map(|vertex| (0..=layers as u32).map(move |layer| vertex + layer * count))
        .collect();
    let middle = |a: &Vector3<f64>, b: &Vector3<f64>| (a + b) * 0.5;
    let mesh = WallMesh::quadratic(corners, tetrahedra, &surface.triangles, &held, middle)?;
    Ok(Extruded {
        mesh,
        thinner: shares.iter().filter(|share| **share < 1.0).count(),
        least: shares.iter().copied().fold(1.0, f64::min),
    })
}

/// Vertices at the ends of edges that belong to one triangle only, ascending.
fn rim(surface: &Surface) -> Vec<u32> {
    let mut uses: HashMap<[u32; 2], usize> = HashMap::new();
    for t in &surface.triangles {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            *uses.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    let mut rim: Vec<u32> =
        uses.iter().filter(|(_, uses)| **uses == 1).flat_map(|(edge, _)| *edge).collect();
    rim.sort_unstable();
    rim.dedup();
    rim
}

/// Unit vectors out of the lumen, one a vertex, scaled so that the walls on the triangles around it
/// are as thick as asked for.
fn outwards(surface: &Surface) -> Vec<Vector3<f64>> {
    /// A sharper edge would throw its vertex too far.
    const LARGEST_SCALE: f64 = 1.5;
    let mut sums = vec![Vector3::zeros(); surface.vertices_mm.len()];
    let normal = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|vertex| surface.vertices_mm[vertex as usize]);
        (c - a).cross(&(b - a))
    };
    for t in &surface.triangles {
        for vertex in t {
            sums[*vertex as usize] += normal(t);
        }
    }
    for sum in &mut sums {
        *sum = sum.try_normalize(0.0).unwrap_or_default();
    }
    let mut leans = vec![(0.0, 0.0); sums.len()];
    for t in &surface.triangles {
        let area = normal(t);
        for vertex in t {
            let lean = &mut leans[*vertex as usize];
            lean.0 += area.dot(&sums[*vertex as usize]);
            lean.1 += area.norm();
        }
    }
    let scaled = sums.iter().zip(leans).map(|(sum, (along, all))| {
        sum * f64::min(if along > 0.0 { all / along } else { 1.0 }, LARGEST_SCALE)
    });
    scaled.collect()
}

fn corners(
    surface: &Surface,
    outwards: &[Vector3<f64>],
    shares: &[f64],
    thickness_mm: f64,
    layers: usize,
) -> Vec<Vector3<f64>> {
    let layer = |layer: usize| {
        let depth = thickness_mm * layer as f64 / layers as f64;
        let vertices = surface.vertices_mm.iter().zip(outwards).zip(shares);
        vertices.map(move |((vertex, outwards), share)| vertex + outwards * (depth * share))
    };
    (0..=layers).flat_map(layer).collect()
}

/// Every prism as three tetrahedra. The diagonal of a side starts at its vertex of the lower number,
/// so that neighbours agree.
fn prisms(surface: &Surface, layers: usize) -> Vec<[u32; 4]> {
    let count = surface.vertices_mm.len() as u32;
    let mut tetrahedra = Vec::with_capacity(3 * layers * surface.triangles.len());
    for layer in 0..layers as u32 {
        for triangle in &surface.triangles {
            let mut sorted = *triangle;
            sorted.sort_unstable();
            let [a, b, c] = sorted.map(|vertex| vertex + layer * count);
            let [d, e, f] = sorted.map(|vertex| vertex + (layer + 1) * count);
            tetrahedra.extend([[a, b, c, f], [a, b, e, f], [a, d, e, f]]);
        }
    }
    tetrahedra
}

/// Vertices of triangles on which a tetrahedron is turned against the others of its prism.
fn crushed(surface: &Surface, tetrahedra: &[[u32; 4]], corners: &[Vector3<f64>]) -> Vec<u32> {
    let mut crushed = Vec::new();
    for (index, three) in tetrahedra.chunks_exact(3).enumerate() {
        let triangle = &surface.triangles[index % surface.triangles.len()];
        // Sorting the vertices of a triangle may have mirrored it.
        let is_even = (0..3).any(|k| {
            triangle[k] < triangle[(k + 1) % 3] && triangle[(k + 1) % 3] < triangle[(k + 2) % 3]
        });
        let sign = if is_even { -1.0 } else { 1.0 };
        // By construction the second of the three is mirrored against the others.
        let volumes = [0, 1, 2].map(|k| {
            let mirrored = if k == 1 { -1.0 } else { 1.0 };
            sign * mirrored * signed_volume(corners, &three[k])
        });
        let even = volumes.iter().map(|volume| volume.abs()).sum::<f64>() / 3.0;
        if volumes.iter().any(|volume| *volume < LEAST_VOLUME * even) {
            crushed.extend(triangle);
        }
    }
    crushed.sort_unstable();
    crushed.dedup();
    crushed
}
