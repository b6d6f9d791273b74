//! A linear-array probe on the top face: where it stands, and the forces of its pressure.
//!
//! The probe's face is a rectangle. Its force is spread evenly over it and points along −z, whatever
//! the tissue does below: a robot holds the probe upright and controls its force.

use std::collections::HashMap;

use cathforce_wall::WallMesh;
use nalgebra::{Vector2, Vector3};
use serde::Deserialize;
use thiserror::Error;

/// Where a probe stands.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pose {
    /// Middle of the probe's face in x and y \[mm\].
    pub at_mm: [f64; 2],
    /// Turn of the image plane about z. At 0 the plane is across the vessel: its lateral axis is y.
    #[serde(default)]
    pub turn_deg: f64,
}

impl Pose {
    /// Lateral axis of the image, along the long side of the probe's face: a unit vector.
    pub fn lateral(&self) -> Vector3<f64> {
        let turn = self.turn_deg.to_radians();
        Vector3::new(-turn.sin(), turn.cos(), 0.0)
    }

    /// Normal of the image plane: a unit vector.
    pub fn normal(&self) -> Vector3<f64> {
        let turn = self.turn_deg.to_radians();
        Vector3::new(turn.cos(), turn.sin(), 0.0)
    }

    /// Origin of the image plane: the middle of the probe's face, on the unloaded top face \[mm\].
    pub fn origin_mm(&self) -> Vector3<f64> {
        Vector3::new(self.at_mm[0], self.at_mm[1], 0.0)
    }
}

/// Why a probe cannot press.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error(
    "only {:.0} % of the probe's face at ({:.1}, {:.1}) mm lies on the top face of the block\n  fix: \
     move the pose, or check the sizes of the probe and of the block", 100.0 * share, at_mm[0], at_mm[1]
)]
pub struct OffTheBlock {
    pub at_mm: [f64; 2],
    pub share: f64,
}

/// Forces on all nodes of a probe that presses with 1 N \[N\].
///
/// f_a = −ê_z (1 N/A) ∫ N_a dA over the part of the top face below the probe, with the quadratic shape
/// functions N_a. Each triangle of the face is clipped to the rectangle, and the rule of the middles of
/// the sides is exact on what is left, so that the sum is 1 N on every mesh.
///
/// `face_mm`: along the lateral axis and across it.
pub fn unit_forces_n(
    mesh: &WallMesh,
    pose: &Pose,
    face_mm: [f64; 2],
) -> Result<Vec<Vector3<f64>>, OffTheBlock> {
    let whole = face_mm[0] * face_mm[1];
    let (lateral, normal) = (pose.lateral().xy(), pose.normal().xy());
    let middle = Vector2::from(pose.at_mm);
    let mut areas = vec![0.0; mesh.nodes_mm.len()];
    for triangle in top_face(mesh) {
        // In the frame of the probe's face.
        let [a, b, c] = [0, 1, 2].map(|k| {
            let from = mesh.nodes_mm[triangle[k] as usize].xy() - middle;
            Vector2::new(from.dot(&lateral), from.dot(&normal))
        });
        let below = clipped(vec![a, b, c], face_mm);
        for k in 2..below.len() {
            let part = [below[0], below[k - 1], below[k]];
            let area = 0.5 * cross(part[1] - part[0], part[2] - part[0]).abs();
            for [i, j] in SIDES {
                let l = barycentric([a, b, c], 0.5 * (part[i] + part[j]));
                for (node, value) in triangle.iter().zip(shape(l)) {
                    areas[*node as usize] += value * area / 3.0;
                }
            }
        }
    }
    let share = areas.iter().sum::<f64>() / whole;
    // Rounding of the clipping.
    if (share - 1.0).abs() > 1e-6 {
        return Err(OffTheBlock { at_mm: pose.at_mm, share });
    }
    Ok(areas.iter().map(|area| Vector3::z() * (-area / whole)).collect())
}

/// Corners of the sides of a triangle.
const SIDES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// Triangles of the highest face of a mesh: corners, then the middles of [`SIDES`].
fn top_face(mesh: &WallMesh) -> Vec<[u32; 6]> {
    /// Corners of the faces of a tetrahedron, and its nodes in the middles of their sides.
    const FACES: [([usize; 3], [usize; 3]); 4] = [
        ([0, 1, 2], [4, 5, 6]),
        ([0, 1, 3], [4, 8, 7]),
        ([1, 2, 3], [5, 9, 8]),
        ([0, 2, 3], [6, 9, 7]),
    ];
    let corners = &mesh.nodes_mm[..mesh.corners];
    let (low, high) =
        corners.iter().fold((f64::MAX, f64::MIN), |(low, high), p| (low.min(p.z), high.max(p.z)));
    let is_high = |node: u32| mesh.nodes_mm[node as usize].z >= high - 1e-6 * (high - low);
    let mut faces: HashMap<[u32; 3], Option<[u32; 6]>> = HashMap::new();
    for nodes in &mesh.tetrahedra {
        for (corners, middles) in FACES {
            let corners = corners.map(|k| nodes[k]);
            if corners.into_iter().all(is_high) {
                let middles = middles.map(|k| nodes[k]);
                let mut key = corners;
                key.sort_unstable();
                let all = [corners[0], corners[1], corners[2], middles[0], middles[1], middles[2]];
                faces.entry(key).and_modify(|face| *face = None).or_insert(Some(all));
            }
        }
    }
    let mut faces: Vec<[u32; 6]> = faces.into_values().flatten().collect();
    // Sums do not depend on the order of a hash.
    faces.sort_unstable();
    faces
}

fn cross(a: Vector2<f64>, b: Vector2<f64>) -> f64 {
    a.x * b.y - a.y * b.x
}

/// The part of a convex polygon within a rectangle around the origin (Sutherland and Hodgman 1974).
fn clipped(mut polygon: Vec<Vector2<f64>>, sides: [f64; 2]) -> Vec<Vector2<f64>> {
    for (axis, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)] {
        let inside = |p: &Vector2<f64>| 0.5 * sides[axis] - sign * p[axis];
        let mut left = Vec::with_capacity(polygon.len() + 1);
        for k in 0..polygon.len() {
            let (p, q) = (polygon[k], polygon[(k + 1) % polygon.len()]);
            let (a, b) = (inside(&p), inside(&q));
            if a >= 0.0 {
                left.push(p);
            }
            if (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0) {
                left.push(p + (q - p) * (a / (a - b)));
            }
        }
        polygon = left;
    }
    polygon
}

fn barycentric([a, b, c]: [Vector2<f64>; 3], p: Vector2<f64>) -> [f64; 3] {
    let whole = cross(b - a, c - a);
    let (second, third) = (cross(p - a, c - a) / whole, cross(b - a, p - a) / whole);
    [1.0 - second - third, second, third]
}

/// Quadratic shape functions of a triangle.
fn shape(l: [f64; 3]) -> [f64; 6] {
    let corner = |k: usize| l[k] * (2.0 * l[k] - 1.0);
    let side = |k: usize| 4.0 * l[SIDES[k][0]] * l[SIDES[k][1]];
    [corner(0), corner(1), corner(2), side(0), side(1), side(2)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::{Block, Elements};

    fn mesh() -> WallMesh {
        let block = Block {
            size_mm: [80.0, 50.0, 30.0],
            vessel_diameter_mm: 8.0,
            vessel_depth_mm: 11.0,
            vessel_aside_mm: 0.0,
        };
        block.mesh(Elements { outwards: 2, around: 12, along: 5 }).unwrap()
    }

    #[test]
    fn the_forces_have_the_sum_and_the_moments_of_the_pressure() {
        let (mesh, pose) = (mesh(), Pose { at_mm: [3.3, -1.2], turn_deg: 25.0 });
        let forces = unit_forces_n(&mesh, &pose, [38.0, 9.0]).unwrap();
        let sum: Vector3<f64> = forces.iter().sum();
        assert!((sum + Vector3::z()).norm() < 1e-9, "{sum}");
        let moment = |axis: usize| -> f64 {
            forces.iter().zip(&mesh.nodes_mm).map(|(f, p)| -f.z * p[axis]).sum()
        };
        assert!((moment(0) - 3.3).abs() < 1e-9 && (moment(1) + 1.2).abs() < 1e-9);
    }

    #[test]
    fn a_probe_beside_the_block_is_refused() {
        let pose = Pose { at_mm: [0.0, 20.0], turn_deg: 0.0 };
        let error = unit_forces_n(&mesh(), &pose, [38.0, 9.0]).unwrap_err();
        assert!((error.share - 24.0 / 38.0).abs() < 1e-9, "{error}");
    }
}
