//! Friction under rotation and sliding, and the friction coefficient.

use cathforce_mechanics::*;

use crate::rod::{FREE_TIP, inserted, rod};
use crate::wall::{StoredWall, norm, plane, tube};
use crate::{Chain, assert_near, both, floor, pair, with};

const LENGTH_M: f64 = 0.1;
const G: f64 = 9.81;
const FRICTION: f64 = 0.3;

/// docs/explanation/model.md (25), (28)
///
/// A load presses the end of a bare guidewire on a floor, and its drive rolls it. The surface below moves
/// towards +y (e_x × −e_z), so friction μ N acts on the wire towards −y and on the vessel towards +y. Its
/// moment r μ N about the wire acts on the wire's drive only, because no work is done on the catheter. The
/// floor rises towards the wire's end by 1 %, so only the end touches. The wire deflects by 0.1 mm
/// (3 EI/L³ = 60 N/m) and sinks by 1 µm (N over 20 kN/m). About the catheter's direction this adds
/// y · (N − load) and z · F, which is below 1 % of r μ N.
#[test]
fn a_bare_wire_that_is_rolled_on_a_floor_feels_friction_times_its_radius_and_the_catheter_nothing()
{
    let (catheter_m, press_n, wire_radius_m) = (0.02, 0.02, 0.45e-3);
    let mut pair = pair(LENGTH_M, 40, [1e-2, 2e-2]);
    pair.guidewire.as_mut().unwrap().outer_radius_m = wire_radius_m;
    pair.wall.friction_coefficient = FRICTION;
    pair.wall.end_stiffness_n_per_m = 2e4;
    pair.wall.onset_m = 1e-6;
    pair.solver.drag = Drag::constant(1.0);
    let (end, rising) = ([LENGTH_M, 0.0, -wire_radius_m], [-0.01, 0.0, 0.9999_f64.sqrt()]);
    let bounds = [[-0.01, -0.012, -6e-3], [0.126, 0.012, 6e-3]];
    let wall = StoredWall::sampled(bounds, 1e-3, 6e-3, |p| plane(p, end, rising));
    let (model, lumen) = (Chain::new(pair).unwrap(), wall.lumen());
    let loads = Loads { tip_force_n: [0.0, 0.0, -press_n], ..FREE_TIP };
    for sense in [1.0, -1.0] {
        let mut drives = both(catheter_m, LENGTH_M);
        let mut state = State::new();
        while !settle_loaded(&model, &lumen, &mut state, drives, &loads) {}
        let mut found = Outputs::default();
        for _ in 0..800 {
            drives.guidewire.rotation_rad += sense * 0.01;
            found = step_loaded(&model, &lumen, &mut state, drives, &loads);
        }
        let [_, side_n, normal_n] = found.force_on_vessel_n;
        assert_near("normal force", normal_n, -press_n, 0.01);
        assert_near("friction", side_n, sense * FRICTION * press_n, 0.01);
        let torque_n_m = sense * FRICTION * press_n * wire_radius_m;
        assert_near("wire's torque", found.guidewire_torque_n_m, torque_n_m, 0.01);
        let left = found.drive_torque_n_m.abs();
        assert!(left < 0.01 * torque_n_m.abs(), "the catheter's torque is {left} N·m");
    }
}

/// docs/explanation/model.md (12), (15)
///
/// A heavy catheter that is rotated climbs the wall of a tube to tan φ = μ and slides there. The wall
/// carries N = W cos φ, friction is W sin φ, and its moment r W sin φ about the centre line is the torque at
/// the drive, against the rotation. The nodal forces add up to W. Half of the link at the mouth (1.25 %)
/// hangs on the guide, and bending there carries below 2 %.
#[test]
fn a_heavy_catheter_that_is_turned_in_a_tube_takes_friction_times_weight_times_radius() {
    let (radius_m, tube_m, kg_per_m) = (0.8e-3, 4e-3, 0.01);
    let mut rod = rod(LENGTH_M, 40, 1e-8);
    let section = &mut rod.instrument.sections[0];
    (section.torsional_stiffness_n_m2, section.mass_kg_per_m) = (1e-5, kg_per_m);
    rod.gravity_m_per_s2 = [0.0, 0.0, -G];
    rod.wall.friction_coefficient = FRICTION;
    rod.wall.end_stiffness_n_per_m = 0.0;
    rod.wall.line_stiffness_n_per_m2 = 1e5;
    rod.wall.onset_m = 1e-6;
    // Predicted rotation causes sliding too.
    (rod.solver.drag, rod.solver.predictor_gain) = (Drag::constant(1.0), 0.12);
    // The guide lies on the floor of the tube.
    let axis_m = tube_m - radius_m;
    let bounds = [[-0.01, -6e-3, -3e-3], [0.126, 6e-3, 9e-3]];
    let wall = StoredWall::sampled(bounds, 1e-3, 3e-3, |p| tube(p, [p[0], 0.0, axis_m], tube_m));
    let (model, lumen, mut state) = (Chain::new(rod).unwrap(), wall.lumen(), State::new());
    let mut drive = inserted(LENGTH_M);
    while !settle(&model, &lumen, &mut state, drive) {}
    for sense in [1.0, -1.0] {
        let mut found = Outputs::default();
        for _ in 0..600 {
            drive.rotation_rad += sense * 0.01;
            found = step(&model, &lumen, &mut state, drive);
        }
        let sine = FRICTION / (1.0 + FRICTION * FRICTION).sqrt();
        let pressing = |node| norm(state.node_force_n(node).unwrap());
        let carried_n: f64 = (0..state.nodes()).map(pressing).sum();
        assert_near("weight on the wall", carried_n, kg_per_m * G * LENGTH_M, 0.03);
        let torque_n_m = found.drive_torque_n_m;
        assert_near("torque by forces", torque_n_m, sense * radius_m * sine * carried_n, 0.01);
        // It climbs against the motion of its lower surface: to −y if it rotates from y to z.
        let aside_m = state.node_position_m(10).unwrap()[1];
        assert_near("climbed", aside_m, -sense * axis_m * sine, 0.05);
    }
}

/// Friction over normal force of a rod that lies on a floor by its weight, after a feed in a number of
/// ticks of 1 ms.
///
/// The floor is as far below the mouth as the rod sinks into it, so the rod is straight and the wall
/// carries the weight evenly.
fn coefficient(kg_per_m: f64, speed_m_per_s: f64, effects: &[(&str, f64)]) -> f64 {
    let stiffness_n_per_m2 = 1e4;
    let mut rod = with(rod(LENGTH_M, 40, 1e-6), effects);
    rod.instrument.sections[0].mass_kg_per_m = kg_per_m;
    rod.instrument.outer_radius_m = 1e-4;
    rod.gravity_m_per_s2 = [0.0, 0.0, -G];
    rod.wall = Wall {
        line_stiffness_n_per_m2: stiffness_n_per_m2,
        end_stiffness_n_per_m: 0.0,
        friction_coefficient: FRICTION,
        onset_m: 1e-7,
        damping_s: 5e-3,
        ..rod.wall
    };
    (rod.solver.tick_s, rod.solver.drag) = (1e-3, Drag::constant(0.05));
    let wall = floor(-1e-4 + kg_per_m * G / stiffness_n_per_m2);
    let (model, lumen, mut state) = (Chain::new(rod).unwrap(), wall.lumen(), State::new());
    let start_m = 0.09;
    while !settle(&model, &lumen, &mut state, inserted(start_m)) {}
    let mut found = Outputs::default();
    for tick in 1..=200 {
        let drive = inserted(start_m + speed_m_per_s * 1e-3 * f64::from(tick));
        found = step(&model, &lumen, &mut state, drive);
    }
    let [along_n, _, normal_n] = found.force_on_vessel_n;
    assert_near("carried", -normal_n, kg_per_m * G * start_m, 0.05);
    along_n / -normal_n
}

/// docs/explanation/model.md (42)
///
/// Every sample carries N/ℓ = m g, except near the ends, where the arm of friction bends the rod: 10 % over
/// 5 of 90 mm, with both signs. The tolerance is 1 %. The load is the halfway one, n₀.
#[test]
fn the_friction_of_a_load_is_what_the_law_says_at_that_load() {
    let (light, high, half_way_n_per_m) = (2.0, 0.5, 0.5);
    let law: &[(&str, f64)] = &[
        ("effects.contact.load_friction.light_load_ratio", light),
        ("effects.contact.load_friction.high_load_ratio", high),
        ("effects.contact.load_friction.load_n_per_m", half_way_n_per_m),
    ];
    assert_near("without", coefficient(0.01, 5e-3, &[]), FRICTION, 0.01);
    for kg_per_m in [0.01, 0.05, 0.2] {
        let x = kg_per_m * G / half_way_n_per_m;
        let exact = FRICTION * (light + high * x) / (1.0 + x);
        let found = coefficient(kg_per_m, 5e-3, law);
        assert_near(&format!("{} N/m", kg_per_m * G), found, exact, 0.01);
    }
}

/// docs/explanation/model.md (41)
///
/// All samples have the same speed, which is constant for twenty time constants of its filter. The
/// tolerance is 1 % as above.
#[test]
fn the_friction_of_a_speed_is_what_the_law_says_at_that_speed() {
    let (at_rest, half_m_per_s, viscous_s_per_m) = (1.8, 4e-3, 10.0);
    let law: &[(&str, f64)] = &[
        ("effects.contact.stribeck.static_ratio", at_rest),
        ("effects.contact.stribeck.speed_m_per_s", half_m_per_s),
        ("effects.contact.stribeck.viscous_s_per_m", viscous_s_per_m),
    ];
    for speed_m_per_s in [1e-3, 4e-3, 20e-3] {
        let v = speed_m_per_s / half_m_per_s;
        let ratio = 1.0 + (at_rest - 1.0) / (1.0 + v * v) + viscous_s_per_m * speed_m_per_s;
        let found = coefficient(0.01, speed_m_per_s, law);
        assert_near(&format!("{speed_m_per_s} m/s"), found, FRICTION * ratio, 0.01);
    }
}
