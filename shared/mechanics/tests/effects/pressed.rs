//! Effects on a tip that is pressed on a wall.

use cathforce_mechanics::*;

use crate::rod::{FREE_TIP, inserted, rest, rod};
use crate::wall::{StoredWall, plane};

/// Force at the drive \[N\] while a tip is fed up a slope that nothing else touches.
fn drive_force_n(friction: f64, light_load: f64, high_load: f64) -> f64 {
    let mut description = rod(0.1, 40, 1e-3);
    description.wall.friction_coefficient = friction;
    // The end is as stiff as a metre of the wall: by its stiffness, 20 mN would be next to no load.
    description.wall.line_stiffness_n_per_m2 = 1e4;
    description.wall.end_stiffness_n_per_m = 1e4;
    let load = &mut description.effects.contact.load_friction;
    (load.light_load_ratio, load.high_load_ratio, load.load_n_per_m) = (light_load, high_load, 0.5);
    let model = Model::new(description).unwrap();
    let bounds = [[-0.02, -8e-3, -8e-3], [0.12, 8e-3, 0.02]];
    let slope = |p| plane(p, [0.05, 0.0, -0.8e-3], [-0.1, 0.0, 0.99_f64.sqrt()]);
    let wall = StoredWall::sampled(bounds, 1e-3, 4e-3, slope);
    let mut state = State::new();
    let mut last = rest(&model, &wall.lumen(), &mut state, inserted(0.05), &FREE_TIP);
    for tick in 1..=3000 {
        let drive = inserted(0.05 + 1e-5 * f64::from(tick));
        last = step_loaded(&model, &wall.lumen(), &mut state, drive, &FREE_TIP);
    }
    last.drive_force_n
}

/// docs/explanation/model.md (42)
#[test]
fn a_tip_presses_by_its_force_over_its_arc_however_stiff_its_end_is() {
    let [light, high] = [0.5, 0.1].map(|friction| drive_force_n(friction, 1.0, 1.0));
    let found = drive_force_n(0.5, 1.0, 0.2);
    println!(
        "drive force {found:.5} N, at the friction of light load {light:.5}, of high {high:.5}"
    );
    assert!(light > 1.5 * high, "friction counts");
    assert!((found - high).abs() < 0.1 * (light - high), "{found} {high} {light}");
}
