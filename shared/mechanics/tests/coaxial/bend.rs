//! Guidewire and catheter through a bend, one after the other.

use cathforce_mechanics::*;

use crate::pair::{Chain, at, curved, pair};
use crate::wall::{StoredWall, tube};

/// A tube of 3 mm radius: 40 mm straight, then a bend of 90° and 30 mm radius, then straight.
fn bent_tube() -> StoredWall {
    let (straight, bend) = (0.04, 0.03);
    let bounds = [[-0.01, -0.01, -0.01], [0.09, 0.12, 0.01]];
    StoredWall::sampled(bounds, 1e-3, 2e-3, |p| {
        let nearest = if p[0] < straight {
            [p[0], 0.0, 0.0]
        } else if p[1] > bend {
            [straight + bend, p[1], 0.0]
        } else {
            let from = [p[0] - straight, p[1] - bend];
            let scale = bend / f64::hypot(from[0], from[1]).max(1e-9);
            [straight + from[0] * scale, bend + from[1] * scale, 0.0]
        };
        tube(p, nearest, 3e-3)
    })
}

#[test]
fn a_catheter_follows_its_guidewire_round_a_bend_and_back() {
    let mut pair = pair(0.14, 64);
    let wire = pair.guidewire.as_mut().unwrap();
    for section in &mut wire.sections {
        section.bending_stiffness_n_m2 = 3e-6;
        section.torsional_stiffness_n_m2 = 2e-6;
        section.axial_stiffness_n = 5e3;
    }
    wire.precurve.push(curved(0.008, 120.0)).unwrap();
    for section in &mut pair.instrument.sections {
        section.bending_stiffness_n_m2 = 1e-5;
        section.torsional_stiffness_n_m2 = 7e-6;
        section.axial_stiffness_n = 50.0;
    }
    pair.gravity_m_per_s2 = [0.0, 0.0, -9.81];
    pair.wall.friction_coefficient = 0.2;
    pair.wall.damping_s = 5e-3;
    let solver = &mut pair.solver;
    (solver.tick_s, solver.predictor_gain, solver.drag) = (1e-3, 0.1, Drag::constant(2.0));
    let wall = bent_tube();
    let (model, lumen, mut state) = (Chain::new(pair).unwrap(), wall.lumen(), State::new());
    // Wire ahead, catheter over it and past it, wire on, all back: at 20 mm/s.
    let way = [
        (0.03, 0.03),
        (0.03, 0.11),
        (0.10, 0.11),
        (0.125, 0.11),
        (0.125, 0.135),
        (0.06, 0.135),
        (0.06, 0.02),
        (0.03, 0.03),
    ];
    while !settle(&model, &lumen, &mut state, at(way[0].0, way[0].1)) {}
    let (mut ticks, mut unresolved, mut most_j, mut most_n) = (0, 0, 0.0_f64, 0.0_f64);
    for (from, to) in way.iter().zip(&way[1..]) {
        let length = f64::max((to.0 - from.0).abs(), (to.1 - from.1).abs());
        let steps = (length / 2e-5).round() as i32;
        let before = ticks;
        for i in 1..=steps {
            let share = f64::from(i) / f64::from(steps);
            let mut drives = at(from.0 + (to.0 - from.0) * share, from.1 + (to.1 - from.1) * share);
            drives.guidewire.rotation_rad = 1e-3 * f64::from(before + i);
            let found = step(&model, &lumen, &mut state, drives);
            ticks += 1;
            unresolved += i32::from(found.unresolved);
            let energy = state.elastic_energy_j(&model) + state.kinetic_energy_j(&model);
            most_j = most_j.max(energy);
            most_n = most_n.max(found.peak_contact_force_n);
            assert!(energy.is_finite() && !found.lost, "tick {ticks}: {found:?}");
        }
        println!(
            "to {to:?}: {unresolved} of {ticks} ticks unresolved, {most_j:.2e} J, {most_n:.3} N"
        );
    }
    // Both bent by the tube's curvature over a quarter of a circle: ½ EI κ² ℓ = 0.34 mJ; the
    // straightened tip of the wire 0.17 mJ.
    assert!(most_j < 1.5e-3, "{most_j} J");
    assert!(most_n < 1.0, "{most_n} N");
    assert!(unresolved * 50 < ticks, "{unresolved} of {ticks} ticks are unresolved");
}
