//! Drives whose effects are known.

mod kinds;
mod labs;
mod made;
mod measured;
mod recorded;

use std::fmt::Write as _;
use std::path::Path;

use cathforce_bundle::Bundle;
use cathforce_gap::drive::{Drive, Spiking};
use cathforce_gap::plant::Plant;
use cathforce_gap::report::{Diagnosis, Verdict};
use cathforce_gap::spike::Spike;

use made::{DT_S, Instant, MASS_KG, TWO, ask, bundle, coulomb, names, noise, value};

#[test]
fn nothing_added_is_no_gap() {
    let answer = ask(bundle(&TWO, 0.0, 2.0, |_, _| 0.0).path());
    assert_eq!(answer.verdict, Verdict::NoGap, "{answer:#?}");
    assert!(answer.effects.is_empty());
}

#[test]
fn coulomb_and_viscous_friction_are_named_with_their_size() {
    let force = |t: f64, now: &Instant| coulomb(t, now) + 30.0 * now.velocity_m_per_s;
    let folder = bundle(&TWO, 0.0, 2.0, force);
    let answer = ask(folder.path());
    assert_eq!(answer.verdict, Verdict::Named, "{}", answer.sentence());
    let find = |id: &str| answer.effects.iter().find(|effect| effect.id == id).unwrap();
    let dry = value(find("drive.coulomb"), "force_n");
    assert!((dry / 6.0 - 1.0).abs() < 0.05, "{dry}");
    let viscous = value(find("drive.viscous"), "n_s_per_m");
    assert!((viscous / 30.0 - 1.0).abs() < 0.05, "{viscous}");
    let again = Diagnosis { seconds: answer.seconds, ..ask(folder.path()) };
    assert!(answer == again, "the same data give the same answer");
}

/// A latency that the model lacks must not make another effect look right.
#[test]
fn a_latency_within_its_prior_is_a_nuisance() {
    let answer = ask(bundle(&TWO, 1e-3, 2.0, coulomb).path());
    assert_eq!(names(&answer)[..1], ["drive.coulomb"], "{}", answer.sentence());
    let dry = value(&answer.effects[0], "force_n");
    assert!((dry / 6.0 - 1.0).abs() < 0.05, "{dry}");
    assert!(!names(&answer).contains(&"drive.latency"));
}

#[test]
fn a_latency_far_outside_its_prior_is_named() {
    let answer = ask(bundle(&TWO, 0.02, 2.0, |_, _| 0.0).path());
    assert_eq!(names(&answer)[..1], ["drive.latency"], "{}", answer.sentence());
}

/// Every effect may stay off, so none may fit worse than the nominal model.
#[test]
fn no_single_effect_is_ranked_below_the_nominal_model() {
    let answer = ask(bundle(&TWO, 0.0, 2.0, coulomb).path());
    for ranked in &answer.ranking {
        assert!(ranked.shrink > -0.01, "{ranked:?}");
    }
    assert_eq!(answer.ranking[0].id, "drive.coulomb");
}

/// Rows of a bundle without a set-point: strokes to and fro of any length and speed with rests in
/// between; friction is a bristle that bends before it slides, sticks more than it slides, and keeps
/// its load at rest (Dahl's law with a Stribeck curve), beside a cogging and a constant force.
fn bristled(folder: &Path) {
    const COULOMB_N: f64 = 15.0;
    const STICKING_N: f64 = 8.0;
    const STRIBECK_M_PER_S: f64 = 0.01;
    const BENT_M: f64 = 6e-5;
    const VISCOUS_N_S_PER_M: f64 = 60.0;
    const COGGING_N: f64 = 3.0;
    const PITCH_M: f64 = 0.025;
    const CONSTANT_N: f64 = 5.0;
    const STROKES: [(f64, f64); 9] = [
        (0.08, 0.5),
        (-0.09, 0.9),
        (0.03, 0.6),
        (-0.05, 0.3),
        (0.09, 1.2),
        (-0.02, 0.8),
        (0.01, 0.4),
        (-0.08, 0.4),
        (0.06, 0.9),
    ];
    const REST_S: f64 = 0.3;
    for trial in 0..3 {
        let mut text = String::from("t_s,position_m,drive_command_N\n");
        let (mut at_m, mut bent, mut row) = (0.0, 0.0, 0_u64);
        for k in 0..STROKES.len() {
            let (to_m, stroke_s) = STROKES[(k + 4 * trial) % STROKES.len()];
            for i in 0..((stroke_s + REST_S) / DT_S) as u64 {
                let s = (i as f64 * DT_S / stroke_s).min(1.0);
                let distance = to_m - at_m;
                let position_m = at_m + distance * s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s);
                let speed = distance / stroke_s * 30.0 * s * s * (1.0 - s).powi(2);
                let acceleration =
                    distance / stroke_s.powi(2) * 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s);
                let most = COULOMB_N + STICKING_N * (-(speed / STRIBECK_M_PER_S).powi(2)).exp();
                // What a bristle bears turns over with the way.
                bent = speed.signum()
                    + (bent - speed.signum()) * (-(speed * DT_S).abs() / BENT_M).exp();
                let command = MASS_KG * acceleration
                    + most * bent
                    + VISCOUS_N_S_PER_M * speed
                    + COGGING_N * (std::f64::consts::TAU * position_m / PITCH_M).sin()
                    + CONSTANT_N
                    + 0.3 * noise(row + 100_000 * trial as u64);
                let seen = position_m + 1e-6 * noise(1_000_000 * (trial as u64 + 1) + row);
                writeln!(text, "{},{seen},{command}", row as f64 * DT_S).unwrap();
                row += 1;
            }
            at_m = to_m;
        }
        std::fs::write(folder.join(format!("trials/{trial:03}.csv")), text).unwrap();
    }
}

#[test]
fn friction_that_holds_at_rest_is_told_from_what_lies_beside_it() {
    let folder = bundle(&[], 0.0, 2.0, |_, _| 0.0);
    bristled(folder.path());
    let answer = ask(folder.path());
    assert_eq!(answer.verdict, Verdict::Named, "{}", answer.sentence());
    for (id, name, truth, within) in [
        ("drive.coulomb", "force_n", 15.0, 0.05),
        // It is found 7 % too long.
        ("drive.coulomb", "presliding_m", 6e-5, 0.1),
        ("drive.viscous", "n_s_per_m", 60.0, 0.05),
        ("drive.offset", "force_n", 5.0, 0.05),
        ("drive.ripple", "sine_n", 3.0, 0.05),
        ("drive.ripple", "wavelength_m", 0.025, 0.05),
    ] {
        let effect = answer.effects.iter().find(|e| e.id == id);
        let found = value(effect.unwrap_or_else(|| panic!("{id}: {}", answer.sentence())), name);
        assert!(
            (found / truth - 1.0).abs() < within,
            "{id}.{name}: {found} for {truth}: {}",
            answer.sentence()
        );
    }
    let shrinks: Vec<f64> = answer.effects.iter().map(|effect| effect.shrink).collect();
    assert!(shrinks.iter().all(|shrink| *shrink > -1e-3), "{shrinks:?}");
    let rests =
        |remark: &&String| remark.contains("% of the time; there static friction holds any force");
    assert_eq!(answer.remarks.iter().filter(rests).count(), 3, "{:?}", answer.remarks);
}

#[test]
fn a_force_that_differs_from_end_to_end_is_no_ripple() {
    let answer = ask(bundle(&TWO, 0.0, 2.0, |_, now| 150.0 * now.position_m).path());
    assert_eq!(answer.verdict, Verdict::Unknown, "{}", answer.sentence());
}

/// With a floor of almost nothing many small terms are significant; they must be called minor.
#[test]
fn what_hardly_matters_is_minor() {
    let force = |t: f64, now: &Instant| coulomb(t, now) + 0.12 * (now.position_m / 0.05);
    let answer = ask(bundle(&TWO, 0.0, 2.0, force).path());
    assert_eq!(answer.verdict, Verdict::Named, "{}", answer.sentence());
    for effect in &answer.effects {
        assert_eq!(effect.material, effect.id == "drive.coulomb", "{effect:?}");
    }
}

/// At 5 mm/s a turnover of friction over half a millimetre a second would look like more friction
/// at rest.
#[test]
fn friction_of_a_slow_axis_does_not_fall_as_motion_sets_in() {
    let force = |t: f64, now: &Instant| coulomb(t, now) + 400.0 * now.velocity_m_per_s;
    let answer = ask(bundle(&[(2.5, 1e-3), (2.5, 1e-3)], 0.0, 2.0, force).path());
    assert_eq!(answer.verdict, Verdict::Named, "{}", answer.sentence());
    assert!(!names(&answer).contains(&"drive.stribeck"), "{}", answer.sentence());
    let find = |id: &str| answer.effects.iter().find(|effect| effect.id == id).unwrap();
    let dry = value(find("drive.coulomb"), "force_n");
    assert!((dry / 6.0 - 1.0).abs() < 0.05, "{dry}: {}", answer.sentence());
}

/// No position tells the course of friction where it turns over, which is a few samples far off: they
/// must not decide the rest.
#[test]
fn friction_that_falls_as_motion_sets_in_is_found_though_it_turns_over_at_once() {
    let force = |_: f64, now: &Instant| {
        let v = now.velocity_m_per_s;
        (8.0 + 6.0 * (-(v / 0.02).powi(2)).exp()) * v.signum() + 20.0 * v
    };
    let answer = ask(bundle(&[(8.0, 0.05), (8.0, 0.05)], 0.0, 2.0, force).path());
    assert_eq!(answer.verdict, Verdict::Named, "{}", answer.sentence());
    for (id, name, truth, within) in [
        ("drive.coulomb", "force_n", 8.0, 0.02),
        ("drive.stribeck", "force_n", 6.0, 0.02),
        ("drive.stribeck", "speed_m_per_s", 0.02, 0.05),
        ("drive.viscous", "n_s_per_m", 20.0, 0.05),
    ] {
        let effect = answer.effects.iter().find(|e| e.id == id);
        let found = value(effect.unwrap_or_else(|| panic!("{id}: {}", answer.sentence())), name);
        println!("{id}.{name}: {found} for {truth}");
        assert!((found / truth - 1.0).abs() < within, "{id}.{name}: {found} for {truth}");
    }
}

#[test]
fn drag_that_goes_by_the_square_of_the_speed_is_none_of_the_effects() {
    let drag = |_: f64, now: &Instant| 60.0 * now.velocity_m_per_s * now.velocity_m_per_s.abs();
    let answer = ask(bundle(&TWO, 0.0, 2.0, drag).path());
    assert_ne!(answer.verdict, Verdict::Named, "{}", answer.sentence());
}

#[test]
fn what_another_mass_would_do_as_well_is_said() {
    let answer = ask(bundle(&TWO, 0.0, 2.0, |_, now| 5.0 * now.acceleration_m_per_s2).path());
    assert!(!answer.effects.is_empty(), "{}", answer.sentence());
    assert!(
        answer.remarks.iter().any(|r| r.contains("a moving mass of 25.0")),
        "{:?}",
        answer.remarks
    );
}

#[test]
fn nuisances_have_the_priors_that_the_rig_states() {
    let folder = bundle(&[(2.5, 0.05)], 0.0, 1.0, coulomb);
    let mut bundle = Bundle::open(folder.path()).unwrap();
    let sds = |bundle: &Bundle| -> Vec<f64> {
        Drive::new(bundle).unwrap().nuisances().iter().map(|nuisance| nuisance.sd).collect()
    };
    let usual = sds(&bundle);
    bundle.rig.priors.force_bias_sd_n = Some(2.0 * usual[0]);
    assert_eq!(sds(&bundle), [2.0 * usual[0], usual[1]]);
    bundle.rig.priors.time_shift_sd_s = Some(1e-3);
    assert_eq!(sds(&bundle), [2.0 * usual[0], 1e-3]);
}

#[test]
fn effects_are_put_into_the_trials_that_are_compared() {
    let folder = bundle(&[(2.0, 0.05), (2.5, 0.04), (3.0, 0.03)], 0.0, 2.0, coulomb);
    let mut bundle = Bundle::open(folder.path()).unwrap();
    let copy = bundle.trials[0].data.clone();
    let t_s = bundle.trials[0].t_s.clone();
    (bundle.trials[1].data, bundle.trials[1].t_s) = (copy, t_s);
    let spiking = Spiking::new(&bundle).unwrap();
    let spike = Spike { id: "drive.viscous".to_owned(), parameters: Vec::new() };
    let spiked = spiking.put_in(&[spike]).unwrap();
    let numbers: Vec<u32> = spiked.bundle.trials.iter().map(|trial| trial.number).collect();
    assert_eq!(numbers, [0, 2], "001 is a copy of 000");
    let answer = spiking.diagnose(&spiked.bundle).unwrap();
    assert_eq!(names(&answer), ["drive.viscous"], "{}", answer.sentence());
}
