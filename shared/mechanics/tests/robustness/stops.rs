//! Friction after the drive stops, and a feed with coarse encoder steps.

use cathforce_mechanics::*;

use crate::{bent_tube, catheter};

/// Insertion with the tip well past the bend, which presses the whole instrument to the wall \[m\].
const FAR_M: f64 = 0.1;
/// A friction coefficient with which most of the force at the drive is friction.
const FRICTION: f64 = 0.7;

/// Force at [`FAR_M`] after a feed of `feed_m` per tick, and then the force of every tick in which the
/// drive moves as `then` says, past that. A tick has `parts` substeps.
fn drive_forces_n(parts: u8, feed_m: f64, then: impl IntoIterator<Item = f64>) -> (f64, Vec<f64>) {
    let wall = bent_tube(4e-3);
    let mut description = catheter(FRICTION, 1e-5, 0.0);
    description.solver.substeps = parts;
    let model: Model<f64> = Model::new(description).unwrap();
    let (lumen, mut state) = (wall.lumen(), State::new());
    let mut to = |insertion_m: f64| {
        let outputs = step(&model, &lumen, &mut state, Drive { insertion_m, rotation_rad: 0.0 });
        outputs.drive_force_n
    };
    let ticks = (FAR_M / feed_m).round() as usize;
    let sliding_n = (1..=ticks).map(|tick| to(feed_m * tick as f64)).last().unwrap();
    let end_m = feed_m * ticks as f64;
    (sliding_n, then.into_iter().map(|past_m| to(end_m + past_m)).collect())
}

fn mean(of: &[f64]) -> f64 {
    of.iter().sum::<f64>() / of.len() as f64
}

#[test]
fn a_drive_that_stops_is_held_by_the_friction_that_it_slid_against() {
    let feeds_m = [2e-6, 5e-6, 13e-6, 40e-6];
    for parts in [1, 2] {
        for feed_m in feeds_m {
            let (sliding_n, at_rest_n) = drive_forces_n(parts, feed_m, [0.0; 300]);
            let rested_n = mean(&at_rest_n[200..]);
            // The same stop within 0.1 s, as by a drive with inertia.
            let ramp = (1..=100).map(|tick| f64::from(tick) - f64::from(tick * tick) / 200.0);
            let ramped = ramp.map(|share| share * feed_m).chain([50.0 * feed_m; 200]);
            let (_, ramped_n) = drive_forces_n(parts, feed_m, ramped);
            let ramped_n = mean(&ramped_n[200..]);
            println!(
                "{:.0} µm a tick of {parts} parts: sliding {:.3} mN, stopped at once {:.3}, in 0.1 s {:.3}",
                1e6 * feed_m,
                1e3 * sliding_n,
                1e3 * rested_n,
                1e3 * ramped_n
            );
            assert!(sliding_n > 5e-3, "the wall must be felt: {sliding_n}");
            // The part from the feed in these 0.1 s is not lost friction.
            assert!((rested_n - sliding_n).abs() < 0.02 * sliding_n, "{rested_n} of {sliding_n}");
            assert!((ramped_n - sliding_n).abs() < 0.02 * sliding_n, "{ramped_n} of {sliding_n}");
        }
    }
}

#[test]
fn an_encoder_of_coarse_steps_tells_the_force_of_a_fine_one() {
    let feeds_m = [2e-6, 5e-6, 13e-6];
    for parts in [1, 2] {
        for feed_m in feeds_m {
            let fed = |tick: i32, step_m: f64| {
                (f64::from(tick) * feed_m / step_m + 1e-6).floor() * step_m
            };
            let told = |step_m: f64| {
                drive_forces_n(parts, feed_m, (1..=1000).map(|tick| fed(tick, step_m))).1
            };
            let fine_n = mean(&told(1e-9)[500..]);
            for (step_m, off) in
                [(1e-6, 0.01), (2e-6, 0.05), (5e-6, 0.05), (1e-5, 0.07), (2e-5, 0.1)]
            {
                let coarse = told(step_m);
                let coarse_n = mean(&coarse[500..]);
                println!(
                    "{:.0} µm a tick of {parts} parts in steps of {:.0} µm: {:.3} mN, of a fine encoder {:.3}",
                    1e6 * feed_m,
                    1e6 * step_m,
                    1e3 * coarse_n,
                    1e3 * fine_n
                );
                assert!((coarse_n - fine_n).abs() < off * fine_n, "{coarse_n} of {fine_n}");
            }
        }
    }
}
