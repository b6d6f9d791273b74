//! The displacement of a wall under a load: Newton's method with load steps and a line search.

use nalgebra::Vector3;

use crate::error::SolveError;
use crate::mesh::{MeshError, WallMesh};
use crate::response::{Kinematics, WallMaterial};
use crate::system::{Field, System};

/// Corrections until a load step is given up and halved.
const MOST_CORRECTIONS: usize = 25;
/// Halvings of a correction until it is given up.
const MOST_HALVINGS: usize = 8;
/// Halvings of a load step until the load is given up.
const SMALLEST_STEP: f64 = 1.0 / 256.0;
/// Residual force over the forces that cancel in it at which a step is solved: far below what the
/// mesh costs, far above rounding.
const SOLVED: f64 = 1e-9;

/// A given displacement that lacks no more is reached \[mm\].
const ROUNDING_MM: f64 = 1e-12;

/// What is asked of a wall: forces on nodes, and displacements of nodes.
#[derive(Clone, Debug)]
pub struct Target {
    /// On every node \[N\].
    pub forces_n: Vec<Vector3<f64>>,
    /// Of every displacement that is given, in the order in which the solver was told them \[mm\].
    pub given_mm: Vec<f64>,
}

/// A wall in equilibrium.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    pub(crate) field: Field,
    /// Corrections by Newton's method since the unloaded wall; some of them cost a factorisation.
    pub corrections: usize,
}

impl Solution {
    /// Of every node \[mm\].
    pub fn displacements_mm(&self) -> &[Vector3<f64>] {
        &self.field.displacement
    }
}

/// The size of a residual, from the norms of its forces and of its volumes.
type Relative<'a> = &'a dyn Fn((f64, f64)) -> f64;

/// A mesh with its equations, for loads and materials of any number.
pub struct Solver {
    system: System,
    /// Places of the displacements that may be given, in all displacements.
    given: Vec<usize>,
    nodes: usize,
    corners: usize,
    volume_mm3: f64,
}

impl Solver {
    /// `given`: node and axis of displacements that [`Target::given_mm`] states, besides the nodes
    /// that the mesh holds.
    pub fn new(mesh: &WallMesh, given: &[(u32, usize)]) -> Result<Self, SolveError> {
        let nodes = mesh.nodes_mm.len();
        let mut is_given = vec![false; 3 * nodes];
        for node in &mesh.fixed {
            is_given[3 * *node as usize..3 * *node as usize + 3].fill(true);
        }
        let given: Vec<usize> =
            given.iter().map(|(node, axis)| 3 * *node as usize + axis).collect();
        for place in &given {
            is_given[*place] = true;
        }
        if !is_given.contains(&true) {
            return Err(
                MeshError::Loose("fix the rims of its openings, or nodes of the mesh").into()
            );
        }
        let system = System::new(mesh, &is_given)?;
        let (corners, volume_mm3) = (mesh.corners, mesh.volume_mm3());
        Ok(Self { system, given, nodes, corners, volume_mm3 })
    }

    /// Number of equations, and of entries of their factor.
    pub fn size(&self) -> [usize; 2] {
        [self.system.size, self.system.matrix.factor_entries()]
    }

    /// A wall without load.
    pub fn unloaded(&self) -> Solution {
        let displacement = vec![Vector3::zeros(); self.nodes];
        Solution {
            field: Field { displacement, pressure: vec![0.0; self.corners] },
            corrections: 0,
        }
    }

    /// Goes from a wall in equilibrium under `from` to one under `to`, in as few steps as succeed.
    pub fn solve(
        &mut self,
        material: &WallMaterial,
        start: &Solution,
        from: &Target,
        to: &Target,
    ) -> Result<Solution, SolveError> {
        let (mut share, mut step) = (0.0, 1.0);
        let mut solution = start.clone();
        while share < 1.0 {
            let next = f64::min(share + step, 1.0);
            match self.equilibrium(material, &solution, &between(from, to, next))? {
                Some(found) => {
                    solution = found;
                    share = next;
                    step *= 2.0;
                }
                None if step > SMALLEST_STEP && material.kinematics == Kinematics::Large => {
                    step = 0.5 * f64::min(step, 1.0 - share);
                }
                None => return Err(SolveError::Lost { share }),
            }
        }
        Ok(solution)
    }

    /// Displacements under several loads that are small, by one factorisation of the unloaded wall.
    pub fn small(
        &mut self,
        material: &WallMaterial,
        loads: &[Vec<Vector3<f64>>],
    ) -> Result<Vec<Solution>, SolveError> {
        let unloaded = self.unloaded();
        let rest = vec![0.0; 3 * self.nodes];
        let none = vec![Vector3::zeros(); self.nodes];
        let assembled = self.system.assemble(material, &unloaded.field, &none, &rest);
        assembled.ok_or(SolveError::Singular)?;
        self.system.matrix.factorise()?;
        let solve = |load: &Vec<Vector3<f64>>| {
            let right: Vec<f64> = self.system.external(load).iter().map(|x| -x).collect();
            let correction = self.system.matrix.solve(&right)?;
            let field = self.system.moved(&unloaded.field, &correction, &rest, 1.0);
            Ok(Solution { field, corrections: 1 })
        };
        loads.iter().map(solve).collect()
    }

    /// Forces by which nodes are held or loaded \[N\].
    pub fn reactions_n(
        &self,
        material: &WallMaterial,
        solution: &Solution,
    ) -> Option<Vec<Vector3<f64>>> {
        self.system.reactions(material, &solution.field)
    }

    /// Newton's method at one load. `None`: it did not converge.
    fn equilibrium(
        &mut self,
        material: &WallMaterial,
        start: &Solution,
        target: &Target,
    ) -> Result<Option<Solution>, SolveError> {
        let mut field = start.field.clone();
        // Volumes are compared with that of the whole wall, shared by the corners.
        let volume = material.shear_mpa() * self.volume_mm3 / (self.corners as f64).sqrt();
        for corrections in start.corrections..=start.corrections + MOST_CORRECTIONS {
            let step = self.step(&field, target);
            let is_there = step.iter().all(|step| *step == 0.0);
            let Some(residual) = self.system.assemble(material, &field, &target.forces_n, &step)
            else {
                return Ok(None);
            };
            let external = target.forces_n.iter().map(Vector3::norm_squared).sum::<f64>().sqrt();
            let force = residual.force_scale.max(external).max(f64::MIN_POSITIVE);
            let relative = |(f, v): (f64, f64)| (f / force).max(v / volume);
            if is_there && relative(self.system.norms(&residual.values)) < SOLVED {
                return Ok(Some(Solution { field, corrections }));
            }
            let Some(mut correction) = self.correction(&residual.values, material.kinematics)?
            else {
                return Ok(None);
            };
            correction.iter_mut().for_each(|x| *x = -*x);
            let before = is_there.then(|| relative(self.system.norms(&residual.values)));
            match self.search(material, &field, (&correction, &step), target, (before, &relative)) {
                Some(moved) => field = moved,
                None => return Ok(None),
            }
        }
        Ok(None)
    }

    /// What the matrix makes of a residual. The factor of an earlier load serves while the wall has
    /// changed little since; else the matrix is factorised. `None`: it has no factor.
    fn correction(
        &mut self,
        residual: &[f64],
        kinematics: Kinematics,
    ) -> Result<Option<Vec<f64>>, SolveError> {
        let matrix = &mut self.system.matrix;
        if let Some(found) = matrix.solve_by_earlier_factor(residual) {
            return Ok(Some(found));
        }
        match matrix.factorise().and_then(|()| matrix.solve(residual)) {
            Ok(found) => Ok(Some(found)),
            // A small strain has one matrix for all loads: it is singular, or it is solved.
            Err(_) if kinematics == Kinematics::Small => Err(SolveError::Singular),
            Err(_) => Ok(None),
        }
    }

    /// The largest share of a correction, by halving, with which the residual shrinks. While given
    /// displacements are still on their way, any that leaves the elements whole is taken.
    fn search(
        &self,
        material: &WallMaterial,
        field: &Field,
        (correction, step): (&[f64], &[f64]),
        target: &Target,
        (before, relative): (Option<f64>, Relative<'_>),
    ) -> Option<Field> {
        let mut share = 1.0;
        for _ in 0..MOST_HALVINGS {
            let moved = self.system.moved(field, correction, step, share);
            if let Some(after) = self.system.residual(material, &moved, &target.forces_n) {
                let after = relative(self.system.norms(&after));
                // The first full corrections of a bending wall raise the residual by its stretching
                // before they lower it, so that a moderate rise is let pass.
                if before.is_none_or(|before| after < 10.0 * before || after < 1e-3) {
                    return Some(moved);
                }
            }
            share *= 0.5;
        }
        None
    }

    /// What the given displacements lack \[mm\].
    fn step(&self, field: &Field, target: &Target) -> Vec<f64> {
        let mut step = vec![0.0; 3 * self.nodes];
        for (place, value) in self.given.iter().zip(&target.given_mm) {
            let lacks = value - field.displacement[place / 3][place % 3];
            step[*place] = if lacks.abs() > ROUNDING_MM { lacks } else { 0.0 };
        }
        step
    }
}

impl Target {
    /// Nothing on a wall with this many nodes and given displacements.
    pub fn none(nodes: usize, given: usize) -> Self {
        Self { forces_n: vec![Vector3::zeros(); nodes], given_mm: vec![0.0; given] }
    }
}

fn between(from: &Target, to: &Target, share: f64) -> Target {
    let forces = from.forces_n.iter().zip(&to.forces_n).map(|(a, b)| a + (b - a) * share);
    let given = from.given_mm.iter().zip(&to.given_mm).map(|(a, b)| a + (b - a) * share);
    Target { forces_n: forces.collect(), given_mm: given.collect() }
}
