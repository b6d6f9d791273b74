//! A snap that is provoked on purpose is flagged in the tick in which it happens.

use core::f64::consts::PI;

use cathforce_mechanics::*;

use crate::rod::rod;
use crate::wall::norm;
use crate::{Chain, both, curved, floor, pair, with};

const LENGTH_M: f64 = 0.08;
const STIFFNESS: f64 = 5e-5;
/// Ticks of steady feeding at 13 mm/s before it.
const FED: i32 = 200;
const FEED_M: f64 = 13e-6;
const FLOOR_M: f64 = -1e-3;

/// As a device would run it.
fn device(mut description: Description<f64>) -> Description<f64> {
    description.instrument.sections[0].mass_kg_per_m = 1.5e-3;
    description.wall.friction_coefficient = 0.3;
    description.wall.damping_s = 5e-3;
    let solver = &mut description.solver;
    (solver.tick_s, solver.predictor_gain) = (1e-3, 0.12);
    solver.drag = Drag { at_rest_n_s_per_m2: 0.155, swift_n_s_per_m2: 1.55, swift_m_per_s: 0.08 };
    description
}

/// A catheter with its tip bent down.
fn bent_down() -> Description<f64> {
    let mut catheter = device(rod(LENGTH_M, 40, STIFFNESS));
    catheter.instrument.precurve.push(curved(0.02, -60.0, 0.0)).unwrap();
    catheter
}

/// A bent tip slides on a floor, which is gone from one tick to the next, and stands there again when the
/// tip has fallen through it by half a millimetre: its force is lost and comes back at once. The tick in
/// which half of it does is to be flagged; those of steady feeding are resolved, so that it is not the
/// flag that is stuck. Points are looked up in turn: with one tick more before it, others see it first.
///
/// In that tick the end of the tip moves by 0.2 to 0.3 mm, most of it a turn of its last links of 2 mm:
/// tens of milliradians, where 5 are no longer resolved.
fn let_go_and_caught(description: Description<f64>, guidewire_m: f64) {
    for more in [0, 1] {
        let (model, mut state) = (Chain::new(description.clone()).unwrap(), State::new());
        let (high, low) = (floor(FLOOR_M), floor(-5e-3));
        let mut ticks = 0;
        let mut drives = || {
            ticks += 1;
            let fed_m = FEED_M * f64::from(ticks);
            both(LENGTH_M - 0.01 + fed_m, guidewire_m + fed_m)
        };
        let start = drives();
        while !settle(&model, &high.lumen(), &mut state, start) {}
        let mut pressed_n = 0.0;
        for tick in 0..FED + more {
            let found = step(&model, &high.lumen(), &mut state, drives());
            assert!(tick < 50 || !found.unresolved, "tick {tick}: {found:?}");
            pressed_n = norm(found.force_on_vessel_n);
        }
        assert!(pressed_n > 3e-3, "it presses by {pressed_n} N only");
        // At once, or where the points next to the tip are those that see it, in the next tick.
        let lost = (0..2).find_map(|_| {
            let found = step(&model, &low.lumen(), &mut state, drives());
            (norm(found.force_on_vessel_n) < 0.5 * pressed_n).then_some(found)
        });
        let lost = lost.expect("it is let go");
        println!("{pressed_n:.4} N, then {:.4} N", norm(lost.force_on_vessel_n));
        assert!(lost.unresolved, "let go: {lost:?}");
        let height_m = |state: &State<f64>| state.node_position_m(0).map_or(0.0, |[_, _, z]| z);
        let lying_m = FLOOR_M + 0.8e-3;
        while height_m(&state) > lying_m - 0.5e-3 {
            step(&model, &low.lumen(), &mut state, drives());
        }
        let caught = (0..2).find_map(|_| {
            let found = step(&model, &high.lumen(), &mut state, drives());
            (norm(found.force_on_vessel_n) > 0.5 * pressed_n).then_some(found)
        });
        let caught = caught.expect("it is caught");
        println!("caught by {:.4} N", norm(caught.force_on_vessel_n));
        assert!(caught.unresolved, "caught: {caught:?}");
    }
}

#[test]
fn a_snap_is_flagged_in_its_tick() {
    let_go_and_caught(bent_down(), 0.0);
}

#[test]
fn a_snap_with_a_guidewire_is_flagged_in_its_tick() {
    let mut pair = device(pair(LENGTH_M, 40, [STIFFNESS, 2e-5]));
    pair.instrument.precurve.push(curved(0.02, -60.0, 0.0)).unwrap();
    pair.guidewire.as_mut().unwrap().outer_radius_m = 0.4e-3;
    // Its tip behind the catheter's, and before it.
    for guidewire_m in [LENGTH_M - 0.03, LENGTH_M - 0.005] {
        let_go_and_caught(pair.clone(), guidewire_m);
    }
}

#[test]
fn a_snap_of_a_tip_that_a_tendon_bends_is_flagged_in_its_tick() {
    let tendon = [
        ("tendon.pull_m", 1.8e-3),
        ("tendon.stiffness_n_per_m", 5e3),
        ("tendon.offset_m", 0.6e-3),
        ("tendon.length_m", 0.02),
        ("tendon.angle_rad", PI),
        ("effects.tendon.friction.coefficient", 0.2),
    ];
    let_go_and_caught(with(device(rod(LENGTH_M, 40, STIFFNESS)), &tendon), 0.0);
}

#[test]
fn a_snap_with_effects_is_flagged_in_its_tick() {
    let effects = [
        ("effects.wall.viscoelastic.ratio", 0.5),
        ("effects.wall.hyperelastic.strain_per_m", 200.0),
        ("effects.wall.registration.z_m", 1e-4),
        ("effects.wall.motion.y_m", 1e-4),
        ("effects.contact.stribeck.static_ratio", 1.4),
        ("effects.contact.load_friction.high_load_ratio", 0.7),
        ("effects.instrument.softening.share", 0.2),
        ("effects.instrument.torsional_windup.free_length_m", 0.3),
        ("effects.fluid.drag.along_n_per_m", 0.01),
    ];
    let_go_and_caught(with(bent_down(), &effects), 0.0);
}
