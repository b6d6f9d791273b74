//! How far a wall gives way where an instrument presses on it.

use nalgebra::Vector3;
use thiserror::Error;

use crate::error::SolveError;
use crate::load::{Patch, PatchError};
use crate::mesh::WallMesh;
use crate::response::WallMaterial;
use crate::solve::{Solver, Target};

/// One load and what it does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pressed {
    pub force_n: f64,
    /// Along the force, weighted as its pressure is \[mm\].
    pub displacement_mm: f64,
    /// Of the node that moves furthest \[mm\].
    pub largest_mm: f64,
    /// Factorisations of the wall's matrix so far.
    pub corrections: usize,
}

/// Why a wall was not pressed.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum PressError {
    #[error(transparent)]
    Patch(#[from] PatchError),
    #[error(transparent)]
    Solve(#[from] SolveError),
    #[error("the mesh has no inner surface\n  fix: name it `inner` in the mesh")]
    NoSurface,
}

impl Patch {
    /// A round patch at the place of the inner surface that is nearest to `near_mm`, pressed along
    /// the normal out of the lumen, or along `direction`.
    pub fn round(
        mesh: &WallMesh,
        near_mm: &Vector3<f64>,
        direction: Option<Vector3<f64>>,
        radius_mm: f64,
    ) -> Result<Self, PressError> {
        let at = |node: u32| mesh.nodes_mm[node as usize];
        let far = |t: &&[u32; 6]| ((at(t[0]) + at(t[1]) + at(t[2])) / 3.0 - near_mm).norm_squared();
        let nearest = mesh.inner.iter().min_by(|a, b| far(a).total_cmp(&far(b)));
        let triangle = nearest.ok_or(PressError::NoSurface)?;
        let [a, b, c] = [at(triangle[0]), at(triangle[1]), at(triangle[2])];
        let outwards = (c - a).cross(&(b - a)).normalize();
        let direction = direction.and_then(|d| d.try_normalize(1e-12)).unwrap_or(outwards);
        // The foot of the perpendicular on the triangle's plane.
        let centre_mm = near_mm - outwards * (near_mm - a).dot(&outwards);
        let least = Vector3::ith(direction.iamin(), 1.0);
        let along = direction.cross(&least).normalize();
        Ok(Self { centre_mm, direction, along, half_axes_mm: [radius_mm; 2] })
    }
}

/// Presses with one force after the other, each from where the last one left the wall.
///
/// `forces_n`: ascending. `progress` is told after each.
pub fn press(
    mesh: &WallMesh,
    solver: &mut Solver,
    material: &WallMaterial,
    patch: &Patch,
    forces_n: &[f64],
    mut progress: impl FnMut(&Pressed),
) -> Result<Vec<Pressed>, PressError> {
    let shares = patch.shares(mesh)?;
    let mut from = Target::none(mesh.nodes_mm.len(), 0);
    let mut solution = solver.unloaded();
    let mut pressed = Vec::new();
    for &force_n in forces_n {
        let to = Target { forces_n: patch.forces_n(&shares, force_n), given_mm: Vec::new() };
        solution = solver.solve(material, &solution, &from, &to)?;
        let largest = solution.displacements_mm().iter().map(Vector3::norm).fold(0.0, f64::max);
        pressed.push(Pressed {
            force_n,
            displacement_mm: patch.displacement_mm(&shares, &solution),
            largest_mm: largest,
            corrections: solution.corrections,
        });
        progress(&pressed[pressed.len() - 1]);
        from = to;
    }
    Ok(pressed)
}
