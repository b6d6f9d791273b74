//! The equations of a mesh: equilibrium of every node that is free, and the volume at every corner.
//!
//! Unknowns are the displacement u of the nodes and the pressure p of the corners. With shape
//! functions N of the nodes and L of the corners, at every point of integration of volume w:
//!
//!   0 = Σ w (∂Ψ/∂F) ∇N − f        0 = Σ w L (J − 1 − p/κ)
//!
//! p is an unknown in multiples of the shear modulus, and its equation is multiplied by that, so that
//! the matrix stays symmetric and its entries are alike.

use cathforce_sparse::SparseSymmetric;
use nalgebra::{Matrix3, Vector3};

use crate::element::{Element, POINTS, linear};
use crate::error::SolveError;
use crate::mesh::WallMesh;
use crate::response::{Response, WallMaterial};

/// Unknowns of one element: three displacements of ten nodes, four pressures.
const LOCAL: usize = 34;
const PRESSURES: usize = 30;

/// Displacement of all nodes \[mm\] and pressure of the corners \[shear modulus\].
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Field {
    pub displacement: Vec<Vector3<f64>>,
    pub pressure: Vec<f64>,
}

/// The equations with one pattern for all materials.
pub(crate) struct System {
    elements: Vec<Element>,
    /// Unknown of each displacement, node by node, then of each pressure; `None` where it is given.
    unknowns: Vec<Option<u32>>,
    nodes: usize,
    pub size: usize,
    pub matrix: SparseSymmetric,
}

/// What is left of the equations.
pub(crate) struct Residual {
    pub values: Vec<f64>,
    /// Size of the forces that cancel in it \[N\], and of the volumes \[mm³ × MPa\].
    pub force_scale: f64,
}

/// Contribution of one element.
struct Local {
    residual: [f64; LOCAL],
    matrix: Box<[[f64; LOCAL]; LOCAL]>,
}

impl System {
    /// `given`: whether each displacement, node by node, is given.
    pub fn new(mesh: &WallMesh, given: &[bool]) -> Result<Self, SolveError> {
        let elements = Element::all(mesh)?;
        let nodes = mesh.nodes_mm.len();
        let mut size = 0;
        let mut number = |is_given: bool| {
            (!is_given).then(|| {
                size += 1;
                size - 1
            })
        };
        let mut unknowns: Vec<Option<u32>> = given.iter().map(|given| number(*given)).collect();
        unknowns.extend((0..mesh.corners).map(|_| number(false)));
        let size = size as usize;
        let mut entries = Vec::new();
        for element in &elements {
            let local = local_unknowns(element, nodes);
            for (at, row) in local.iter().enumerate() {
                for column in &local[..=at] {
                    if let (Some(a), Some(b)) = (unknowns[*row], unknowns[*column]) {
                        entries.push((a.min(b), a.max(b)));
                    }
                }
            }
        }
        let matrix = SparseSymmetric::new(size, entries)?;
        Ok(Self { elements, unknowns, nodes, size, matrix })
    }

    /// Assembles matrix and residual at a field. `forces`: on all nodes \[N\]. `step`: change of the
    /// given displacements that the next correction must follow, node by node \[mm\]; the residual
    /// holds what it causes. `None` where an element is turned inside out.
    pub fn assemble(
        &mut self,
        material: &WallMaterial,
        field: &Field,
        forces: &[Vector3<f64>],
        step: &[f64],
    ) -> Option<Residual> {
        self.matrix.values.fill(0.0);
        let mut residual = self.external(forces);
        let mut magnitudes = 0.0;
        for index in 0..self.elements.len() {
            let local = self.local(index, material, field, true)?;
            let all = local_unknowns(&self.elements[index], self.nodes);
            for (a, row) in all.iter().enumerate() {
                let Some(i) = self.unknowns[*row] else { continue };
                residual[i as usize] += local.residual[a];
                magnitudes += if a < PRESSURES { local.residual[a].powi(2) } else { 0.0 };
                for (b, column) in all.iter().enumerate() {
                    match self.unknowns[*column] {
                        Some(j) if b <= a => {
                            self.matrix.add(i as usize, j as usize, local.matrix[a][b]);
                        }
                        Some(_) => {}
                        None => {
                            residual[i as usize] += local.matrix[a][b] * step[*column];
                        }
                    }
                }
            }
        }
        Some(Residual { values: residual, force_scale: magnitudes.sqrt() })
    }

    /// The residual alone.
    pub fn residual(
        &self,
        material: &WallMaterial,
        field: &Field,
        forces: &[Vector3<f64>],
    ) -> Option<Vec<f64>> {
        let mut residual = self.external(forces);
        for index in 0..self.elements.len() {
            let local = self.local(index, material, field, false)?;
            for (a, row) in local_unknowns(&self.elements[index], self.nodes).iter().enumerate() {
                if let Some(i) = self.unknowns[*row] {
                    residual[i as usize] += local.residual[a];
                }
            }
        }
        Some(residual)
    }

    /// Forces that hold every node \[N\]: the sum of the stresses, given displacements included.
    pub fn reactions(&self, material: &WallMaterial, field: &Field) -> Option<Vec<Vector3<f64>>> {
        let mut reactions = vec![Vector3::zeros(); self.nodes];
        for (index, element) in self.elements.iter().enumerate() {
            let local = self.local(index, material, field, false)?;
            for (a, node) in element.nodes.iter().enumerate() {
                reactions[*node as usize] +=
                    Vector3::from_column_slice(&local.residual[3 * a..3 * a + 3]);
            }
        }
        Some(reactions)
    }

    /// Adds a share of a correction to a field; `step` as in [`Self::assemble`].
    pub fn moved(&self, field: &Field, correction: &[f64], step: &[f64], share: f64) -> Field {
        let mut moved = field.clone();
        for (node, displacement) in moved.displacement.iter_mut().enumerate() {
            for axis in 0..3 {
                let by = match self.unknowns[3 * node + axis] {
                    Some(unknown) => correction[unknown as usize],
                    None => step[3 * node + axis],
                };
                displacement[axis] += share * by;
            }
        }
        for (corner, pressure) in moved.pressure.iter_mut().enumerate() {
            if let Some(unknown) = self.unknowns[3 * self.nodes + corner] {
                *pressure += share * correction[unknown as usize];
            }
        }
        moved
    }

    /// Square sums of a residual's forces and of its volumes.
    pub fn norms(&self, residual: &[f64]) -> (f64, f64) {
        // Pressures are numbered last.
        let pressures = self.unknowns[3 * self.nodes..].iter().flatten().count();
        let (forces, volumes) = residual.split_at(self.size - pressures);
        let norm = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
        (norm(forces), norm(volumes))
    }

    /// The residual of forces on all nodes \[N\] alone.
    pub fn external(&self, forces: &[Vector3<f64>]) -> Vec<f64> {
        let mut residual = vec![0.0; self.size];
        for (node, force) in forces.iter().enumerate() {
            for axis in 0..3 {
                if let Some(unknown) = self.unknowns[3 * node + axis] {
                    residual[unknown as usize] -= force[axis];
                }
            }
        }
        residual
    }

    fn local(
        &self,
        index: usize,
        material: &WallMaterial,
        field: &Field,
        with_matrix: bool,
    ) -> Option<Local> {
        let element = &self.elements[index];
        let shear = material.shear_mpa();
        let softness = shear / material.bulk_mpa();
        let mut local = Local { residual: [0.0; LOCAL], matrix: Box::new([[0.0; LOCAL]; LOCAL]) };
        for point in 0..POINTS {
            let (gradients, weight) = (&element.gradients[point], element.weights[point]);
            let values = linear(point);
            let mut deformation = Matrix3::identity();
            for (node, gradient) in element.nodes.iter().zip(gradients) {
                deformation += field.displacement[*node as usize] * gradient.transpose();
            }
            let corners = element.nodes[..4].iter().zip(values);
            let pressure: f64 =
                corners.map(|(corner, value)| field.pressure[*corner as usize] * value).sum();
            let response = Response::new(material, &deformation, shear * pressure)?;
            let volume = shear * weight * (response.growth - softness * pressure);
            for (a, gradient) in gradients.iter().enumerate() {
                let force = response.stress * gradient * weight;
                for axis in 0..3 {
                    local.residual[3 * a + axis] += force[axis];
                }
            }
            for (k, value) in values.iter().enumerate() {
                local.residual[PRESSURES + k] += value * volume;
            }
            if with_matrix {
                stiffness(&mut local.matrix, &response, gradients, weight);
                coupling(
                    &mut local.matrix,
                    &response,
                    gradients,
                    &values,
                    [weight * shear, softness],
                );
            }
        }
        Some(local)
    }
}

/// Adds the stiffness against displacements at one point; only rows after their columns are needed.
fn stiffness(
    matrix: &mut [[f64; LOCAL]; LOCAL],
    response: &Response,
    gradients: &[Vector3<f64>; 10],
    weight: f64,
) {
    for (b, right) in gradients.iter().enumerate() {
        // Change of the stress by the displacement of this node along each axis.
        let mut change = [[0.0; 3]; 9];
        for (row, change) in response.tangent.iter().zip(&mut change) {
            for k in 0..3 {
                change[k] = weight
                    * (row[3 * k] * right[0]
                        + row[3 * k + 1] * right[1]
                        + row[3 * k + 2] * right[2]);
            }
        }
        for (a, left) in gradients.iter().enumerate() {
            for i in 0..3 {
                for k in 0..3 {
                    matrix[3 * a + i][3 * b + k] += left[0] * change[3 * i][k]
                        + left[1] * change[3 * i + 1][k]
                        + left[2] * change[3 * i + 2][k];
                }
            }
        }
    }
}

/// Adds what displacements and pressures do to each other at one point.
fn coupling(
    matrix: &mut [[f64; LOCAL]; LOCAL],
    response: &Response,
    gradients: &[Vector3<f64>; 10],
    values: &[f64; 4],
    [scaled, softness]: [f64; 2],
) {
    for (a, gradient) in gradients.iter().enumerate() {
        let growth = response.cofactor * gradient * scaled;
        for (k, value) in values.iter().enumerate() {
            for axis in 0..3 {
                matrix[3 * a + axis][PRESSURES + k] += growth[axis] * value;
                matrix[PRESSURES + k][3 * a + axis] += growth[axis] * value;
            }
        }
    }
    for (k, left) in values.iter().enumerate() {
        for (l, right) in values.iter().enumerate() {
            matrix[PRESSURES + k][PRESSURES + l] -= scaled * softness * left * right;
        }
    }
}

/// Places of an element's unknowns in the list of all.
fn local_unknowns(element: &Element, nodes: usize) -> [usize; LOCAL] {
    let mut all = [0; LOCAL];
    for (a, node) in element.nodes.iter().enumerate() {
        for axis in 0..3 {
            all[3 * a + axis] = 3 * *node as usize + axis;
        }
    }
    for (k, corner) in element.nodes[..4].iter().enumerate() {
        all[PRESSURES + k] = 3 * nodes + *corner as usize;
    }
    all
}
