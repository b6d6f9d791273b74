//! Loads on the drives: weight of a sliding instrument, and energy of bending and twist.

use cathforce_mechanics::*;

use crate::rod::{FREE_TIP, free_space, hang, inserted, rest, rod};
use crate::{Chain, assert_near, both, curved, pair, with};

const LENGTH_M: f64 = 0.1;
const LINKS: usize = 40;
const G: f64 = 9.81;

/// docs/explanation/model.md (26)
///
/// An instrument that is fed by ds in a straight, vertical catheter lifts its whole length by ds, so its
/// drive carries m g L. Segments and masses do not depend on the links, and nothing bends. A tolerance of
/// 10⁻⁶ covers stretch (m g/EA, 10⁻⁹) and rounding. Without the term, the follower would carry nothing.
#[test]
fn in_an_upright_guide_the_drive_of_what_slides_carries_its_weight() {
    let (catheter_kg_per_m, wire_kg_per_m) = (3e-3, 2e-3);
    for upwards in [1.0, -1.0] {
        let mut pair = pair(LENGTH_M, LINKS, [1e-2, 1e-5]);
        pair.instrument.sections[0].mass_kg_per_m = catheter_kg_per_m;
        pair.guidewire.as_mut().unwrap().sections[0].mass_kg_per_m = wire_kg_per_m;
        // Not at the origin, because only the height above the mouth matters.
        pair.entry = Entry {
            position_m: [0.02, -0.03, 0.05],
            direction: [0.0, 0.0, upwards],
            up: [1.0, 0.0, 0.0],
        };
        pair.gravity_m_per_s2 = [0.0, 0.0, -G];
        // Insertions of both, and the instrument that follows.
        for (catheter_m, wire_m) in [(LENGTH_M, 0.0613), (LENGTH_M, 0.02), (0.0437, LENGTH_M)] {
            let (model, wall, mut state) =
                (Chain::new(pair.clone()).unwrap(), free_space(), State::new());
            let drives = both(catheter_m, wire_m);
            let found = rest(&model, &wall.lumen(), &mut state, drives, &FREE_TIP);
            let follows = catheter_m > wire_m;
            let (follower_n, kg) = if follows {
                (found.guidewire_force_n, wire_kg_per_m * wire_m)
            } else {
                (found.drive_force_n, catheter_kg_per_m * catheter_m)
            };
            let what = format!("upwards {upwards}, catheter {catheter_m} m, wire {wire_m} m");
            assert_near(&what, follower_n, upwards * kg * G, 1e-6);
            // The other drive carries the rest. Half of the link at the mouth hangs on the guide.
            let whole_n = found.guidewire_force_n + found.drive_force_n;
            let all_kg = catheter_kg_per_m * catheter_m + wire_kg_per_m * wire_m;
            let at_mouth_kg = (catheter_kg_per_m + wire_kg_per_m) * 0.5 * LENGTH_M / LINKS as f64;
            assert_near("both", whole_n, upwards * (all_kg - at_mouth_kg) * G, 1e-6);
        }
    }
}

/// docs/explanation/model.md (23), the part ½ G J κ_t²
///
/// A rod that is twisted by a dead torque T stores T²/2GJ per length. During a feed ds the torque does the
/// work T²/GJ ds, so the drive gains the difference. The guide stores ½ G J κ₀² per length of a rod with
/// unloaded twist κ₀. Straight links twist evenly, so the result is exact up to rounding.
#[test]
fn a_twisted_rod_draws_at_the_drive_by_the_energy_of_its_twist() {
    let gj = 0.7e-4;
    for (torque_n_m, torsion_per_m) in [(1e-3, 0.0), (-1e-3, 0.0), (0.0, 9.0), (4e-4, 9.0)] {
        let mut rod = rod(LENGTH_M, LINKS, 1e-4);
        let twisted = PrecurvePiece {
            length_m: 0.5,
            curvature_per_m: 0.0,
            lateral_curvature_per_m: 0.0,
            torsion_per_m,
        };
        rod.instrument.precurve.push(twisted).unwrap();
        let loads = Loads { tip_moment_n_m: [torque_n_m, 0.0, 0.0], ..FREE_TIP };
        let (_, outputs) = hang(rod, &loads);
        let twist_per_m = torsion_per_m + torque_n_m / gj;
        let what = format!("{torque_n_m} N·m, {torsion_per_m} rad/m");
        assert_near(&what, outputs.drive_force_n, -0.5 * gj * twist_per_m * twist_per_m, 1e-6);
        assert!((outputs.drive_torque_n_m + torque_n_m).abs() < 1e-9, "{what}: {outputs:?}");
    }
}

/// docs/explanation/model.md (23)
///
/// While the tip is within a guide that reaches into the vessel, nothing bends past the mouth, and there is
/// no force whatever the pre-curvature. Past the mouth the force is −½ EI κ₀².
#[test]
fn a_curved_tip_within_a_longer_guide_draws_at_nothing() {
    let (ei, per_m, guide_m) = (1e-5, 80.0, 0.03);
    let mut rod = rod(LENGTH_M, LINKS, ei);
    rod.instrument.precurve.push(curved(0.5, per_m, 0.0)).unwrap();
    let model = Chain::new(with(rod, &[("effects.entry.guide.length_m", guide_m)])).unwrap();
    let wall = free_space();
    let held_n = |inserted_m: f64| {
        let mut state = State::new();
        while !settle(&model, &wall.lumen(), &mut state, inserted(inserted_m)) {}
        step(&model, &wall.lumen(), &mut state, inserted(inserted_m)).drive_force_n
    };
    assert_eq!(held_n(0.2 * guide_m), 0.0);
    assert_near("out of it", held_n(2.0 * guide_m), -0.5 * ei * per_m * per_m, 1e-3);
}

/// docs/explanation/model.md (23), (29)
///
/// A tendon that bends an instrument pulls it in like a pre-curvature: with the curvature κ at the mouth,
/// by −½ EI κ². κ is computed from the tip, with an error of half a cell of forty.
#[test]
fn what_a_tendon_bends_at_the_mouth_draws_at_the_drive() {
    let ei = 1e-5;
    let bent = with(
        rod(LENGTH_M, LINKS, ei),
        &[
            ("tendon.pull_m", 1.2e-3),
            ("tendon.stiffness_n_per_m", 400.0),
            ("tendon.offset_m", 0.5e-3),
            ("tendon.length_m", 2.0 * LENGTH_M),
        ],
    );
    let (tip, outputs) = hang(bent, &FREE_TIP);
    // The chain is an arc, so its curvature follows from the height of the tip.
    let per_m = 2.0 * tip[2] / (tip[0] * tip[0] + tip[2] * tip[2]);
    assert!(per_m > 5.0, "{per_m}");
    assert_near("drive", outputs.drive_force_n, -0.5 * ei * per_m * per_m, 0.06);
}

/// docs/explanation/model.md (27)
///
/// The flow pulls each of two instruments by the part of its surface that is exposed to it.
#[test]
fn a_stream_draws_each_instrument_by_what_of_it_lies_in_the_stream() {
    let along_n_per_m = 0.2;
    let streaming = with(
        pair(LENGTH_M, LINKS, [1e-3, 1e-3]),
        &[("effects.fluid.drag.along_n_per_m", along_n_per_m)],
    );
    let (model, wall, mut state) = (Chain::new(streaming).unwrap(), free_space(), State::new());
    let (catheter_m, wire_m) = (0.09, LENGTH_M);
    let found = rest(&model, &wall.lumen(), &mut state, both(catheter_m, wire_m), &FREE_TIP);
    // The guide carries half of the link at the mouth. Two nodes carry the end of the catheter.
    let at_mouth_m = 0.5 * LENGTH_M / LINKS as f64;
    assert_near("catheter", found.drive_force_n, -along_n_per_m * (catheter_m - at_mouth_m), 0.03);
    assert_near("wire", found.guidewire_force_n, -along_n_per_m * (wire_m - catheter_m), 0.15);
}

/// docs/explanation/model.md (46)
///
/// The introducer's friction acts whether or not the tip has left a longer guide.
#[test]
fn an_introducer_rubs_while_the_tip_is_within_the_guide() {
    let rubbing = with(
        rod(LENGTH_M, LINKS, 1e-3),
        &[("effects.entry.guide.length_m", 0.03), ("effects.entry.drag.coulomb_n", 0.2)],
    );
    let (model, wall, mut state) = (Chain::new(rubbing).unwrap(), free_space(), State::new());
    let mut found = Outputs::default();
    for tick in 0..1000 {
        found = step(&model, &wall.lumen(), &mut state, inserted(5e-3 + 1e-5 * f64::from(tick)));
    }
    assert_near("introducer", found.drive_force_n, 0.2, 1e-9);
}

/// Forces of drives beyond the reach of the links are flagged.
#[test]
fn a_drive_beyond_the_links_is_flagged() {
    let scaled =
        with(rod(LENGTH_M, LINKS, 1e-3), &[("effects.drive.encoder_scale.insertion", 1.2)]);
    let model = Chain::new(scaled).unwrap();
    let (wall, mut state) = (free_space(), State::new());
    let reach_m = model.reach_m();
    let mut flagged_from_m = None;
    for tick in 0..4000 {
        let at_m = 0.5 * reach_m * (1.0 + f64::from(tick) / 4000.0);
        if step(&model, &wall.lumen(), &mut state, inserted(at_m)).unresolved {
            flagged_from_m.get_or_insert(at_m);
        }
    }
    // Scaled relative to the start at half of the reach.
    let beyond_m = 0.5 * reach_m * (1.0 + 1.0 / 1.2);
    assert_near("flagged from", flagged_from_m.unwrap(), beyond_m, 1e-3);
}
