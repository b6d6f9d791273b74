//! Shape functions of one tetrahedron at its points of integration.
//!
//! Four points integrate polynomials of degree two exactly, which the stiffness of a quadratic
//! displacement on a straight tetrahedron is. Geometry is quadratic too, so that a tube is round.

use nalgebra::{Matrix3, Vector3};

use crate::mesh::{EDGES, MeshError, WallMesh};

pub(crate) const POINTS: usize = 4;
/// Barycentric coordinates of the points: (5 ± 3√5)/20 and (5 − √5)/20.
const NEAR: f64 = 0.585_410_196_624_968_5;
const FAR: f64 = 0.138_196_601_125_010_5;

/// Of one tetrahedron.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    pub nodes: [u32; 10],
    /// Gradients of the ten shape functions in the unloaded wall \[1/mm\].
    pub gradients: [[Vector3<f64>; 10]; POINTS],
    /// Volume that each point stands for \[mm³\].
    pub weights: [f64; POINTS],
}

/// Values of the four linear shape functions at a point.
pub(crate) fn linear(point: usize) -> [f64; 4] {
    let mut values = [FAR; 4];
    values[point] = NEAR;
    values
}

impl Element {
    /// All elements of a mesh. `Err`: one is inverted.
    pub fn all(mesh: &WallMesh) -> Result<Vec<Self>, MeshError> {
        let total = mesh.tetrahedra.len();
        let element = |(index, nodes): (usize, &[u32; 10])| {
            Self::new(mesh, nodes).ok_or_else(|| {
                let at_mm = mesh.nodes_mm[nodes[0] as usize].into();
                MeshError::Inverted { index, total, at_mm }
            })
        };
        mesh.tetrahedra.iter().enumerate().map(element).collect()
    }

    fn new(mesh: &WallMesh, nodes: &[u32; 10]) -> Option<Self> {
        let mut gradients = [[Vector3::zeros(); 10]; POINTS];
        let mut weights = [0.0; POINTS];
        for point in 0..POINTS {
            let local = local_gradients(&linear(point));
            let mut jacobian = Matrix3::zeros();
            for (node, gradient) in nodes.iter().zip(&local) {
                jacobian += mesh.nodes_mm[*node as usize] * gradient.transpose();
            }
            let volume = jacobian.determinant();
            let largest = jacobian.norm().powi(3);
            // NaN is inverted too.
            if volume.is_nan() || volume <= 1e-6 * largest {
                return None;
            }
            let back = jacobian.try_inverse()?.transpose();
            gradients[point] = local.map(|gradient| back * gradient);
            weights[point] = volume / 24.0;
        }
        Some(Self { nodes: *nodes, gradients, weights })
    }
}

impl WallMesh {
    /// Volume of the material \[mm³\]; 0 of a mesh with an inverted element.
    pub fn volume_mm3(&self) -> f64 {
        Element::all(self).map_or(0.0, |all| all.iter().flat_map(|e| e.weights).sum())
    }
}

/// Gradients of the ten shape functions by the coordinates ξ of the corners 1, 2 and 3, at the
/// barycentric coordinates `l`: N = l(2l − 1) at corners, 4 l l′ on edges.
fn local_gradients(l: &[f64; 4]) -> [Vector3<f64>; 10] {
    let of = [
        Vector3::new(-1.0, -1.0, -1.0),
        Vector3::new(1.0, 0.0, 0.0),
        Vector3::new(0.0, 1.0, 0.0),
        Vector3::new(0.0, 0.0, 1.0),
    ];
    let mut gradients = [Vector3::zeros(); 10];
    for corner in 0..4 {
        gradients[corner] = of[corner] * (4.0 * l[corner] - 1.0);
    }
    for (gradient, [a, b]) in gradients[4..].iter_mut().zip(EDGES) {
        *gradient = of[a] * (4.0 * l[b]) + of[b] * (4.0 * l[a]);
    }
    gradients
}
