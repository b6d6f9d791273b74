//! Kinds of recordings that labs have: few steps of speed, coarse encoders, other units.

use std::f64::consts::TAU;

use cathforce_bundle::Bundle;
use cathforce_bundle::bundle::Trial;
use cathforce_gap::diagnose;
use cathforce_gap::drive::Drive;
use cathforce_gap::report::{Diagnosis, Verdict};

use crate::made::{DT_S, MASS_KG, NOISE_N, TWO, bundle, columns, coulomb, names, noise, value};

/// Trials to and fro at some constant speeds each, by a force that depends on the speed; turns are half a
/// second of even deceleration.
fn steps_of_speed(speeds: &[&[f64]], force: impl Fn(f64) -> f64) -> Bundle {
    let folder = bundle(&[(2.0, 0.05)], 0.0, 1.0, coulomb);
    let mut bundle = Bundle::open(folder.path()).unwrap();
    let first = bundle.trials[0].clone();
    let trial = |(number, own): (u32, &&[f64])| {
        let mut trial: Trial = first.clone();
        trial.number = number;
        let rows = 4000 * own.len();
        trial.t_s = (0..rows).map(|i| i as f64 * DT_S).collect();
        let turn = |phase: f64| (4.0 * (phase - 1.0).abs() - 2.0).clamp(-1.0, 1.0);
        // Speeds change where it stands.
        let speed = |t: f64| own[(t / 4.0) as usize % own.len()] * turn((t + 0.5) % 2.0);
        let speeds: Vec<f64> = trial.t_s.iter().map(|t| speed(*t)).collect();
        let data = columns(&mut trial);
        let position = |x: &mut f64, v: &f64| {
            *x += v * DT_S;
            Some(*x)
        };
        data.position = speeds.iter().scan(0.1, position).collect();
        let accelerations = speeds.windows(2).map(|pair| (pair[1] - pair[0]) / DT_S).chain([0.0]);
        let command = |(i, (v, a)): (usize, (&f64, f64))| {
            MASS_KG * a + force(*v) + NOISE_N * noise(i as u64 + 100_000 * u64::from(number))
        };
        data.command = speeds.iter().zip(accelerations).enumerate().map(command).collect();
        data.setpoint = None;
        trial
    };
    bundle.trials = (0..).zip(speeds).map(trial).collect();
    bundle
}

fn answer(bundle: &Bundle) -> Diagnosis {
    let answer = diagnose(&Drive::new(bundle).unwrap(), "made", &cathforce_gap::unwatched);
    println!("{}\n{:?}\n{:#?}", answer.sentence(), answer.remarks, answer.effects);
    answer
}

/// Three terms of which one alone closes nine tenths of the gap: the search goes on.
#[test]
fn all_terms_of_few_steps_of_speed_are_named() {
    let friction = |v: f64| 35.0 * (v / 5e-4).tanh() + 70.0 * v + 7.0;
    let bundle =
        steps_of_speed(&[&[0.05, 0.15, 0.3], &[0.1, 0.2, 0.3], &[0.05, 0.2, 0.3]], friction);
    let answer = answer(&bundle);
    assert_eq!(answer.verdict, Verdict::Named, "{}", answer.sentence());
    for (id, name, there) in [
        ("drive.coulomb", "force_n", 35.0),
        ("drive.viscous", "n_s_per_m", 70.0),
        ("drive.offset", "force_n", 7.0),
    ] {
        let effect = answer.effects.iter().find(|effect| effect.id == id);
        let found = value(effect.unwrap_or_else(|| panic!("{id}: {}", answer.sentence())), name);
        assert!((found / there - 1.0).abs() < 0.05, "{id}: {found} for {there}");
    }
}

/// Neither a gain at its bound nor a backlash explains columns of another unit.
#[test]
fn columns_of_another_unit_name_no_gain_and_no_backlash() {
    let friction =
        |t: f64, now: &crate::made::Instant| coulomb(t, now) + 30.0 * now.velocity_m_per_s;
    for (amperes, degrees) in
        [(0.02, 1.0), (0.3, 1.0), (3.0, 1.0), (1.0, 360.0 / TAU), (0.5, 57.3), (8.0, 57.3)]
    {
        let folder = bundle(&TWO, 0.0, 2.0, friction);
        let mut bundle = Bundle::open(folder.path()).unwrap();
        for trial in &mut bundle.trials {
            let data = columns(trial);
            data.command.iter_mut().for_each(|f| *f *= amperes);
            data.position.iter_mut().for_each(|x| *x *= degrees);
            if let Some(setpoint) = &mut data.setpoint {
                setpoint.iter_mut().flatten().for_each(|x| *x *= degrees);
            }
        }
        println!("{amperes} A/N, {degrees} °/m");
        let answer = answer(&bundle);
        for id in ["sensor.gain", "drive.backlash", "drive.encoder_scale"] {
            assert!(!names(&answer).contains(&id), "{amperes} {degrees}: {}", answer.sentence());
        }
        assert_eq!(answer.verdict, Verdict::Unknown, "{amperes} {degrees}: {}", answer.sentence());
    }
}

/// A servo of 12 bit a turn: its friction is found, and the floor is what the true model leaves.
#[test]
fn a_coarse_encoder_has_a_band_of_its_own_and_a_floor_that_is_not_above_what_is_left() {
    for step_m in [1e-4, TAU / 4096.0 * 0.1] {
        let friction =
            |t: f64, now: &crate::made::Instant| coulomb(t, now) + 30.0 * now.velocity_m_per_s;
        let folder = bundle(&TWO, 0.0, 2.0, friction);
        let mut bundle = Bundle::open(folder.path()).unwrap();
        for trial in &mut bundle.trials {
            let data = columns(trial);
            data.position.iter_mut().for_each(|x| *x = (*x / step_m).round() * step_m);
            data.setpoint = None;
        }
        let answer = answer(&bundle);
        assert_eq!(answer.verdict, Verdict::Named, "{}", answer.sentence());
        let mut named = names(&answer);
        named.sort_unstable();
        assert_eq!(named, ["drive.coulomb", "drive.viscous"], "{}", answer.sentence());
        let figures = answer.gap.force_rms_n.unwrap();
        println!("{step_m}: floor {} left {}", figures.floor, figures.after);
        assert!(figures.floor < 1.2 * figures.after, "{step_m}: {figures:?}");
        let compared = &answer.details.compared;
        assert!(
            compared.contains("smoothed to 6 Hz") || compared.contains("smoothed to 5 Hz"),
            "{compared}"
        );
    }
}

/// Friction of a sixtieth of the inertial force, with an encoder of 10 µm whose steps are a floor of a third of it.
#[test]
fn friction_that_is_small_beside_the_inertia_is_named() {
    let friction = |_: f64, now: &crate::made::Instant| 0.2 * now.velocity_m_per_s.signum();
    let folder = bundle(&TWO, 0.0, 4.0, friction);
    let mut bundle = Bundle::open(folder.path()).unwrap();
    crate::made::read_in_steps(&mut bundle, 1e-5);
    bundle.trials.iter_mut().for_each(|trial| columns(trial).setpoint = None);
    let answer = answer(&bundle);
    assert_eq!(answer.verdict, Verdict::Named, "{}", answer.sentence());
    assert_eq!(names(&answer), ["drive.coulomb"], "{}", answer.sentence());
    let dry = &answer.effects[0].parameters["force_n"];
    assert!(dry.low < 0.2 && 0.2 < dry.high, "{dry:?}");
}

/// Of a long record, commands are predicted at fewer points, which is said, and what is found stays.
#[test]
fn a_long_record_is_predicted_at_fewer_points() {
    let friction =
        |t: f64, now: &crate::made::Instant| coulomb(t, now) + 30.0 * now.velocity_m_per_s;
    let folder = bundle(&[(3.5, 0.05), (4.0, 0.05)], 0.0, 10.0, friction);
    let answer = answer(&Bundle::open(folder.path()).unwrap());
    assert_eq!(answer.verdict, Verdict::Named, "{}", answer.sentence());
    assert!(answer.details.compared.contains("every 2 ms"), "{}", answer.details.compared);
    for (id, name, there) in
        [("drive.coulomb", "force_n", 6.0), ("drive.viscous", "n_s_per_m", 30.0)]
    {
        let effect = answer.effects.iter().find(|effect| effect.id == id).unwrap();
        let own = &effect.parameters[name];
        assert!(own.low < there && there < own.high, "{id}: {own:?}");
    }
}

/// A command whose sign is turned: friction would drive the motion, which is said.
#[test]
fn friction_that_drives_is_an_error_of_sign() {
    let driving = |v: f64| -35.0 * (v / 5e-4).tanh() - 70.0 * v + 7.0;
    let bundle = steps_of_speed(&[&[0.05, 0.15, 0.3], &[0.1, 0.2, 0.3]], driving);
    let answer = answer(&bundle);
    assert_eq!(answer.verdict, Verdict::Unknown, "{}", answer.sentence());
    assert!(answer.remarks.iter().any(|own| own.contains("sign")), "{:?}", answer.remarks);
}

/// Friction of an axis that warms up is named with its share, beside the friction that it changes.
#[test]
fn friction_that_falls_in_the_course_of_a_trial_is_a_drift_of_friction() {
    // Both trials last 8 s, and nothing repeats itself: what changes from run to run is no gap but the floor.
    let friction =
        |t: f64, now: &crate::made::Instant| coulomb(t, now) * (1.0 - 0.3 * (t / 4.0 - 1.0));
    let folder = bundle(&[(8.0, 0.1), (8.0, 0.06)], 0.0, 1.0, friction);
    let answer = answer(&Bundle::open(folder.path()).unwrap());
    let mut named = names(&answer);
    named.sort_unstable();
    assert_eq!(named, ["drive.coulomb", "drive.friction_drift"], "{}", answer.sentence());
    let drift = answer.effects.iter().find(|own| own.id == "drive.friction_drift").unwrap();
    let by_n = drift.parameters["force_n"].value;
    assert!((by_n / (-0.3 * 6.0) - 1.0).abs() < 0.05, "{by_n}");
}

/// A bristle turns friction round over 60 µm: that is the form of Dahl, with less friction at speed that of LuGre.
#[test]
fn dry_friction_that_bends_is_of_dahl_and_with_stribecks_fall_of_lugre() {
    for (excess, form) in [(0.0, "Dahl"), (0.5, "LuGre")] {
        let bend = std::cell::Cell::new((0.0_f64, 0.0_f64, -1.0_f64));
        let friction = |t: f64, now: &crate::made::Instant| {
            let (mut bent, mut last, before) = bend.get();
            if t < before {
                (bent, last) = (0.0, now.position_m);
            }
            let to = now.velocity_m_per_s.signum();
            bent = to + (bent - to) * (-(now.position_m - last).abs() / 6e-5).exp();
            bend.set((bent, now.position_m, t));
            let falls = excess * (-(now.velocity_m_per_s / 0.08).powi(2)).exp();
            6.0 * (1.0 + falls) * bent
        };
        let folder = bundle(&TWO, 0.0, 2.0, friction);
        let answer = answer(&Bundle::open(folder.path()).unwrap());
        let dry = answer.effects.iter().find(|own| own.id == "drive.coulomb");
        let dry = dry.unwrap_or_else(|| panic!("{}", answer.sentence()));
        assert_eq!(dry.form.as_ref().map(|own| own.name), Some(form), "{}", answer.sentence());
        let presliding = dry.parameters["presliding_m"].value;
        assert!((presliding / 6e-5 - 1.0).abs() < 0.3, "{presliding}");
    }
}
