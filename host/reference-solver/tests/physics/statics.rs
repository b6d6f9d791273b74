//! Rods without a wall, against closed forms and published solutions.

use std::f64::consts::{FRAC_PI_4, PI};

use crate::support::{cantilever, resting_tip};
use cathforce_reference_solver::*;
use nalgebra::Vector3;

const LENGTH_M: f64 = 0.1;
const BENDING: f64 = 1e-4;

/// The error with the most edges, over the length, and the order of convergence.
fn convergence(error: impl Fn(usize) -> f64) -> (f64, f64) {
    let [coarse, fine] = [32, 64].map(error);
    println!("errors {coarse:.2e}, {fine:.2e}: order {:.2}", (coarse / fine).log2());
    (fine, (coarse / fine).log2())
}

#[test]
fn a_tip_load_bends_as_the_elastica() {
    // PL²/EI, w/L, u/L of ../shared/references/elastica_cantilever_tip_load.json.
    for (load, drop, shortening) in [
        (1.0, 0.301720774, 0.056433236),
        (5.0, 0.713791524, 0.387628361),
        (10.0, 0.810609025, 0.554995598),
    ] {
        let (error, order) = convergence(|edges| {
            let mut problem = cantilever(LENGTH_M, edges, BENDING);
            problem.tip_load.force_n = Vector3::y() * (load * BENDING / LENGTH_M.powi(2));
            let tip = resting_tip(&problem, LENGTH_M) / LENGTH_M;
            (tip - Vector3::new(1.0 - shortening, drop, 0.0)).norm()
        });
        assert!(error < 2e-4 && order > 1.8, "load {load}: {error}, order {order}");
    }
}

#[test]
fn weight_bends_as_the_elastica() {
    // qL³/EI, w/L, u/L of ../shared/references/elastica_cantilever_self_weight.json.
    for (load, drop, shortening) in
        [(2.0, 0.238506583, 0.033107053), (16.0, 0.797019638, 0.490005080)]
    {
        let (error, order) = convergence(|edges| {
            let mut problem = cantilever(LENGTH_M, edges, BENDING);
            let weight = load * BENDING / LENGTH_M.powi(3);
            problem.gravity_m_per_s2 = Vector3::z() * (-weight / 1e-3);
            let tip = resting_tip(&problem, LENGTH_M) / LENGTH_M;
            (tip - Vector3::new(1.0 - shortening, 0.0, -drop)).norm()
        });
        assert!(error < 2e-4 && order > 1.8, "load {load}: {error}, order {order}");
    }
}

#[test]
fn an_end_moment_rolls_up() {
    // ML/EI = π closes half a circle: ../shared/references/end_moment_roll_up.json.
    let (error, order) = convergence(|edges| {
        let mut problem = cantilever(LENGTH_M, edges, BENDING);
        problem.tip_load.moment_n_m = Vector3::z() * (PI * BENDING / LENGTH_M);
        let tip = resting_tip(&problem, LENGTH_M) / LENGTH_M;
        (tip - Vector3::new(0.0, 2.0 / PI, 0.0)).norm()
    });
    assert!(error < 1e-3 && order > 1.9, "{error}, order {order}");
}

#[test]
fn a_curved_rod_bends_and_twists_in_space() {
    // Bathe and Bolourchi's 45° bend, row square_GJ_2I, F = 600, of
    // ../shared/references/bend45_bathe_bolourchi.json. Shear, which this rod does not have,
    // is worth a few 10⁻⁵ of it. One unit of the original's length is a millimetre here.
    let exact = Vector3::new(47.150439, 15.684801, 53.474859) * 1e-3;
    let length = 0.1 * FRAC_PI_4;
    let (error, order) = convergence(|edges| {
        let mut problem = cantilever(length, edges, 1e1 / 12.0);
        problem.rod.sections[0].torsion_n_m2 = 1e1 / 12.0;
        problem.rod.sections[0].axial_n = 1e7;
        problem.rod.curves = vec![Curve { length_m: length, up_per_m: 10.0, side_per_m: 0.0 }];
        problem.tip_load.force_n = Vector3::z() * 600.0;
        (resting_tip(&problem, length) - exact).norm() / length
    });
    assert!(error < 2e-4 && order > 1.4, "{error}, order {order}");
}

#[test]
fn a_column_softens_towards_its_buckling_load() {
    // Q (tan kL − kL)/(P k) with k² = P/EI: a tip force Q across a column under P.
    for share in [0.5, 0.9] {
        let critical = PI * PI * BENDING / (4.0 * LENGTH_M * LENGTH_M);
        let (thrust, across) = (share * critical, 1e-3 * critical);
        let mut problem = cantilever(LENGTH_M, 64, BENDING);
        problem.tip_load.force_n = Vector3::new(-thrust, across, 0.0);
        let k = (thrust / BENDING).sqrt();
        let exact = across * ((k * LENGTH_M).tan() - k * LENGTH_M) / (thrust * k);
        let error = resting_tip(&problem, LENGTH_M).y / exact - 1.0;
        println!("{share} of the buckling load: {error:.1e}");
        assert!(error.abs() < 0.01, "{share}: {error}");
    }
}

#[test]
fn beyond_its_buckling_load_a_column_bows() {
    // Clamped–free, P/P_cr = 1.152 turns the tip by 60°: P/P_cr = (2 K(sin 30°)/π)².
    let elliptic = 1.685_750_354_812_596;
    let critical = PI * PI * BENDING / (4.0 * LENGTH_M * LENGTH_M);
    let thrust = critical * (2.0 * elliptic / PI).powi(2);
    let mut problem = cantilever(LENGTH_M, 64, BENDING);
    // A slight transverse force chooses the side.
    problem.tip_load.force_n = Vector3::new(-thrust, 1e-4 * critical, 0.0);
    let tip = resting_tip(&problem, LENGTH_M) / LENGTH_M;
    // w/L = sin 30° · 2/K.
    let drop = 2.0 * 0.5 / elliptic;
    println!("deflection {:.5}, exact {drop:.5}", tip.y);
    assert!((tip.y - drop).abs() < 3e-3, "{} {drop}", tip.y);
}

#[test]
fn it_swings_at_its_own_frequency() {
    // 0.05 m of E = 26 MPa, solid, r = 0.825 mm: 14.2523 Hz, of
    // ../shared/references/cantilever_dynamics.json.
    let (length, radius, density) = (0.05, 0.825e-3_f64, 1091.237);
    let bending = 26e6 * PI / 4.0 * radius.powi(4);
    let mut problem = cantilever(length, 50, bending);
    problem.rod.sections[0].mass_kg_per_m = density * PI * radius * radius;
    problem.numerics.step_s = 2.5e-4;
    problem.gravity_m_per_s2 = Vector3::z() * -9.81;
    let drive = Drive { insertion_m: length, rotation_rad: 0.0 };
    let held = Simulation::settled(&problem, drive).unwrap();
    let drop = held.sample().tip_m.z;
    // Half of the weight is removed, and the rod swings about its new rest position.
    let mut light = problem.clone();
    light.gravity_m_per_s2 *= 0.5;
    let mut swinging = held.released(&light);
    let mut crossings = Vec::new();
    let mut before = drop;
    for k in 1..=1600 {
        let z = swinging.step(problem.numerics.step_s, drive).unwrap().tip_m.z;
        if (before < 0.5 * drop) != (z < 0.5 * drop) {
            let share = (0.5 * drop - before) / (z - before);
            crossings.push((f64::from(k) - 1.0 + share) * problem.numerics.step_s);
        }
        before = z;
    }
    let periods = 0.5 * (crossings.len() - 1) as f64;
    let frequency = periods / (crossings[crossings.len() - 1] - crossings[0]);
    println!("{frequency:.3} Hz");
    assert!((frequency / 14.252303 - 1.0).abs() < 0.01, "{frequency}");
}
