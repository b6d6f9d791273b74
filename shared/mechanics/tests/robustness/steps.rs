//! Drives that move discontinuously: encoders that jump, reversals at full speed.

use cathforce_mechanics::*;

use crate::sets::most_energy_j;
use crate::{bent_tube, catheter};

/// Insertion at which the forces are compared, with the tip past the bend \[m\].
const FAR_M: f64 = 0.1;
const NEAR_M: f64 = 0.09;
const FEED_M: f64 = 13e-6;

/// Feeds to [`FAR_M`], applies the disturbance `shaken` of each tick (feed past that, and rotation), then
/// withdraws to [`NEAR_M`] and feeds to [`FAR_M`] again. Returns the forces of the last tick, and the
/// number of flagged ticks during the disturbance.
fn shaken(shaken: impl IntoIterator<Item = (f64, f64)>) -> (Outputs<f32>, usize) {
    let description = catheter(0.3, 1e-5, 20.0);
    let wall = bent_tube(4e-3);
    let model: Model<f32> = Model::new(description.clone()).unwrap();
    let (lumen, mut state) = (wall.lumen(), State::new());
    let most_j = most_energy_j(&description, FAR_M as f32);
    let mut to = |insertion_m: f64, rotation_rad: f64| {
        let drive = Drive { insertion_m: insertion_m as f32, rotation_rad: rotation_rad as f32 };
        let outputs = step(&model, &lumen, &mut state, drive);
        let energy_j = state.kinetic_energy_j(&model) + state.elastic_energy_j(&model);
        assert!(!outputs.lost, "{outputs:?}");
        assert!(energy_j <= most_j, "{energy_j} J, at most {most_j} J; {outputs:?}");
        outputs
    };
    let ticks = |from_m: f64, to_m: f64| {
        let count = ((to_m - from_m).abs() / FEED_M).ceil();
        (1..=count as usize).map(move |tick| from_m + (to_m - from_m) * tick as f64 / count)
    };
    ticks(0.0, FAR_M).for_each(|at_m| {
        to(at_m, 0.0);
    });
    let flagged =
        shaken.into_iter().filter(|(fed_m, turned)| to(FAR_M + fed_m, *turned).unresolved).count();
    let mut last = Outputs::default();
    for at_m in ticks(FAR_M, NEAR_M).chain(ticks(NEAR_M, FAR_M)) {
        last = to(at_m, 0.0);
    }
    (last, flagged)
}

/// Forces are the same as without the disturbance, within 1 % of the total force.
fn assert_forgotten(what: &str, found: &Outputs<f32>) {
    let (still, _) = shaken([]);
    let norm = |f: [f32; 3]| f.iter().map(|f| f * f).sum::<f32>().sqrt();
    let all_n = norm(still.force_on_vessel_n);
    let off = core::array::from_fn(|i| found.force_on_vessel_n[i] - still.force_on_vessel_n[i]);
    let [off_n, drive_n] = [norm(off), (found.drive_force_n - still.drive_force_n).abs()];
    println!(
        "{what}: off by {:.4} mN, drive {:.4} mN, of {:.2}",
        1e3 * off_n,
        1e3 * drive_n,
        1e3 * all_n
    );
    assert!(all_n > 3e-3, "the wall must be felt: {still:?}");
    assert!(off_n < 0.01 * all_n && drive_n < 0.01 * all_n, "{what}: {found:?}, still {still:?}");
    assert!(!found.unresolved);
}

#[test]
fn an_encoder_that_steps_is_flagged_and_forgotten() {
    // As with a slipping drive or lost frames: a jump, half a second there, and a jump back.
    for (step_m, step_rad) in [(3e-3, 0.0), (-3e-3, 0.0), (0.0, 0.5), (3e-3, -0.5)] {
        let steps = (0..3000).map(|tick| {
            let there = (tick / 500) % 2 == 1;
            if there { (step_m, step_rad) } else { (0.0, 0.0) }
        });
        let (found, flagged) = shaken(steps);
        println!("{flagged} ticks flagged");
        assert!(flagged > 0, "a step of {step_m} m and {step_rad} rad is not flagged");
        assert_forgotten(&format!("steps of {step_m} m, {step_rad} rad"), &found);
    }
}

#[test]
fn reversals_at_full_speed_are_forgotten() {
    // To and fro at 200 mm/s or 15 rad/s, reversed within a tick, ten times a second.
    for (speed_m, speed_rad) in [(200e-6, 0.0), (0.0, 15e-3), (200e-6, 15e-3)] {
        let zigzag = (0..2000).map(|tick| {
            let phase = f64::from(tick % 100);
            let away = 50.0 - (phase - 50.0).abs();
            (-speed_m * away, speed_rad * away)
        });
        let (found, flagged) = shaken(zigzag);
        println!("{flagged} ticks flagged");
        assert_forgotten(&format!("{speed_m} m and {speed_rad} rad a tick"), &found);
    }
}
