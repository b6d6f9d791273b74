//! Extensions of the plain laws of wall, instrument and stream.

use crate::support::cantilever;
use cathforce_reference_solver::*;
use nalgebra::Vector3;

const LENGTH_M: f64 = 0.1;
const AT: Drive = Drive { insertion_m: LENGTH_M, rotation_rad: 0.0 };

#[test]
fn a_stream_towards_the_tip_is_held_by_the_drive() {
    let mut problem = cantilever(LENGTH_M, 50, 1e-4);
    problem.beyond.stream_n_per_m = 0.3;
    let simulation = Simulation::settled(&problem, AT).unwrap();
    let held_n = -simulation.sample().drive_force_n;
    // Half of one of the 50 edges belongs to the guide.
    assert!((held_n / (0.3 * LENGTH_M * 0.99) - 1.0).abs() < 1e-5, "{held_n}");
}

#[test]
fn a_viscous_rod_comes_back_in_its_own_time() {
    let time_s = 0.1;
    // The rod is stiff and light, and would return a hundred times as fast without viscosity.
    let mut bent = cantilever(LENGTH_M, 50, 1e-3);
    bent.beyond.bending_viscosity_s = time_s;
    bent.gravity_m_per_s2 = Vector3::z() * -9.81;
    let free = Problem { gravity_m_per_s2: Vector3::zeros(), ..bent.clone() };
    let mut simulation = Simulation::settled(&bent, AT).unwrap();
    let height_m = |simulation: &Simulation<'_>| simulation.sample().tip_m.z;
    let before_m = height_m(&simulation);
    simulation = simulation.released(&free);
    for _ in 0..100 {
        simulation.step(1e-3, AT).unwrap();
    }
    let left = height_m(&simulation) / before_m;
    assert!((left / (-1f64).exp() - 1.0).abs() < 0.02, "{left}");
}

#[test]
fn a_relaxing_wall_gives_way_slowly() {
    let (ratio, time_s) = (3.0, 2.0);
    let mut light = cantilever(LENGTH_M, 50, 1e-6);
    light.drag_n_s_per_m2 = 0.05;
    light.wall = WallLaw {
        line_stiffness_n_per_m2: 100.0,
        end_stiffness_n_per_m: 0.1,
        friction_coefficient: 0.0,
        ..light.wall
    };
    light.beyond.relaxing_ratio = ratio;
    light.beyond.relaxation_s = [time_s; 2];
    light.gravity_m_per_s2 = Vector3::z() * -9.81;
    // The floor of the tube is 1 mm below the guide's.
    let tube = TubePath::from(Vector3::zeros(), Vector3::x(), 1.8e-3).straight(0.2, 1.8e-3);
    light.lumen = Lumen::tube(tube.tube());
    let heavy = Problem { gravity_m_per_s2: 2.0 * light.gravity_m_per_s2, ..light.clone() };
    let mut simulation = Simulation::settled(&light, AT).unwrap();
    let sunk_m = |simulation: &mut Simulation<'_>, steps: usize, dt_s: f64| {
        for _ in 0..steps {
            simulation.step(dt_s, AT).unwrap();
        }
        simulation.sample().tip_m.z
    };
    // Until the wall has taken the weight.
    let before_m = sunk_m(&mut simulation, 400, 0.05);
    simulation = simulation.released(&heavy);
    let soon_m = sunk_m(&mut simulation, 20, 5e-3) - before_m;
    let late_m = sunk_m(&mut simulation, 400, 0.05) - before_m;
    let share = soon_m / late_m;
    let stiff = 1.0 / (1.0 + ratio);
    assert!(late_m < -3e-5, "{late_m}");
    assert!(share > stiff && share < stiff + 0.1, "{share}");
}
