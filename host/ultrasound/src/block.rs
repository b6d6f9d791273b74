//! A block of tissue with a hollow vessel, as a structured mesh.
//!
//! The frame: x along the vessel, y across it, z up; the origin is the middle of the unloaded top face.

use std::f64::consts::{PI, TAU};

use cathforce_wall::{MeshError, WallMesh};
use nalgebra::Vector3;
use serde::Deserialize;

/// Each layer of elements around the vessel is so many times as thick as the one inside it: the hole
/// disturbs the stress by (radius/distance)² (Kirsch 1898), so that thicker elements do farther out.
const GROWTH: f64 = 1.5;
/// Length of the elements along the vessel in the middle of the block, over that of equal ones: the
/// probe presses there, and the ends are at rest.
const MIDDLE: f64 = 0.6;

/// A block whose base is held and whose other faces are free.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Block {
    /// Along the vessel, across it and up \[mm\].
    pub size_mm: [f64; 3],
    pub vessel_diameter_mm: f64,
    /// Of the vessel's axis below the top face \[mm\].
    pub vessel_depth_mm: f64,
    /// Of the vessel's axis from the middle of the block, along y \[mm\].
    #[serde(default)]
    pub vessel_aside_mm: f64,
}

/// Numbers of elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Elements {
    /// From the vessel to the faces of the block.
    pub outwards: usize,
    /// Around the vessel, approximately.
    pub around: usize,
    pub along: usize,
}

impl Block {
    /// What is wrong with the block, and its fix.
    pub fn fault(&self) -> Option<(String, &'static str)> {
        let Self { size_mm, vessel_diameter_mm, vessel_depth_mm, vessel_aside_mm } = *self;
        let all = size_mm.into_iter().chain([vessel_diameter_mm, vessel_depth_mm]);
        if all.into_iter().any(|x| !(x > 0.0 && x.is_finite())) || !vessel_aside_mm.is_finite() {
            let cause = "sizes, diameter and depth of the block must be numbers above 0".to_owned();
            return Some((cause, "give them in millimetres"));
        }
        let radius = 0.5 * vessel_diameter_mm;
        let aside = 0.5 * size_mm[1] - vessel_aside_mm.abs();
        let least = vessel_depth_mm.min(size_mm[2] - vessel_depth_mm).min(aside);
        // A thinner cover than a quarter of the radius is a membrane, which no element here follows.
        (least < 1.25 * radius).then(|| {
            let cause = format!(
                "a vessel of {vessel_diameter_mm} mm at a depth of {vessel_depth_mm} mm has only {:.2} mm \
                 of tissue beside it",
                least - radius
            );
            (cause, "check `size_mm`, `vessel_diameter_mm`, `vessel_depth_mm` and `vessel_aside_mm`")
        })
    }

    /// The mesh: rays from the vessel's axis to the faces, layers between them, the same all along.
    /// `inner` of the mesh is the vessel's wall. No node of a face lies beside the face.
    pub fn mesh(&self, elements: Elements) -> Result<WallMesh, MeshError> {
        let radius = 0.5 * self.vessel_diameter_mm;
        let angles = self.angles(elements.around);
        let shares = shares(elements.outwards);
        let along = along(self.size_mm[0], elements.along);
        let (around, out) = (angles.len(), shares.len());
        let corner = |i: usize, j: usize, k: usize| (i + out * (j % around + around * k)) as u32;
        let mut corners_mm = Vec::with_capacity(out * around * along.len());
        for x in &along {
            for angle in &angles {
                let (sin, cos) = angle.sin_cos();
                let face = self.reach(*angle);
                corners_mm.extend(shares.iter().map(|share| {
                    let from = radius + share * (face - radius);
                    Vector3::new(
                        *x,
                        self.vessel_aside_mm + from * cos,
                        from * sin - self.vessel_depth_mm,
                    )
                }));
            }
        }
        let (mut tetrahedra, mut inner) = (Vec::new(), Vec::new());
        for k in 0..along.len() - 1 {
            for j in 0..around {
                for i in 0..out - 1 {
                    tetrahedra.extend(PATHS.map(|path| {
                        let mut at = [i, j, k];
                        let mut nodes = [corner(i, j, k); 4];
                        for (node, axis) in nodes[1..].iter_mut().zip(path) {
                            at[axis] += 1;
                            *node = corner(at[0], at[1], at[2]);
                        }
                        nodes
                    }));
                }
                let [a, b, c, d] =
                    [(j, k), (j, k + 1), (j + 1, k + 1), (j + 1, k)].map(|(j, k)| corner(0, j, k));
                inner.extend([[a, b, c], [a, c, d]]);
            }
        }
        let base = -self.size_mm[2] + 1e-9 * self.size_mm[2];
        let held = (0..corners_mm.len()).filter(|&k| corners_mm[k].z <= base);
        let held: Vec<u32> = held.map(|k| k as u32).collect();
        // The middle of an edge on the vessel lies on its circle.
        let axis = Vector3::new(0.0, self.vessel_aside_mm, -self.vessel_depth_mm);
        let from_axis = |p: &Vector3<f64>| (p - axis).yz();
        let middle = |a: &Vector3<f64>, b: &Vector3<f64>| {
            let straight = (a + b) * 0.5;
            let is_on = |p| (from_axis(p).norm() / radius - 1.0).abs() < 1e-9;
            if !(is_on(a) && is_on(b)) {
                return straight;
            }
            let out = from_axis(&straight).normalize() * radius;
            Vector3::new(straight.x, axis.y + out.x, axis.z + out.y)
        };
        WallMesh::quadratic(corners_mm, tetrahedra, &inner, &held, middle)
    }

    /// Angles of the rays from the y axis towards z, ascending; four of them lead to the edges of the
    /// block, and those between two edges are at equal distances.
    fn angles(&self, around: usize) -> Vec<f64> {
        let [_, width, height] = self.size_mm;
        let (right, left) =
            (0.5 * width - self.vessel_aside_mm, 0.5 * width + self.vessel_aside_mm);
        let (up, down) = (self.vessel_depth_mm, height - self.vessel_depth_mm);
        let edges = [
            (-down).atan2(right),
            up.atan2(right),
            up.atan2(-left),
            (-down).atan2(-left) + TAU,
            (-down).atan2(right) + TAU,
        ];
        let mut angles = Vec::new();
        for pair in edges.windows(2) {
            let span = pair[1] - pair[0];
            let count = ((around as f64 * span / TAU).round() as usize).max(2);
            angles.extend((0..count).map(|k| pair[0] + span * k as f64 / count as f64));
        }
        angles
    }

    /// Distance of the faces from the vessel's axis along a ray \[mm\].
    fn reach(&self, angle: f64) -> f64 {
        let [_, width, height] = self.size_mm;
        let (sin, cos) = angle.sin_cos();
        let aside = 0.5 * width - cos.signum() * self.vessel_aside_mm;
        let up = if sin > 0.0 { self.vessel_depth_mm } else { height - self.vessel_depth_mm };
        (aside / cos.abs()).min(up / sin.abs())
    }
}

/// The six tetrahedra of a box: paths from its lowest to its highest corner, one axis after the other.
/// They match those of the neighbouring boxes, round the vessel too (Kuhn 1960).
const PATHS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// Shares of the way from the vessel to a face.
fn shares(outwards: usize) -> Vec<f64> {
    let whole = GROWTH.powi(outwards as i32) - 1.0;
    (0..=outwards).map(|k| (GROWTH.powi(k as i32) - 1.0) / whole).collect()
}

/// Places along the vessel, denser in the middle \[mm\].
fn along(length_mm: f64, count: usize) -> Vec<f64> {
    let place = |k: usize| {
        let even = 2.0 * k as f64 / count as f64 - 1.0;
        0.5 * length_mm * (MIDDLE * even + (1.0 - MIDDLE) * even.powi(3))
    };
    (0..=count).map(place).collect()
}

impl Block {
    /// Volume without the vessel \[mm³\].
    pub fn volume_mm3(&self) -> f64 {
        let [length, width, height] = self.size_mm;
        length * (width * height - 0.25 * PI * self.vessel_diameter_mm.powi(2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mesh_fills_the_block_round_a_round_hole() {
        let block = Block {
            size_mm: [80.0, 50.0, 30.0],
            vessel_diameter_mm: 8.0,
            vessel_depth_mm: 11.0,
            vessel_aside_mm: -3.0,
        };
        let mesh = block.mesh(Elements { outwards: 3, around: 24, along: 4 }).unwrap();
        let volume = mesh.volume_mm3();
        assert!((volume / block.volume_mm3() - 1.0).abs() < 1e-4, "{volume}");
        assert!(mesh.fixed.iter().all(|node| mesh.nodes_mm[*node as usize].z < -29.999));
        let top = mesh.nodes_mm.iter().map(|p| p.z).fold(f64::MIN, f64::max);
        assert!(top.abs() < 1e-9);
        for node in mesh.inner.iter().flatten() {
            let p = mesh.nodes_mm[*node as usize];
            assert!(((p.y + 3.0).hypot(p.z + 11.0) - 4.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_vessel_that_breaks_the_surface_is_refused() {
        let block = Block {
            size_mm: [80.0, 50.0, 30.0],
            vessel_diameter_mm: 8.0,
            vessel_depth_mm: 4.5,
            vessel_aside_mm: 0.0,
        };
        assert!(block.fault().unwrap().0.contains("0.50 mm"));
        assert_eq!(Block { vessel_depth_mm: 11.0, ..block }.fault(), None);
        assert!(Block { vessel_diameter_mm: f64::NAN, ..block }.fault().is_some());
    }
}
