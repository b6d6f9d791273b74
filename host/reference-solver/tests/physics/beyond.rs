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
    light.beyond.relaxing = [0.5, 0.3, 0.2].map(|share| Relaxing { ratio: share * ratio, time_s });
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

#[test]
fn a_rod_with_a_relaxing_spring_gives_way_slowly() {
    let (ratio, time_s) = (2.0, 1.0);
    let mut free = cantilever(LENGTH_M, 50, 1e-3);
    free.drag_n_s_per_m2 = 0.05;
    free.beyond.relaxing_bends[0] = Relaxing { ratio, time_s };
    let loaded = Problem { gravity_m_per_s2: Vector3::z() * -9.81, ..free.clone() };
    let mut simulation = Simulation::settled(&free, AT).unwrap();
    simulation = simulation.released(&loaded);
    let mut sunk_m = |steps: usize, dt_s: f64| {
        for _ in 0..steps {
            simulation.step(dt_s, AT).unwrap();
        }
        simulation.sample().tip_m.z
    };
    let (soon_m, late_m) = (sunk_m(20, 5e-3), sunk_m(400, 0.05));
    // A standard linear solid creeps in (1 + r) times the time in which it relaxes.
    let at_once = 1.0 / (1.0 + ratio);
    let expected = 1.0 - (1.0 - at_once) * (-0.1f64 / ((1.0 + ratio) * time_s)).exp();
    assert!(late_m < -1e-4, "{late_m}");
    assert!((soon_m / late_m - expected).abs() < 0.02, "{} {expected}", soon_m / late_m);
}

/// A straight rod on the floor of a tube, pulled back from rest: force of the drive, step by step.
fn pulled_over_a_floor(memory: Memory) -> Vec<f64> {
    let mut problem = cantilever(LENGTH_M, 50, 1e-4);
    problem.drag_n_s_per_m2 = 0.05;
    problem.wall.friction_coefficient = 0.3;
    problem.gravity_m_per_s2 = Vector3::z() * -9.81;
    problem.beyond.memory = memory;
    let tube = TubePath::from(Vector3::zeros(), Vector3::x(), 0.9e-3).straight(0.2, 0.9e-3);
    problem.lumen = Lumen::tube(tube.tube());
    let mut simulation = Simulation::settled(&problem, AT).unwrap();
    let drive = |k: i32| Drive { insertion_m: LENGTH_M - 2e-5 * f64::from(k), ..AT };
    (1..=200).map(|k| -simulation.step(2e-3, drive(k)).unwrap().drive_force_n).collect()
}

#[test]
fn friction_with_a_memory_holds_more_until_it_has_slid_for_its_time() {
    let plain = pulled_over_a_floor(Memory::default());
    let memory = Memory { excess: 1.0, speed_m_per_s: 2e-3, fall: Fall::Gaussian, time_s: 0.05 };
    let late = pulled_over_a_floor(memory);
    let (first, last) = (late[3] / plain[3], late[199] / plain[199]);
    assert!(first > 1.4, "{first}");
    assert!((last - 1.0).abs() < 0.05, "{last}");
}
