//! Rods that swing: order of the time steps, mass at the tip, drag of air and of a pulsating flow.

use std::f64::consts::{PI, TAU};

use crate::support::cantilever;
use cathforce_reference_solver::*;
use nalgebra::Vector3;

const LENGTH_M: f64 = 0.05;
const EDGES: usize = 12;
const AT: Drive = Drive { insertion_m: LENGTH_M, rotation_rad: 0.0 };
/// E = 26 MPa, solid, r = 0.825 mm: 14.252303 Hz (Euler–Bernoulli, clamped and free).
const FREQUENCY_HZ: f64 = 14.252303;
const BENDING: f64 = 26e6 * PI / 4.0 * 0.825e-3 * 0.825e-3 * 0.825e-3 * 0.825e-3;
const MASS_KG_PER_M: f64 = 1091.237 * PI * 0.825e-3 * 0.825e-3;

fn rod(integrator: Integrator, step_s: f64) -> Problem {
    let mut problem = cantilever(LENGTH_M, EDGES, BENDING);
    problem.rod.sections[0].mass_kg_per_m = MASS_KG_PER_M;
    problem.numerics.step_s = step_s;
    problem.numerics.integrator = integrator;
    problem.numerics.tolerance_n = 1e-11;
    problem
}

/// Heights of the tip, one a step from rest on, after a force at the tip has let go.
fn release(problem: &Problem, force_n: f64, duration_s: f64) -> Vec<f64> {
    let mut held = problem.clone();
    held.tip_load.force_n = Vector3::z() * force_n;
    let mut simulation = Simulation::settled(&held, AT).unwrap().released(problem);
    let mut heights = vec![simulation.sample().tip_m.z];
    let step_s = problem.numerics.step_s;
    for _ in 0..(duration_s / step_s).round() as usize {
        heights.push(simulation.step(step_s, AT).unwrap().tip_m.z);
    }
    heights
}

/// Force at the tip that bends it by a share of the length, small enough to be linear.
fn force_for(share: f64) -> f64 {
    3.0 * BENDING / LENGTH_M.powi(2) * share
}

/// Local extremes of a swing.
fn extremes(heights: &[f64]) -> Vec<f64> {
    let turns = |w: &[f64]| (w[1] - w[0]) * (w[2] - w[1]) < 0.0;
    heights.windows(3).filter(|w| turns(w)).map(|w| w[1].abs()).collect()
}

/// Mean frequency by the zeros of a swing about 0 \[Hz\].
fn frequency_hz(heights: &[f64], step_s: f64) -> f64 {
    let crossing = |(k, w): (usize, &[f64])| {
        (w[0] * w[1] < 0.0).then(|| (k as f64 + w[0] / (w[0] - w[1])) * step_s)
    };
    let times: Vec<f64> = heights.windows(2).enumerate().filter_map(crossing).collect();
    0.5 * (times.len() - 1) as f64 / (times[times.len() - 1] - times[0])
}

#[test]
fn steps_are_of_the_order_that_is_stated() {
    // Kelvin–Voigt damping leaves a smooth swing of the lowest mode after the first third.
    let duration_s = 0.75 / FREQUENCY_HZ;
    let at_end = |integrator, steps: u32| {
        let mut problem = rod(integrator, duration_s / f64::from(steps));
        problem.beyond.bending_viscosity_s = 2e-3;
        *release(&problem, force_for(0.02), duration_s).last().unwrap()
    };
    for (integrator, least, most) in [
        (Integrator::BdfAlpha { alpha: 0.0 }, 1.8, 2.3),
        (Integrator::BdfAlpha { alpha: -0.25 }, 1.8, 2.3),
        (Integrator::Euler, 0.7, 1.3),
    ] {
        let exact = at_end(Integrator::BdfAlpha { alpha: -0.25 }, 1600);
        let [coarse, fine] = [100, 200].map(|steps| (at_end(integrator, steps) - exact).abs());
        let order = (coarse / fine).log2();
        println!("{integrator:?}: errors {coarse:.2e}, {fine:.2e} m, order {order:.2}");
        assert!((least..most).contains(&order), "{integrator:?}: {order}");
    }
}

#[test]
fn the_trapezoidal_rule_keeps_the_swing_that_euler_loses() {
    let left = |integrator| {
        let problem = rod(integrator, 1e-3);
        let heights = release(&problem, force_for(0.02), 6.0 / FREQUENCY_HZ);
        let swings = extremes(&heights);
        swings[swings.len() - 1] / heights[0].abs()
    };
    let kept = left(Integrator::BdfAlpha { alpha: -0.49 });
    let damped = left(Integrator::BdfAlpha { alpha: 0.0 });
    let lost = left(Integrator::Euler);
    println!("left after six periods: {kept:.3}, BDF2 {damped:.3}, Euler {lost:.3}");
    // The static bend is 97 % of the lowest mode; the rest are modes that a step does not resolve.
    assert!(kept > 0.93 && damped < kept && damped > 0.7 && lost < 0.3);
}

#[test]
fn a_mass_at_the_tip_slows_the_swing() {
    let step_s = 5e-4;
    let frequency = |tip_mass_kg: f64| {
        let mut problem = rod(Integrator::BdfAlpha { alpha: -0.3 }, step_s);
        problem.beyond.tip_mass_kg = tip_mass_kg;
        frequency_hz(&release(&problem, force_for(0.01), 0.6), step_s)
    };
    let free = frequency(0.0);
    let beam_kg = MASS_KG_PER_M * LENGTH_M;
    let tip_kg = 5.0 * beam_kg;
    // Rayleigh's quotient: 33/140 of the beam swings with a mass that is large beside it.
    let exact =
        (3.0 * BENDING / (LENGTH_M.powi(3) * (tip_kg + 33.0 / 140.0 * beam_kg))).sqrt() / TAU;
    let laden = frequency(tip_kg);
    println!("{free:.3} Hz of {FREQUENCY_HZ:.3}, with a mass {laden:.4} Hz of {exact:.4}");
    assert!((free / FREQUENCY_HZ - 1.0).abs() < 0.02, "{free}");
    assert!((laden / exact - 1.0).abs() < 0.01, "{laden} {exact}");
}

#[test]
fn the_drag_of_air_takes_the_same_from_one_over_the_swing_in_every_period() {
    let drag_kg_per_m2 = 0.05;
    let mut problem = rod(Integrator::BdfAlpha { alpha: -0.49 }, 5e-4);
    problem.beyond.air_drag_kg_per_m2 = drag_kg_per_m2;
    let heights = release(&problem, force_for(0.1), 8.0 / FREQUENCY_HZ);
    let swings = extremes(&heights);
    let from = 3;
    let periods = 0.5 * (swings.len() - 1 - from) as f64;
    let growth = (1.0 / swings[swings.len() - 1] - 1.0 / swings[from]) / periods;
    // Of the lowest mode, 1 at the tip: Δ(1/a) = 8/3 · C ∫φ³ ds/(m ∫φ² ds).
    let (b, s) = (1.8751040687, 0.7340955138);
    let mode = |x: f64| {
        let (y, z) = (b * x, b * x);
        0.5 * (y.cosh() - y.cos() - s * (z.sinh() - z.sin()))
    };
    let integral = |power: i32| {
        (0..2000).map(|i| mode((f64::from(i) + 0.5) / 2000.0).powi(power)).sum::<f64>() / 2000.0
    };
    let exact = 8.0 / 3.0 * drag_kg_per_m2 * integral(3) / (MASS_KG_PER_M * integral(2));
    println!("growth of one over the swing {growth:.3} of {exact:.3} per metre and period");
    assert!((growth / exact - 1.0).abs() < 0.08, "{growth} {exact}");
}

#[test]
fn a_pulsating_flow_bends_as_its_pressure_does() {
    let (speed, pulse_ratio, beats_per_minute) = (0.173, 0.95, 72.0);
    let flow = Flow {
        density_kg_per_m3: 1060.0,
        coefficient: 22.0,
        width_m: 1.65e-3,
        velocity_m_per_s: Vector3::z() * speed,
        pulse_ratio,
        frequency_hz: beats_per_minute / 60.0,
        phase_rad: 0.0,
        lumen_radius_m: 0.0,
    };
    // A stiff light rod follows the flow at once.
    let mut problem = rod(Integrator::BdfAlpha { alpha: 0.0 }, 5e-3);
    problem.rod.sections[0].bending_n_m2 = 1e-2;
    problem.rod.sections[0].mass_kg_per_m = 1e-4;
    problem.beyond.flow = flow;
    let pressure = 0.5 * flow.density_kg_per_m3 * flow.width_m * flow.coefficient;
    let bend = |speed: f64| pressure * speed * speed * LENGTH_M.powi(4) / (8.0 * 1e-2);
    let mut simulation = Simulation::settled(&problem, AT).unwrap();
    // Half an edge at the guide bears no load, and the tip has half an edge more: within 2 %.
    let near = |found: f64, exact: f64| (found / exact - 1.0).abs() < 0.02;
    let mut heights = Vec::new();
    for k in 1..=167 {
        let z = simulation.step(5e-3, AT).unwrap().tip_m.z;
        let now =
            speed * (1.0 + pulse_ratio * (TAU * flow.frequency_hz * 5e-3 * f64::from(k)).sin());
        if now > 0.5 * speed {
            assert!(near(z, bend(now)), "step {k}: {z} {}", bend(now));
        }
        heights.push(z);
    }
    let [least, most] = [f64::min, f64::max].map(|of| heights.iter().copied().reduce(of).unwrap());
    println!("swings between {least:.2e} and {most:.2e} m at {beats_per_minute} beats a minute");
    assert!(near(most, bend(1.95 * speed)) && least.abs() < 0.01 * most);
}

#[test]
fn a_flow_is_slower_near_the_wall() {
    let mut problem = rod(Integrator::BdfAlpha { alpha: 0.0 }, 5e-3);
    problem.rod.sections[0].bending_n_m2 = 1e-2;
    problem.beyond.flow = Flow {
        density_kg_per_m3: 1060.0,
        coefficient: 1.0,
        width_m: 1.65e-3,
        velocity_m_per_s: Vector3::z() * 0.2,
        lumen_radius_m: 0.01,
        ..Flow::default()
    };
    let tip = |radius_m: f64| {
        let mut problem = problem.clone();
        let tube = TubePath::from(Vector3::zeros(), Vector3::x(), radius_m).straight(0.2, radius_m);
        problem.lumen = Lumen::tube(tube.tube());
        Simulation::settled(&problem, AT).unwrap().sample().tip_m.z
    };
    // On the axis of a tube of half the profile's radius, x (2 − x) is 3/4, and the force its square.
    let ratio = tip(5e-3) / tip(10e-3);
    assert!((ratio - 0.5625).abs() < 0.005, "{ratio}");
}
