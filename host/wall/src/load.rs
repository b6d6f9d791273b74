//! Forces on the inner surface: a patch that an instrument presses on, and a pressure.

use nalgebra::Vector3;
use thiserror::Error;

use crate::mesh::{SIDES, WallMesh};
use crate::solve::Solution;

/// Points of integration of a triangle, exact to degree 5 (Dunavant 1985): barycentric coordinates
/// and shares of the area.
const POINTS: [([f64; 3], f64); 7] = {
    const A: f64 = 0.470_142_064_105_115;
    const B: f64 = 0.101_286_507_323_456;
    const U: f64 = 0.132_394_152_788_506;
    const V: f64 = 0.125_939_180_544_827;
    [
        ([1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0], 0.225),
        ([1.0 - 2.0 * A, A, A], U),
        ([A, 1.0 - 2.0 * A, A], U),
        ([A, A, 1.0 - 2.0 * A], U),
        ([1.0 - 2.0 * B, B, B], V),
        ([B, 1.0 - 2.0 * B, B], V),
        ([B, B, 1.0 - 2.0 * B], V),
    ]
};
/// Each triangle is cut into this many parts a side for the patch, whose edge may lie inside one.
const PARTS: usize = 4;

/// Where an instrument presses, with the pressure of a parabola: 1 − (s/a)² − (t/b)² with s along
/// `along` and t across it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// \[mm\], on the inner surface or near it.
    pub centre_mm: Vector3<f64>,
    /// Unit vector, out of the lumen.
    pub direction: Vector3<f64>,
    /// Unit vector, across `direction`.
    pub along: Vector3<f64>,
    /// Half axes along `along` and across it \[mm\].
    pub half_axes_mm: [f64; 2],
}

/// Why a patch cannot be loaded.
#[derive(Clone, Debug, Error, PartialEq)]
#[error(
    "the inner surface has nothing within {:.2} × {:.2} mm around ({:.2}, {:.2}, {:.2}) mm\n  fix: move \
     the patch onto the wall, or widen it", half_axes_mm[0], half_axes_mm[1], at_mm[0], at_mm[1], at_mm[2]
)]
pub struct PatchError {
    pub at_mm: [f64; 3],
    pub half_axes_mm: [f64; 2],
}

impl Patch {
    /// Share of the force that every node takes; the shares add up to 1.
    pub fn shares(&self, mesh: &WallMesh) -> Result<Vec<f64>, PatchError> {
        let mut shares = vec![0.0; mesh.nodes_mm.len()];
        for triangle in &mesh.inner {
            self.add_triangle(mesh, triangle, &mut shares);
        }
        let total: f64 = shares.iter().sum();
        if total.is_nan() || total <= 0.0 {
            let (at_mm, half_axes_mm) = (self.centre_mm.into(), self.half_axes_mm);
            return Err(PatchError { at_mm, half_axes_mm });
        }
        shares.iter_mut().for_each(|share| *share /= total);
        Ok(shares)
    }

    fn add_triangle(&self, mesh: &WallMesh, triangle: &[u32; 6], shares: &mut [f64]) {
        let reach = self.half_axes_mm[0].max(self.half_axes_mm[1]);
        let at = |node: u32| mesh.nodes_mm[node as usize];
        let side = (at(triangle[1]) - at(triangle[0])).norm();
        if (at(triangle[0]) - self.centre_mm).norm() > reach + 2.0 * side {
            return;
        }
        for part in parts() {
            for (point, share) in POINTS {
                let l: [f64; 3] = std::array::from_fn(|k| {
                    (0..3).map(|corner| point[corner] * part[corner][k]).sum()
                });
                let (place, area) = surface(mesh, triangle, &l);
                let pressure = self.pressure(&place, &area);
                if pressure > 0.0 {
                    let weight = pressure * share * area.norm() / (PARTS * PARTS) as f64;
                    for (node, value) in triangle.iter().zip(shape(&l)) {
                        shares[*node as usize] += weight * value;
                    }
                }
            }
        }
    }

    /// At a place of the surface whose normal is that of `area`; not above 0 outside the patch.
    fn pressure(&self, place: &Vector3<f64>, area: &Vector3<f64>) -> f64 {
        // The far side of a narrow vessel is not touched.
        if area.dot(&self.direction) > 0.0 {
            return 0.0;
        }
        let from = place - self.centre_mm;
        let s = from.dot(&self.along) / self.half_axes_mm[0];
        let t = from.dot(&self.direction.cross(&self.along)) / self.half_axes_mm[1];
        let depth = from.dot(&self.direction) / self.half_axes_mm[0].max(self.half_axes_mm[1]);
        if depth.abs() > 2.0 { 0.0 } else { 1.0 - s * s - t * t }
    }

    /// Forces on all nodes that add up to `force_n` along the direction.
    pub fn forces_n(&self, shares: &[f64], force_n: f64) -> Vec<Vector3<f64>> {
        shares.iter().map(|share| self.direction * (share * force_n)).collect()
    }

    /// Displacement along the direction, weighted as the force is: the work over the force \[mm\].
    pub fn displacement_mm(&self, shares: &[f64], solution: &Solution) -> f64 {
        let displacements = solution.displacements_mm();
        shares.iter().zip(displacements).map(|(share, u)| share * u.dot(&self.direction)).sum()
    }
}

/// Forces of a pressure on the unloaded inner surface \[N\], on all nodes.
pub fn pressure_forces(mesh: &WallMesh, pressure_mpa: f64) -> Vec<Vector3<f64>> {
    let mut forces = vec![Vector3::zeros(); mesh.nodes_mm.len()];
    for triangle in &mesh.inner {
        for (l, share) in POINTS {
            let (_, area) = surface(mesh, triangle, &l);
            for (node, value) in triangle.iter().zip(shape(&l)) {
                forces[*node as usize] -= area * (pressure_mpa * share * value);
            }
        }
    }
    forces
}

/// Place and area vector (of the whole triangle, if it were like this everywhere) at barycentric
/// coordinates.
fn surface(mesh: &WallMesh, triangle: &[u32; 6], l: &[f64; 3]) -> (Vector3<f64>, Vector3<f64>) {
    let (mut place, mut s, mut t) = (Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
    let of = [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]];
    for (k, value) in shape(l).into_iter().enumerate() {
        let slope = |axis: usize| match k {
            0..3 => of[k][axis] * (4.0 * l[k] - 1.0),
            _ => {
                let [a, b] = SIDES[k - 3];
                4.0 * (of[a][axis] * l[b] + of[b][axis] * l[a])
            }
        };
        let at = mesh.nodes_mm[triangle[k] as usize];
        place += at * value;
        s += at * slope(0);
        t += at * slope(1);
    }
    (place, s.cross(&t) * 0.5)
}

/// Quadratic shape functions of a triangle.
fn shape(l: &[f64; 3]) -> [f64; 6] {
    let corner = |k: usize| l[k] * (2.0 * l[k] - 1.0);
    let side = |k: usize| 4.0 * l[SIDES[k][0]] * l[SIDES[k][1]];
    [corner(0), corner(1), corner(2), side(0), side(1), side(2)]
}

/// Corners, in barycentric coordinates, of the parts of a triangle.
fn parts() -> impl Iterator<Item = [[f64; 3]; 3]> {
    let at = |i: usize, j: usize| {
        let (a, b) = (i as f64 / PARTS as f64, j as f64 / PARTS as f64);
        [1.0 - a - b, a, b]
    };
    (0..PARTS).flat_map(move |i| {
        (0..PARTS - i).flat_map(move |j| {
            let upright = [at(i, j), at(i + 1, j), at(i, j + 1)];
            let turned = [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            let is_inside = i + j + 2 <= PARTS;
            std::iter::once(upright).chain(is_inside.then_some(turned))
        })
    })
}
