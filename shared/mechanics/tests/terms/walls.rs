//! Moving and relaxing walls, against a nearly rigid or a very soft rod.

use cathforce_mechanics::*;

use crate::rod::{FREE_TIP, free_space, inserted, rest, rod};
use crate::wall::norm;
use crate::{Chain, assert_near, floor, with};

const LENGTH_M: f64 = 0.1;
const LINKS: usize = 40;
const RADIUS_M: f64 = 0.8e-3;
/// Length of the rod without the quarter of a link that belongs to the mouth.
const PRESSED_M: f64 = LENGTH_M * (1.0 - 0.25 / LINKS as f64);
const STIFFNESS_N_PER_M2: f64 = 100.0;

/// A rod that bends by about 1/1000 of the wall's indentation: k L⁴/8EI = 0.00125.
fn rigid() -> Description<f64> {
    let mut rod = rod(LENGTH_M, LINKS, 1.0);
    rod.wall.line_stiffness_n_per_m2 = STIFFNESS_N_PER_M2;
    rod.wall.end_stiffness_n_per_m = 0.0;
    rod.wall.onset_m = 1e-7;
    rod
}

/// Motion of the wall with this amplitude, at its turning point.
fn moved(by_m: [f64; 3]) -> [(&'static str, f64); 5] {
    let [x, y, z] = by_m;
    [
        ("effects.wall.motion.x_m", x),
        ("effects.wall.motion.y_m", y),
        ("effects.wall.motion.z_m", z),
        ("effects.wall.motion.frequency_hz", 0.0),
        ("effects.wall.motion.phase_rad", core::f64::consts::FRAC_PI_2),
    ]
}

/// docs/explanation/model.md (36), (37)
///
/// A floor that just touches a rigid rod approaches by d, and is pressed down by k d per length. A floor that
/// retreats or moves along itself exerts no force. The tolerance of 0.3 % is twice the rod's deflection.
#[test]
fn a_wall_that_comes_nearer_presses_by_its_stiffness_times_that() {
    let (wall, near_m) = (floor(-RADIUS_M), 0.2e-3);
    let pressed = |by_m| {
        let model = Chain::new(with(rigid(), &moved(by_m))).unwrap();
        let mut state = State::new();
        let outputs = rest(&model, &wall.lumen(), &mut state, inserted(LENGTH_M), &FREE_TIP);
        (outputs, state.node_position_m(0).unwrap())
    };
    let (outputs, tip) = pressed([0.0, 0.0, near_m]);
    let [x, y, z] = outputs.force_on_vessel_n;
    assert_near("nearer", z, -STIFFNESS_N_PER_M2 * near_m * PRESSED_M, 3e-3);
    assert!(x.abs() + y.abs() < 1e-3 * z.abs(), "{outputs:?}");
    // A downward force at the middle has its moment along x × −z = y. The quarter of a link at the mouth
    // has no arm, which is 1 %.
    let [_, about_y, _] = outputs.moment_on_vessel_n_m;
    assert_near("moment", about_y, -z * 0.5 * LENGTH_M, 0.01);
    // Positions are in the rig's frame: the guide has not moved, and the rod is straight.
    assert!((tip[0] - LENGTH_M).abs() < 1e-6 && tip[2].abs() < 1e-6, "{tip:?}");
    for by_m in [[0.0, 0.0, -near_m], [2e-3, 0.0, -1e-6], [0.0, -2e-3, -1e-6]] {
        let (outputs, _) = pressed(by_m);
        assert!(norm(outputs.force_on_vessel_n) < 1e-6, "{by_m:?}: {outputs:?}");
    }
}

/// docs/explanation/model.md (37)
///
/// A rod that lies on a wall by its weight moves up and down with it, in the rig's frame. At a quarter and
/// three quarters of a period the wall is at rest, and the rod's end lies on it with an indentation of
/// m g/k = 1 µm. The stored wall and drag add errors of 2 µm.
#[test]
fn what_lies_on_a_moving_wall_follows_it() {
    let (amplitude_m, frequency_hz) = (1.5e-3, 0.25);
    let mut heavy = with(
        rod(LENGTH_M, LINKS, 1e-6),
        &[
            ("effects.wall.motion.z_m", amplitude_m),
            ("effects.wall.motion.frequency_hz", frequency_hz),
        ],
    );
    heavy.instrument.sections[0].mass_kg_per_m = 0.01;
    heavy.gravity_m_per_s2 = [0.0, 0.0, -9.81];
    heavy.wall.line_stiffness_n_per_m2 = 1e5;
    heavy.wall.end_stiffness_n_per_m = 0.0;
    heavy.wall.onset_m = 1e-6;
    let (model, wall, mut state) = (Chain::new(heavy).unwrap(), floor(-RADIUS_M), State::new());
    let drive = inserted(LENGTH_M);
    while !settle(&model, &wall.lumen(), &mut state, drive) {}
    for tick in 1..=400 {
        step(&model, &wall.lumen(), &mut state, drive);
        let turns = frequency_hz * 1e-2 * f64::from(tick);
        let height_m = amplitude_m * (core::f64::consts::TAU * turns).sin();
        // Away from the mouth, where the rod lies on the wall.
        let [_, _, z] = state.node_position_m(5).unwrap();
        if tick % 100 == 0 {
            println!("tick {tick}: {:.3} mm, wall {:.3} mm", 1e3 * z, 1e3 * height_m);
            let off_m = z - (height_m - 1e-6);
            assert!(off_m.abs() < 2e-6, "tick {tick}: at {z} m, the wall moved by {height_m} m");
        }
    }
}

/// docs/explanation/model.md (36): a wall that moves along itself carries a pressed rod along by friction.
///
/// In the middle of its motion it moves at 4.7 mm/s. While it moves towards +y, the rod acts on it with μ N
/// towards −y.
#[test]
fn a_wall_that_moves_along_itself_drags_by_its_friction() {
    let (friction, near_m) = (0.3, 0.2e-3);
    let motion = [
        ("effects.wall.motion.y_m", 3e-3),
        ("effects.wall.motion.frequency_hz", 0.25),
        ("wall.friction_coefficient", friction),
    ];
    let (model, wall, mut state) =
        (Chain::new(with(rigid(), &motion)).unwrap(), floor(near_m - RADIUS_M), State::new());
    let drive = inserted(LENGTH_M);
    while !settle(&model, &wall.lumen(), &mut state, drive) {}
    let normal_n = STIFFNESS_N_PER_M2 * near_m * PRESSED_M;
    for tick in 1..=400 {
        let outputs = step(&model, &wall.lumen(), &mut state, drive);
        let [_, y, z] = outputs.force_on_vessel_n;
        // At its largest, steady speed: on the way to −y, and to +y.
        let towards = match tick {
            200 => -1.0,
            400 => 1.0,
            _ => continue,
        };
        assert_near("pressed", z, -normal_n, 3e-3);
        // The rod is held back: on the vessel it acts against the vessel's motion.
        assert_near("dragged", y, -towards * friction * normal_n, 3e-3);
    }
}

/// docs/explanation/model.md (40)
///
/// A wall that approaches suddenly by d is pressed by (1 + β) k d, and after the time t by
/// k (1 + β exp(−t/τ)) d. Implicit steps add dt/2τ = 0.25 %, and half of the points sample the wall one step
/// late. The tolerance is 1 %.
#[test]
fn a_relaxing_wall_is_pressed_hard_at_first_and_lets_go_with_its_time() {
    let (ratio, time_s, near_m) = (1.5, 0.2, 0.2e-3);
    let mut relaxing = with(
        rigid(),
        &[("effects.wall.viscoelastic.ratio", ratio), ("effects.wall.viscoelastic.time_s", time_s)],
    );
    relaxing.solver.tick_s = 1e-3;
    let model = Chain::new(relaxing).unwrap();
    let (far, near, mut state) = (floor(-2e-3), floor(near_m - RADIUS_M), State::new());
    let drive = inserted(LENGTH_M);
    rest(&model, &far.lumen(), &mut state, drive, &FREE_TIP);
    let lasting_n = STIFFNESS_N_PER_M2 * near_m * PRESSED_M;
    for tick in 1..=1600 {
        let outputs = step(&model, &near.lumen(), &mut state, drive);
        let t = 1e-3 * f64::from(tick);
        if [2, 100, 200, 400, 1600].contains(&tick) {
            let exact_n = -lasting_n * (1.0 + ratio * (-t / time_s).exp());
            let found_n = outputs.force_on_vessel_n[2];
            assert_near(&format!("{t} s"), found_n, exact_n, 0.01);
        }
    }
}

/// docs/explanation/model.md (16), (37)
///
/// A rod without contact stays where it is, however the vessel moves, because inertia and drag refer to the
/// rig's frame.
#[test]
fn a_vessel_that_moves_does_not_shake_what_it_does_not_touch() {
    for (key, parts) in [("z_m", 1), ("x_m", 1), ("x_m", 2), ("z_m", 2)] {
        let key = format!("effects.wall.motion.{key}");
        let mut moving = with(
            rod(LENGTH_M, LINKS, 8e-6),
            &[(&key, 5e-3), ("effects.wall.motion.frequency_hz", 0.25)],
        );
        moving.solver.drag =
            Drag { at_rest_n_s_per_m2: 0.155, swift_n_s_per_m2: 1.55, swift_m_per_s: 0.08 };
        moving.solver.tick_s = 1e-3;
        moving.solver.predictor_gain = 0.12;
        moving.solver.substeps = parts;
        let (model, wall, mut state) = (Chain::new(moving).unwrap(), free_space(), State::new());
        let drive = inserted(LENGTH_M - 1e-3);
        while !settle(&model, &wall.lumen(), &mut state, drive) {}
        let start_m = state.node_position_m(0).unwrap();
        for tick in 0..4000 {
            let found = step(&model, &wall.lumen(), &mut state, drive);
            let tip_m = state.node_position_m(0).unwrap();
            let off_m = norm(core::array::from_fn(|i| tip_m[i] - start_m[i]));
            assert!(off_m < 1e-5, "{key}, {parts} parts, tick {tick}: {off_m} m");
            assert!(found.drive_force_n.abs() < 1e-4, "{key}, tick {tick}: {found:?}");
        }
    }
}
