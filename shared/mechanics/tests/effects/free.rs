//! Effects on an instrument in free space.

use cathforce_mechanics::*;

use crate::rod::{FREE_TIP, free_space, hang, hung, inserted, rest, rod};

const LENGTH_M: f64 = 0.1;
const STIFFNESS: f64 = 1e-5;

fn with(mut description: Description<f64>, values: &[(&str, f64)]) -> Description<f64> {
    for (key, value) in values {
        description.set_parameter(key, *value).unwrap();
    }
    description
}

/// A rod whose tip is bent towards `up`.
fn bent() -> Description<f64> {
    let mut description = rod(LENGTH_M, 40, STIFFNESS);
    let piece = PrecurvePiece {
        length_m: 0.02,
        curvature_per_m: 50.0,
        lateral_curvature_per_m: 0.0,
        torsion_per_m: 0.0,
    };
    description.instrument.precurve.push(piece).unwrap();
    description
}

fn near(a: [f64; 3], b: [f64; 3], tolerance: f64) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance)
}

#[test]
fn a_tendon_bends_to_the_arc_at_which_its_tension_balances() {
    let (pull, slack, stiffness, offset) = (1.5e-3, 0.3e-3, 400.0, 0.5e-3);
    let description = with(
        rod(LENGTH_M, 40, STIFFNESS),
        &[
            ("tendon.pull_m", pull),
            ("tendon.stiffness_n_per_m", stiffness),
            ("tendon.offset_m", offset),
            ("tendon.length_m", LENGTH_M),
            ("effects.tendon.slack.length_m", slack),
        ],
    );
    let (tip, _) = hang(description.clone(), &FREE_TIP);
    // T = k (pull − slack − e φ), φ = T e L/EI.
    let compliance = offset * LENGTH_M / STIFFNESS;
    let tension = stiffness * (pull - slack) / (1.0 + stiffness * offset * compliance);
    let curvature = tension * offset / STIFFNESS;
    let angle = curvature * LENGTH_M;
    let expected = [angle.sin() / curvature, 0.0, (1.0 - angle.cos()) / curvature];
    // Cells at the ends of the chain are halves: one link in forty.
    assert!(near(tip, expected, 0.03 * expected[2]), "{tip:?} {expected:?}");

    let (rubbing, _) =
        hang(with(description, &[("effects.tendon.friction.coefficient", 0.5)]), &FREE_TIP);
    // What does not reach the tip bends it less.
    assert!(rubbing[2] < tip[2] - 1e-3, "{rubbing:?} {tip:?}");
}

#[test]
fn windup_turns_the_tip_back_by_torque_over_stiffness() {
    let torque = 2e-6;
    let loads = Loads { tip_moment_n_m: [torque, 0.0, 0.0], ..FREE_TIP };
    let free_m = 0.5;
    let wound = with(bent(), &[("effects.instrument.torsional_windup.free_length_m", free_m)]);
    let (tip, outputs) = hang(wound, &loads);
    // Drive turned instead by what the shaft behind the entry plane gives way.
    let rotation_rad = torque * free_m / (0.7 * STIFFNESS);
    assert!(rotation_rad > 0.1);
    let model: Model<f64> = Model::new(bent()).unwrap();
    let (none, mut state) = (free_space(), State::new());
    let drive = Drive { insertion_m: LENGTH_M, rotation_rad };
    rest(&model, &none.lumen(), &mut state, drive, &loads);
    let turned = state.node_position_m(0).unwrap();
    assert!(near(tip, turned, 1e-6), "{tip:?} {turned:?}");
    assert!((outputs.drive_torque_n_m + torque).abs() < 1e-9, "{outputs:?}");
}

/// A link that has just entered is nearly rigid in bending, five million times as stiff as the shaft in
/// torsion. The solve limits the twist per step, but the state of rest is the same.
/// docs/explanation/model.md (44)
#[test]
fn windup_behind_a_link_that_has_just_entered_is_the_same_in_the_end() {
    let (torque, free_m, insertion_m) = (2e-7, 5.0, LENGTH_M + 3e-6);
    let loads = Loads { tip_moment_n_m: [torque, 0.0, 0.0], ..FREE_TIP };
    let wound = with(bent(), &[("effects.instrument.torsional_windup.free_length_m", free_m)]);
    let viscous = with(wound.clone(), &[("effects.instrument.viscoelastic.time_s", 0.01)]);
    let none = free_space();
    let tip = |description: Description<f64>, rotation_rad: f64| {
        let model: Model<f64> = Model::new(description).unwrap();
        let (mut state, drive) = (State::new(), Drive { insertion_m, rotation_rad });
        let outputs = rest(&model, &none.lumen(), &mut state, drive, &loads);
        assert!((outputs.drive_torque_n_m + torque).abs() < 1e-3 * torque, "{outputs:?}");
        state.node_position_m(0).unwrap()
    };
    let turned = tip(bent(), torque * free_m / (0.7 * STIFFNESS));
    for description in [wound, viscous] {
        let tip = tip(description, 0.0);
        assert!(near(tip, turned, 1e-6), "{tip:?} {turned:?}");
    }
}

#[test]
fn a_phantom_that_is_elsewhere_leaves_the_free_instrument_where_it_was() {
    let (nominal, _) = hang(bent(), &FREE_TIP);
    let moved = with(
        bent(),
        &[
            ("effects.wall.registration.x_m", 2e-3),
            ("effects.wall.registration.z_m", -1e-3),
            ("effects.wall.registration.tilt_y_rad", 0.1),
        ],
    );
    let (tip, _) = hang(moved, &FREE_TIP);
    assert!(near(tip, nominal, 1e-9), "{tip:?} {nominal:?}");
}

#[test]
fn weight_and_stiffness_trade_off() {
    let heavy = |values: &[(&str, f64)]| {
        let mut description = rod(LENGTH_M, 40, STIFFNESS);
        description.gravity_m_per_s2 = [0.0, 0.0, -9.81];
        hang(with(description, values), &FREE_TIP).0
    };
    let nominal = heavy(&[]);
    let both = heavy(&[
        ("effects.instrument.weight.factor", 2.0),
        ("effects.instrument.stiffness.shaft_factor", 2.0),
        ("effects.instrument.stiffness.tip_factor", 2.0),
    ]);
    assert!(near(nominal, both, 1e-7), "{nominal:?} {both:?}");
    let heavier = heavy(&[("effects.instrument.weight.factor", 2.0)]);
    assert!(heavier[2] < 1.5 * nominal[2], "{heavier:?}");
}

#[test]
fn softening_ends_at_its_share() {
    let mut description = rod(LENGTH_M, 40, STIFFNESS);
    description.gravity_m_per_s2 = [0.0, 0.0, -9.81];
    let soft = with(
        description.clone(),
        &[
            ("effects.instrument.softening.share", 0.5),
            ("effects.instrument.softening.time_s", 0.1),
        ],
    );
    let (softened, _) = hang(soft, &FREE_TIP);
    let halved = [
        ("effects.instrument.stiffness.shaft_factor", 0.5),
        ("effects.instrument.stiffness.tip_factor", 0.5),
    ];
    let (half, _) = hang(with(description, &halved), &FREE_TIP);
    assert!(near(softened, half, 1e-6), "{softened:?} {half:?}");
}

#[test]
fn a_guide_past_the_entry_carries_the_instrument_on() {
    let guided = with(bent(), &[("effects.entry.guide.length_m", 0.03)]);
    let model: Model<f64> = Model::new(guided).unwrap();
    let (none, mut state) = (free_space(), State::new());
    rest(&model, &none.lumen(), &mut state, inserted(0.08), &FREE_TIP);
    let tip = state.node_position_m(0).unwrap();
    let model: Model<f64> = Model::new(bent()).unwrap();
    let mut state = State::new();
    rest(&model, &none.lumen(), &mut state, inserted(0.05), &FREE_TIP);
    let [x, y, z] = state.node_position_m(0).unwrap();
    assert!(near(tip, [x + 0.03, y, z], 1e-9), "{tip:?}");
}

#[test]
fn the_introducer_asks_for_its_friction_and_lets_go_at_rest() {
    let dragging = with(
        rod(LENGTH_M, 40, STIFFNESS),
        &[
            ("effects.entry.drag.coulomb_n", 0.2),
            ("effects.entry.drag.viscous_n_s_per_m", 2.0),
            ("effects.entry.drag.phantom_share", 0.5),
        ],
    );
    let model: Model<f64> = Model::new(dragging).unwrap();
    let (none, mut state) = (free_space(), State::new());
    rest(&model, &none.lumen(), &mut state, inserted(0.05), &FREE_TIP);
    // 0.2 mm in a step of 10 ms: 20 mm/s.
    let mut at = 0.05;
    let mut feed = |fed_m: f64| {
        at += fed_m;
        step(&model, &none.lumen(), &mut state, inserted(at))
    };
    let forward = feed(2e-4);
    assert!((forward.drive_force_n - 0.24).abs() < 5e-3, "{forward:?}");
    assert!((forward.force_on_vessel_n[0] - 0.12).abs() < 1e-9, "{forward:?}");
    assert!((feed(0.0).drive_force_n - 0.2).abs() < 5e-3);
    let back = feed(-2e-4);
    assert!((back.drive_force_n + 0.24).abs() < 5e-3, "{back:?}");
}

/// A viscous time of a second \[s\].
const VISCOUS: &[(&str, f64)] = &[("effects.instrument.viscoelastic.time_s", 1.0)];

/// docs/explanation/model.md (8)
#[test]
fn what_comes_out_of_the_guide_is_straight_and_bends_as_its_viscosity_lets_it() {
    let (start_m, fed_m, speed_m_per_s, curvature) = (0.04, 0.05, 0.01, 5.0);
    let description = with(rod(LENGTH_M, 40, STIFFNESS), VISCOUS);
    let (h, dt_s) = (description.solver.link_length_m, description.solver.tick_s);
    let loads = Loads { tip_moment_n_m: [0.0, -STIFFNESS * curvature, 0.0], ..FREE_TIP };
    let model = Model::new(description).unwrap();
    let (wall, mut state) = (free_space(), State::new());
    rest(&model, &wall.lumen(), &mut state, inserted(start_m), &loads);
    let ticks = (fed_m / (speed_m_per_s * dt_s)).round() as u32;
    for tick in 1..=ticks {
        let drive = inserted(start_m + speed_m_per_s * dt_s * f64::from(tick));
        step_loaded(&model, &wall.lumen(), &mut state, drive, &loads);
    }
    let [tip, next] = [0, 1].map(|node| state.node_position_m(node).unwrap());
    let angle = (tip[2] - next[2]).atan2(tip[0] - next[0]);
    // EI (κ + τ v dκ/ds) = M from the mouth on; what has moved by τ v is at its end to 1/e.
    let lag_m = speed_m_per_s * VISCOUS[0].1;
    let late_m = lag_m * (1.0 - (-fed_m / lag_m).exp());
    let found_m = start_m + fed_m - 0.5 * h - angle / curvature;
    assert!((found_m - late_m).abs() < 0.1 * late_m, "late by {found_m} m instead of {late_m} m");
}

const RATIO: f64 = 2.0;
const RELAXATION_S: f64 = 0.2;
const SOON_S: f64 = 0.1;

/// A standard linear solid, whose bends creep in (1 + r) times the time in which its moments relax.
const RELAXING: &[(&str, f64)] = &[
    ("effects.instrument.viscoelastic.ratio", RATIO),
    ("effects.instrument.viscoelastic.relaxation_s", RELAXATION_S),
];

/// Height of the tip at rest, then [`SOON_S`] after `loads` began to act, and when they have acted for long \[m\].
fn creeps(mut description: Description<f64>, loads: &Loads<f64>) -> [f64; 3] {
    description.solver.drag = Drag::constant(0.01);
    let ticks = |time_s: f64| (time_s / description.solver.tick_s).round() as u32;
    let (soon, late) = (ticks(SOON_S), ticks(20.0 * RELAXATION_S));
    let model: Model<f64> = Model::new(description).unwrap();
    let (none, mut state, drive) = (free_space(), State::new(), inserted(LENGTH_M - 1e-3));
    while !settle_loaded(&model, &none.lumen(), &mut state, drive, &FREE_TIP) {}
    let mut heights = [state.node_position_m(0).unwrap()[2]; 3];
    for (height, ticks) in heights[1..].iter_mut().zip([soon, late]) {
        for _ in 0..ticks {
            step_loaded(&model, &none.lumen(), &mut state, drive, loads);
        }
        *height = state.node_position_m(0).unwrap()[2];
    }
    heights
}

/// docs/explanation/model.md (54), (55)
#[test]
fn a_relaxing_instrument_gives_way_to_a_load_at_once_and_then_slowly() {
    let loads = Loads { tip_moment_n_m: [0.0, -STIFFNESS * 0.5, 0.0], ..FREE_TIP };
    let [at_rest, soon, late] = creeps(with(rod(LENGTH_M, 40, STIFFNESS), RELAXING), &loads);
    let [_, _, elastic] = creeps(rod(LENGTH_M, 40, STIFFNESS), &loads);
    assert!(at_rest.abs() < 1e-9 && elastic > 1e-3, "{at_rest} {elastic}");
    assert!((late / elastic - 1.0).abs() < 0.01, "{late} {elastic}");
    let left = RATIO / (1.0 + RATIO) * (-SOON_S / ((1.0 + RATIO) * RELAXATION_S)).exp();
    assert!((soon / elastic - (1.0 - left)).abs() < 0.02, "{soon} {elastic} {left}");
}

/// docs/explanation/model.md (56)
#[test]
fn a_tip_that_crept_in_its_package_comes_back() {
    let packed_share = 0.6;
    let packed = [RELAXING, &[("effects.instrument.viscoelastic.packed_share", packed_share)]];
    // The steps to rest are too damped for a softer one.
    let mut stiff = rod(LENGTH_M, 40, 1e-2);
    stiff.instrument.precurve = bent().instrument.precurve;
    let [_, _, whole] = creeps(stiff.clone(), &FREE_TIP);
    let [at_rest, soon, late] = creeps(with(stiff, &packed.concat()), &FREE_TIP);
    // An arc of 1 rad whole.
    let height = |share: f64| (1.0 - share.cos()) / share / (1.0 - 1f64.cos());
    let is = |found: f64, share: f64| {
        assert!((found / whole - height(share)).abs() < 0.01, "{found} of {whole}, {share}");
    };
    let missing = RATIO * packed_share / (1.0 + RATIO);
    is(at_rest, 1.0 - missing);
    is(late, 1.0);
    let left = missing * (-SOON_S / ((1.0 + RATIO) * RELAXATION_S)).exp();
    is(soon, 1.0 - left);
}

/// docs/explanation/model.md (8)
#[test]
fn a_viscous_instrument_twists_at_once() {
    let torque_n_m = 0.2 * 0.7 * STIFFNESS / LENGTH_M;
    let loads = Loads { tip_moment_n_m: [torque_n_m, 0.0, 0.0], ..FREE_TIP };
    let azimuth = |tip: [f64; 3]| tip[1].atan2(tip[2]);
    let settled = azimuth(hang(bent(), &loads).0) - azimuth(hang(bent(), &FREE_TIP).0);
    let (mut state, _) = hung(with(bent(), VISCOUS), &FREE_TIP);
    let model = Model::new(with(bent(), VISCOUS)).unwrap();
    let (wall, before) = (free_space(), azimuth(state.node_position_m(0).unwrap()));
    // A fifth of the viscous time.
    for _ in 0..20 {
        step_loaded(&model, &wall.lumen(), &mut state, inserted(LENGTH_M), &loads);
    }
    let turned = azimuth(state.node_position_m(0).unwrap()) - before;
    assert!((turned / settled - 1.0).abs() < 0.2, "{turned} rad of {settled} rad");
}

/// docs/explanation/model.md (8), (44)
///
/// A viscous shaft that winds up behind the guide comes to rest under a dead torque at the device's tick, in
/// the same state as without viscosity, because the torque is given.
#[test]
fn a_viscous_shaft_that_winds_up_comes_to_rest_at_the_devices_tick() {
    let (torque, free_m) = (2e-6, 0.5);
    let loads = Loads { tip_moment_n_m: [torque, 0.0, 0.0], ..FREE_TIP };
    for time_s in [0.0, 5e-4, 2e-3, 1e-2] {
        let mut description = with(
            bent(),
            &[
                ("effects.instrument.torsional_windup.free_length_m", free_m),
                ("effects.instrument.viscoelastic.time_s", time_s),
            ],
        );
        (description.solver.tick_s, description.solver.drag) = (1e-3, Drag::constant(0.05));
        let model: Model<f64> = Model::new(description).unwrap();
        let (none, mut state) = (free_space(), State::new());
        let drive = inserted(LENGTH_M - 1e-3);
        while !settle_loaded(&model, &none.lumen(), &mut state, drive, &loads) {}
        let mut found = Outputs::default();
        for _ in 0..1000 {
            found = step_loaded(&model, &none.lumen(), &mut state, drive, &loads);
        }
        let off = (found.drive_torque_n_m + torque).abs() / torque;
        assert!(off < 1e-3 && !found.unresolved, "τ {time_s} s: off by {off}: {found:?}");
    }
}
