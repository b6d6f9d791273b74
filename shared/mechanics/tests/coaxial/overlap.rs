//! Stiffness and pre-curvature of two instruments on one centre line.

use cathforce_mechanics::*;

use crate::pair::{CATHETER_EI, Chain, WIRE_EI, at, curved, pair};
use crate::rod::{FREE_TIP, assert_second_order, free_space, inserted, rest};

const LENGTH_M: f64 = 0.1;

/// Tip and outputs at rest, far from any wall.
fn hang(
    description: Description<f64>,
    drives: Drives<f64>,
    loads: &Loads<f64>,
) -> ([f64; 3], Outputs<f64>) {
    let (model, wall, mut state) = (Chain::new(description).unwrap(), free_space(), State::new());
    let outputs = rest(&model, &wall.lumen(), &mut state, drives, loads);
    (state.node_position_m(0).unwrap(), outputs)
}

#[test]
fn a_cantilever_is_stiff_as_both_where_they_overlap() {
    // w = P ∫x²/EI dx from the loaded end, for small loads.
    let force_n = 1e-3;
    let loads = Loads { tip_force_n: [0.0, 0.0, -force_n], ..FREE_TIP };
    let both = CATHETER_EI + WIRE_EI;
    for (behind_m, alone) in [(0.0371, CATHETER_EI), (0.0234, CATHETER_EI), (0.0371, WIRE_EI)] {
        let drives = if alone == CATHETER_EI {
            at(LENGTH_M, LENGTH_M - behind_m)
        } else {
            at(LENGTH_M - behind_m, LENGTH_M)
        };
        let exact_m = force_n / 3.0
            * (LENGTH_M.powi(3) / both + behind_m.powi(3) * (1.0 / alone - 1.0 / both));
        let errors = [8, 16, 32].map(|links| {
            let (tip, _) = hang(pair(LENGTH_M, links), drives, &loads);
            (-tip[2] / exact_m - 1.0).abs()
        });
        assert_second_order(errors, &format!("{behind_m} m of {alone} N·m² alone"));
        assert!(errors[2] < 1e-3, "{errors:?}");
    }
}

#[test]
fn pre_curvatures_meet_where_their_moments_cancel() {
    // (k₁κ₁ + k₂ R(ρ) κ₂)/(k₁ + k₂) of concentric tubes; then the centre line is a circle.
    let (catheter, wire) = (12.0, 20.0);
    let both = CATHETER_EI + WIRE_EI;
    for roll in [0.0_f64, 0.7, 1.9, core::f64::consts::PI, -2.5] {
        let mut pair = pair(LENGTH_M, 32);
        pair.instrument.precurve.push(curved(0.2, catheter)).unwrap();
        pair.guidewire.as_mut().unwrap().precurve.push(curved(0.2, wire)).unwrap();
        let mut drives = at(LENGTH_M, LENGTH_M);
        drives.guidewire.rotation_rad = roll;
        // Towards `up`, which is z, and towards `direction × up`, which is −y.
        let up = (CATHETER_EI * catheter + WIRE_EI * wire * roll.cos()) / both;
        let side = WIRE_EI * wire * roll.sin() / both;
        let curvature = f64::hypot(up, side);
        let turn = curvature * LENGTH_M;
        let across = (1.0 - turn.cos()) / (curvature * curvature);
        let exact = [turn.sin() / curvature, -side * across, up * across];
        let (tip, _) = hang(pair, drives, &FREE_TIP);
        let error = (0..3).map(|i| (tip[i] - exact[i]).powi(2)).sum::<f64>().sqrt() / LENGTH_M;
        println!("roll {roll}: {curvature:.3} 1/m, error {error:.1e} of the length");
        assert!(error < 5e-4, "roll {roll}: tip {tip:?}, exact {exact:?}");
    }
}

#[test]
fn opposed_pre_curvatures_of_equal_moment_cancel() {
    let mut pair = pair(LENGTH_M, 32);
    pair.instrument.precurve.push(curved(0.2, 15.0)).unwrap();
    let opposed = -15.0 * CATHETER_EI / WIRE_EI;
    pair.guidewire.as_mut().unwrap().precurve.push(curved(0.2, opposed)).unwrap();
    let (tip, _) = hang(pair, at(LENGTH_M, LENGTH_M), &FREE_TIP);
    assert!((tip[0] - LENGTH_M).abs() < 1e-9 && tip[2].abs() < 1e-9, "{tip:?}");
}

#[test]
fn a_chain_turns_with_the_instruments_in_it() {
    // Both turned by the same angle turn the shape; so does the wire alone, alone in the vessel.
    let curved_wire = |pair: &mut Description<f64>| {
        let wire = pair.guidewire.as_mut().unwrap();
        wire.precurve.push(curved(0.05, 20.0)).unwrap();
    };
    let mut pair = pair(LENGTH_M, 32);
    curved_wire(&mut pair);
    for catheter_m in [LENGTH_M, 0.0] {
        let roll = 0.8;
        let mut drives = at(catheter_m, LENGTH_M);
        let (straight, _) = hang(pair.clone(), drives, &FREE_TIP);
        drives.guidewire.rotation_rad = roll;
        if catheter_m > 0.0 {
            drives.catheter.rotation_rad = roll;
        }
        let (tip, _) = hang(pair.clone(), drives, &FREE_TIP);
        let across = straight[2];
        let exact = [straight[0], -across * roll.sin(), across * roll.cos()];
        for i in 0..3 {
            assert!((tip[i] - exact[i]).abs() < 1e-6 * LENGTH_M, "{tip:?}, not {exact:?}");
        }
    }
}

#[test]
fn a_guidewire_that_is_outside_changes_no_bit() {
    let mut with = pair(0.08, 40);
    with.instrument.precurve.push(curved(0.02, 60.0)).unwrap();
    with.gravity_m_per_s2 = [0.0, 0.0, -9.81];
    with.wall.friction_coefficient = 0.3;
    with.solver.tick_s = 1e-3;
    with.solver.drag = Drag::constant(2.0);
    with.solver.predictor_gain = 0.1;
    let without = Description { guidewire: None, ..with.clone() };
    let bounds = [[-0.01, -0.02, -0.02], [0.1, 0.02, 0.02]];
    let wall = crate::wall::StoredWall::sampled(bounds, 1e-3, 3e-3, |p| {
        crate::wall::tube(p, [p[0], 0.0, 0.0], 3e-3)
    });
    let found = [with, without].map(|description| {
        let (model, mut state) = (Chain::new(description).unwrap(), State::new());
        (0..400)
            .map(|tick| {
                let t = f64::from(tick);
                let drive = Drive { insertion_m: 0.03 + 1e-4 * t, rotation_rad: 2e-3 * t };
                step(&model, &wall.lumen(), &mut state, drive)
            })
            .collect::<Vec<_>>()
    });
    assert!(found[0].iter().any(|o| o.peak_contact_force_n > 1e-3), "the wall is never felt");
    assert!(found[0] == found[1]);
}

#[test]
fn a_guidewire_withdrawn_and_advanced_again_leaves_the_shape_it_found() {
    let mut pair = pair(LENGTH_M, 32);
    pair.instrument.precurve.push(curved(0.03, 50.0)).unwrap();
    pair.guidewire.as_mut().unwrap().precurve.push(curved(0.01, -30.0)).unwrap();
    pair.solver.drag = Drag::constant(0.1);
    let (model, wall, mut state) = (Chain::new(pair).unwrap(), free_space(), State::new());
    let lumen = wall.lumen();
    // From a length past the catheter's tip to 30 mm behind it, by 20 µm a step, and back.
    let way = |step: i32| 0.099 - 2e-5 * f64::from(step.min(3400 - step));
    rest(&model, &lumen, &mut state, at(0.08, way(0)), &FREE_TIP);
    let start = state.node_position_m(0).unwrap();
    let (mut tip, mut largest, mut farthest) = (start, 0.0_f64, 0.0_f64);
    for i in 1..=3400 {
        let outputs = step(&model, &lumen, &mut state, at(0.08, way(i)));
        assert!(!outputs.unresolved, "step {i}");
        let now = state.node_position_m(0).unwrap();
        let distance =
            |from: [f64; 3]| (0..3).map(|k| (now[k] - from[k]).powi(2)).sum::<f64>().sqrt();
        (largest, farthest) = (largest.max(distance(tip)), farthest.max(distance(start)));
        tip = now;
    }
    println!("largest step {largest:.2e} m, farthest {farthest:.2e} m");
    assert!(farthest > 0.01 && largest < 1e-4, "{largest} m a step, {farthest} m in all");
    rest(&model, &lumen, &mut state, at(0.08, way(0)), &FREE_TIP);
    let end = state.node_position_m(0).unwrap();
    assert!((0..3).all(|i| (end[i] - start[i]).abs() < 1e-7), "{end:?}, not {start:?}");
}

#[test]
fn a_single_instrument_s_pre_curve_pulls_at_the_drive_as_it_leaves_the_mouth() {
    // Free to bend past the mouth, each length gives back what kept it straight: −EI κ₀²/2.
    let mut rod = crate::rod::rod(LENGTH_M, 32, CATHETER_EI);
    rod.instrument.precurve.push(curved(0.05, 20.0)).unwrap();
    for (insertion_m, expected_n) in [(0.03, -0.5 * CATHETER_EI * 400.0), (0.07, 0.0)] {
        let (_, outputs) = hang(rod.clone(), inserted(insertion_m).into(), &FREE_TIP);
        let found = outputs.drive_force_n;
        assert!((found - expected_n).abs() < 1e-6, "{found} N, not {expected_n} N");
    }
}
