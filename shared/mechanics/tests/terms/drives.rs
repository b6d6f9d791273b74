//! What the drives hold: weight of what slides, and the energy of a twist.

use cathforce_mechanics::*;

use crate::rod::{FREE_TIP, free_space, hang, rest, rod};
use crate::{Chain, assert_near, both, pair};

const LENGTH_M: f64 = 0.1;
const LINKS: usize = 40;
const G: f64 = 9.81;

/// docs/model.md (41)
///
/// Fed by ds in a straight catheter, an instrument lifts its whole length by ds: its drive carries
/// m g L. Pieces and masses are exact whatever the links, and nothing bends: a millionth is room for
/// the stretch (m g/EA, 10⁻⁹) and rounding. Without the term the follower would carry nothing.
#[test]
fn in_an_upright_guide_the_drive_of_what_slides_carries_its_weight() {
    let (catheter_kg_per_m, wire_kg_per_m) = (3e-3, 2e-3);
    for upwards in [1.0, -1.0] {
        let mut pair = pair(LENGTH_M, LINKS, [1e-2, 1e-5]);
        pair.instrument.sections[0].mass_kg_per_m = catheter_kg_per_m;
        pair.guidewire.as_mut().unwrap().sections[0].mass_kg_per_m = wire_kg_per_m;
        // Not at the origin: what counts is the height over the mouth.
        pair.entry = Entry {
            position_m: [0.02, -0.03, 0.05],
            direction: [0.0, 0.0, upwards],
            up: [1.0, 0.0, 0.0],
        };
        pair.gravity_m_per_s2 = [0.0, 0.0, -G];
        // The last one of each inside, and the one that is followed.
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
            // The other one has the rest; half of the link at the mouth hangs on the guide.
            let whole_n = found.guidewire_force_n + found.drive_force_n;
            let all_kg = catheter_kg_per_m * catheter_m + wire_kg_per_m * wire_m;
            let at_mouth_kg = (catheter_kg_per_m + wire_kg_per_m) * 0.5 * LENGTH_M / LINKS as f64;
            assert_near("both", whole_n, upwards * (all_kg - at_mouth_kg) * G, 1e-6);
        }
    }
}

/// docs/model.md (18), the part ½ G J κ_t²
///
/// A rod that is twisted by a dead torque T stores T²/2GJ a length; fed by ds, its drive gains what
/// the torque's work T²/GJ ds leaves of that. What is twisted when unloaded, by κ₀, has been kept
/// straight in the guide at ½ G J κ₀². Links are straight and twist evenly: exact but for rounding.
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
