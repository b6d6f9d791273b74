//! Forces and torques at the two drives.

use cathforce_mechanics::*;

use crate::pair::{CATHETER_EI, Chain, WIRE_EI, at, curved, pair};
use crate::rod::{FREE_TIP, free_space, rest};
use crate::wall::{StoredWall, plane, tube};

const LENGTH_M: f64 = 0.1;
/// Stiffness against deviations of the two shapes from each other: both in series.
const SERIES_EI: f64 = CATHETER_EI * WIRE_EI / (CATHETER_EI + WIRE_EI);

fn at_rest(description: Description<f64>, drives: Drives<f64>) -> Outputs<f64> {
    let (model, wall, mut state) = (Chain::new(description).unwrap(), free_space(), State::new());
    rest(&model, &wall.lumen(), &mut state, drives, &FREE_TIP)
}

#[test]
fn a_straight_guidewire_is_pushed_out_of_a_curved_catheter() {
    // Over the overlap both have the energy ½ EI₁EI₂/(EI₁+EI₂) κ² a length; its slope is what
    // the wire's drive holds against. Fed together, the whole gets −½ (EI₁+EI₂) κ²_both.
    let curvature = 14.0;
    let mut pair = pair(LENGTH_M, 32);
    pair.instrument.precurve.push(curved(0.2, curvature)).unwrap();
    let stored_n = 0.5 * SERIES_EI * curvature * curvature;
    let both = CATHETER_EI + WIRE_EI;
    let mouth_n = -0.5 * both * (CATHETER_EI * curvature / both).powi(2);
    for wire_m in [0.02, 0.0613, 0.0988] {
        let found = at_rest(pair.clone(), at(LENGTH_M, wire_m));
        let (wire_n, whole_n) =
            (found.guidewire_force_n, found.guidewire_force_n + found.drive_force_n);
        println!("{wire_m} m: {wire_n:.6} N ({stored_n:.6}), both {whole_n:.6} N ({mouth_n:.6})");
        assert!((wire_n / stored_n - 1.0).abs() < 1e-4, "{wire_n} N, not {stored_n} N");
        assert!((whole_n / mouth_n - 1.0).abs() < 1e-4, "{whole_n} N, not {mouth_n} N");
    }
}

#[test]
fn with_both_in_the_guide_every_force_is_a_number() {
    // What the guide keeps straight would leave it: the energy of a length of the coming curve.
    let mut pair = pair(LENGTH_M, 32);
    pair.instrument.precurve.push(curved(0.2, 14.0)).unwrap();
    let (model, wall, mut state) = (Chain::new(pair).unwrap(), free_space(), State::new());
    let drives = at(0.0, 0.0);
    for _ in 0..3 {
        let found = step(&model, &wall.lumen(), &mut state, drives);
        assert!(!found.lost && !found.unresolved, "{found:?}");
        assert_eq!((found.links, found.force_on_vessel_n), (0, [0.0; 3]));
    }
    let out = step(&model, &wall.lumen(), &mut state, at(1e-4, 0.0));
    assert!(!out.lost && out.links == 1, "{out:?}");
}

#[test]
fn a_curved_guidewire_in_the_guide_costs_nothing_to_hold() {
    // A straight catheter of near-rigid stiffness keeps the wire as straight as the guide does.
    let mut pair = pair(LENGTH_M, 32);
    for section in &mut pair.instrument.sections {
        section.bending_stiffness_n_m2 = 1.0;
    }
    pair.guidewire.as_mut().unwrap().precurve.push(curved(0.2, 40.0)).unwrap();
    let found = at_rest(pair, at(LENGTH_M, 0.07)).guidewire_force_n;
    assert!(found.abs() < 1e-3 * 0.5 * WIRE_EI * 1600.0, "{found} N");
}

#[test]
fn turning_one_in_the_other_takes_opposite_torques() {
    // d/dρ of ½ EI₁EI₂/(EI₁+EI₂) |κ₁ − R(ρ)κ₂|² over the overlap, from the first joint's cell on.
    let (catheter, wire) = (9.0, 16.0);
    let mut pair = pair(LENGTH_M, 32);
    pair.instrument.precurve.push(curved(0.2, catheter)).unwrap();
    pair.guidewire.as_mut().unwrap().precurve.push(curved(0.2, wire)).unwrap();
    for roll in [0.4_f64, 1.5, 2.6, -1.0] {
        let mut drives = at(LENGTH_M, 0.08);
        drives.guidewire.rotation_rad = roll;
        let found = at_rest(pair.clone(), drives);
        let exact = SERIES_EI * 0.08 * catheter * wire * roll.sin();
        let (first, second) = (found.guidewire_torque_n_m, found.drive_torque_n_m);
        println!("roll {roll}: {first:.6}, {second:.6} N·m ({exact:.6})");
        assert!((first / exact - 1.0).abs() < 2e-3, "{first} N·m, not {exact} N·m");
        assert!((second + first).abs() < 1e-3 * exact.abs(), "{first} and {second} N·m");
    }
}

#[test]
fn around_a_closed_path_without_friction_the_drives_do_no_work() {
    // A curved tube of hard wall and two instruments that it bends: work goes in and comes back
    // whatever the order in which they move.
    let (radius_m, clearance_m) = (0.06, 1.5e-3);
    let bounds = [[-0.01, -0.01, -6e-3], [0.08, 0.08, 6e-3]];
    let wall = StoredWall::sampled(bounds, 1e-3, 3e-3, |p| {
        let from = [p[0], p[1] - radius_m];
        let scale = radius_m / f64::hypot(from[0], from[1]).max(1e-9);
        tube(p, [from[0] * scale, radius_m + from[1] * scale, 0.0], clearance_m + 0.8e-3)
    });
    let mut pair = pair(0.1, 60);
    pair.wall.line_stiffness_n_per_m2 = 1e5;
    pair.wall.end_stiffness_n_per_m = 100.0;
    pair.wall.damping_s = 5e-3;
    (pair.solver.tick_s, pair.solver.drag) = (1e-3, Drag::constant(2.0));
    let (model, lumen, mut state) = (Chain::new(pair).unwrap(), wall.lumen(), State::new());
    let corners = [
        (0.03, 0.04),
        (0.03, 0.07),
        (0.05, 0.07),
        (0.08, 0.07),
        (0.08, 0.05),
        (0.03, 0.05),
        (0.03, 0.04),
    ];
    let start = at(corners[0].0, corners[0].1);
    while !settle(&model, &lumen, &mut state, start) {}
    let mut last = step(&model, &lumen, &mut state, start);
    let (mut work, mut most) = ([0.0_f64; 2], 0.0_f64);
    for ((c0, w0), (c1, w1)) in corners.iter().zip(&corners[1..]) {
        let steps = 3000;
        for i in 1..=steps {
            let share = f64::from(i) / f64::from(steps);
            let now = step(
                &model,
                &lumen,
                &mut state,
                at(c0 + (c1 - c0) * share, w0 + (w1 - w0) * share),
            );
            work[0] +=
                0.5 * (last.drive_force_n + now.drive_force_n) * (c1 - c0) / f64::from(steps);
            work[1] += 0.5 * (last.guidewire_force_n + now.guidewire_force_n) * (w1 - w0)
                / f64::from(steps);
            most = most.max(work[0] + work[1]);
            last = now;
        }
    }
    let left = work[0] + work[1];
    println!(
        "work of catheter {:.3e}, of wire {:.3e}, left {left:.3e}, at most {most:.3e} J",
        work[0], work[1]
    );
    assert!(most > 5e-4 && left.abs() < 0.01 * most, "{left} J left of {most} J");
}

#[test]
fn each_drive_pushes_against_the_friction_of_what_it_moves() {
    // Both lie on a flat wall by their weight: the catheter on its length, the wire beyond.
    let mass = 0.01;
    let mut pair = pair(LENGTH_M, 50);
    let wire = pair.guidewire.as_mut().unwrap();
    wire.outer_radius_m = pair.instrument.outer_radius_m;
    for section in wire.sections.iter_mut().chain(&mut pair.instrument.sections) {
        section.mass_kg_per_m = mass;
        section.bending_stiffness_n_m2 = 1e-6;
        section.torsional_stiffness_n_m2 = 1e-6;
    }
    pair.gravity_m_per_s2 = [0.0, 0.0, -9.81];
    pair.wall.friction_coefficient = 0.3;
    pair.wall.damping_s = 5e-3;
    pair.solver.tick_s = 1e-3;
    pair.solver.drag = Drag::constant(0.05);
    // As far below the guide's as the onset of the normal force holds them up.
    let floor = [0.0, 0.0, -pair.instrument.outer_radius_m - 3e-6];
    let bounds = [[-0.01, -0.01, -6e-3], [0.12, 0.01, 6e-3]];
    let wall = StoredWall::sampled(bounds, 1e-3, 4e-3, |p| plane(p, floor, [0.0, 0.0, 1.0]));
    let (model, lumen, mut state) = (Chain::new(pair).unwrap(), wall.lumen(), State::new());
    let (catheter_m, wire_m) = (0.04, 0.09);
    while !settle(&model, &lumen, &mut state, at(catheter_m, wire_m)) {}
    // In turn each is fed by 1 mm; the friction of the last ticks is that of sliding.
    let mut feed = |from: (f64, f64), by: (f64, f64)| {
        let mut found = Outputs::default();
        for i in 1..=400 {
            let share = f64::from(i) / 400.0;
            let drives = at(from.0 + by.0 * share, from.1 + by.1 * share);
            found = step(&model, &lumen, &mut state, drives);
        }
        found
    };
    let per_m = 0.3 * mass * 9.81;
    let wire_fed = feed((catheter_m, wire_m), (0.0, 1e-3));
    // What lies on the wall at the catheter's length carries both.
    let bare = per_m * (wire_m - catheter_m);
    println!("wire fed: {} N ({bare})", wire_fed.guidewire_force_n);
    assert!((wire_fed.guidewire_force_n / bare - 1.0).abs() < 0.1, "{wire_fed:?}");
    let catheter_fed = feed((catheter_m, wire_m + 1e-3), (1e-3, 0.0));
    let covered = 2.0 * per_m * catheter_m;
    println!("catheter fed: {} N ({covered})", catheter_fed.drive_force_n);
    assert!((catheter_fed.drive_force_n / covered - 1.0).abs() < 0.1, "{catheter_fed:?}");
}
