//! A wall that moves.

use crate::support::cantilever;
use cathforce_reference_solver::*;
use nalgebra::Vector3;

const FRICTION: f64 = 0.4;

#[test]
fn a_wall_that_slides_along_a_resting_rod_drags_it_with_coulombs_force() {
    let mut problem = cantilever(0.1, 50, 1e-6);
    problem.gravity_m_per_s2 = Vector3::z() * -9.81;
    problem.drag_n_s_per_m2 = 0.05;
    problem.wall.friction_coefficient = FRICTION;
    // The floor of the tube is 1 mm below the guide's.
    let tube = TubePath::from(Vector3::zeros(), Vector3::x(), 1.8e-3).straight(0.2, 1.8e-3);
    problem.lumen = Lumen::tube(tube.tube());
    let drive = Drive { insertion_m: 0.1, rotation_rad: 0.0 };
    let moved: Vec<Problem> = (1..=100)
        .map(|k| {
            let lumen = problem.lumen.clone().at(Vector3::x() * (2e-5 * f64::from(k)));
            Problem { lumen, ..problem.clone() }
        })
        .collect();
    let mut simulation = Simulation::settled(&problem, drive).unwrap();
    for problem in &moved {
        simulation = simulation.released(problem);
        simulation.step(2e-3, drive).unwrap();
    }
    let sample = simulation.sample();
    let dragged = -sample.force_on_vessel_n.x;
    assert!(sample.normal_force_n > 1e-4, "it lies on the floor: {}", sample.normal_force_n);
    let error = dragged / (FRICTION * sample.normal_force_n) - 1.0;
    assert!(error.abs() < 1e-3, "{dragged} {}", sample.normal_force_n);
}
