//! Rods for several tests.

use cathforce_reference_solver::*;
use nalgebra::Vector3;

/// A rod of `length_m` in free space, clamped at the origin along x, without weight.
pub fn cantilever(length_m: f64, edges: usize, bending_n_m2: f64) -> Problem {
    let section = Section {
        length_m,
        bending_n_m2,
        torsion_n_m2: 0.7 * bending_n_m2,
        axial_n: 1e6 * bending_n_m2 / (length_m * length_m),
        mass_kg_per_m: 1e-3,
    };
    Problem {
        rod: Rod { radius_m: 0.8e-3, sections: vec![section], curves: Vec::new() },
        entry: Entry { position_m: Vector3::zeros(), direction: Vector3::x(), up: Vector3::y() },
        lumen: Lumen::open(),
        beyond: Default::default(),
        wall: WallLaw {
            line_stiffness_n_per_m2: 8e5,
            end_stiffness_n_per_m: 2e3,
            tangential_ratio: 3.0,
            friction_coefficient: 0.3,
        },
        gravity_m_per_s2: Vector3::zeros(),
        drag_n_s_per_m2: 0.0,
        tip_load: TipLoad::default(),
        numerics: Numerics { spacing_m: length_m / edges as f64, ..Numerics::default() },
    }
}

/// Rest position of the tip.
pub fn resting_tip(problem: &Problem, length_m: f64) -> Vector3<f64> {
    let drive = Drive { insertion_m: length_m, rotation_rad: 0.0 };
    let simulation = Simulation::settled(problem, drive).unwrap();
    simulation.sample().tip_m
}
