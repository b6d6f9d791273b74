//! A straight tube, or a sector of one, as a mesh of tetrahedra with round sides.

use nalgebra::Vector3;

use crate::mesh::{MeshError, WallMesh};

/// Whether a tube goes all the way round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TubePart {
    Ring,
    Sector,
}

/// A tube around the z axis, by the places of its layers of nodes.
#[derive(Clone, Debug)]
pub struct Tube {
    /// From the inner radius on \[mm\].
    pub radii_mm: Vec<f64>,
    /// Ascending, about z \[rad\]; a ring leaves out 2π.
    pub angles_rad: Vec<f64>,
    pub part: TubePart,
    /// Ascending \[mm\].
    pub along_mm: Vec<f64>,
}

/// The six tetrahedra of a box: paths from its lowest to its highest corner, one axis after the
/// other. They match those of the neighbouring boxes, round the ring too.
const PATHS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

impl Tube {
    /// Layers at equal distances.
    pub fn even(
        inner_mm: f64,
        thickness_mm: f64,
        length_mm: f64,
        [radial, around, along]: [usize; 3],
    ) -> Self {
        let steps = |n: usize| (0..=n).map(move |k| k as f64 / n as f64);
        Self {
            radii_mm: steps(radial).map(|s| inner_mm + thickness_mm * s).collect(),
            angles_rad: steps(around).take(around).map(|s| std::f64::consts::TAU * s).collect(),
            part: TubePart::Ring,
            along_mm: steps(along).map(|s| length_mm * s).collect(),
        }
    }

    /// The mesh; `is_held` tells the corners that do not move, by their place.
    pub fn mesh(&self, is_held: impl Fn(&Vector3<f64>) -> bool) -> Result<WallMesh, MeshError> {
        let [radial, around, along] =
            [self.radii_mm.len(), self.angles_rad.len(), self.along_mm.len()];
        let corner = |i: usize, j: usize, k: usize| (i + radial * (j % around + around * k)) as u32;
        let mut corners_mm = Vec::with_capacity(radial * around * along);
        for z in &self.along_mm {
            for angle in &self.angles_rad {
                let place = |r: &f64| Vector3::new(r * angle.cos(), r * angle.sin(), *z);
                corners_mm.extend(self.radii_mm.iter().map(place));
            }
        }
        let (mut tetrahedra, mut inner) = (Vec::new(), Vec::new());
        let boxes_around = if self.part == TubePart::Ring { around } else { around - 1 };
        for k in 0..along - 1 {
            for j in 0..boxes_around {
                for i in 0..radial - 1 {
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
                let face = [(j, k), (j, k + 1), (j + 1, k + 1), (j + 1, k)];
                let [a, b, c, d] = face.map(|(j, k)| corner(0, j, k));
                inner.extend([[a, b, c], [a, c, d]]);
            }
        }
        let held = (0..corners_mm.len()).filter(|&k| is_held(&corners_mm[k]));
        let held: Vec<u32> = held.map(|k| k as u32).collect();
        WallMesh::quadratic(corners_mm, tetrahedra, &inner, &held, middle)
    }
}

/// The middle of an edge on its arc.
fn middle(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
    let straight = (a + b) * 0.5;
    let radius = |p: &Vector3<f64>| p.xy().norm();
    let factor = 0.5 * (radius(a) + radius(b)) / radius(&straight);
    Vector3::new(straight.x * factor, straight.y * factor, straight.z)
}
