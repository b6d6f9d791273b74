//! Drives whose effects are known: made here, and the measured one of `../shared` when it is
//! there, with effects taken out of the model and put into the data.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use cathforce_gap::Altered;
use cathforce_gap::diagnose;
use cathforce_gap::drive::{Drive, DriveError, Spiking};
use cathforce_gap::plant::Plant;
use cathforce_gap::report::{Diagnosis, NamedEffect, Verdict};
use cathforce_gap::spike::Spike;
use cathforce_rig::Bundle;
use cathforce_rig::bundle::{DriveTrial, TrialData};
use tempfile::TempDir;

const MASS_KG: f64 = 20.0;
const DT_S: f64 = 1e-3;
const NOISE_N: f64 = 0.05;

/// One instant of a made drive.
struct Instant {
    position_m: f64,
    velocity_m_per_s: f64,
    acceleration_m_per_s2: f64,
}

/// A smooth motion there and back with many speeds; every `period_s` it repeats itself.
fn motion(t_s: f64, period_s: f64, stroke_m: f64) -> Instant {
    let rate = std::f64::consts::TAU / period_s;
    // Two sines of whole-number rates.
    let wave = |n: f64, share: f64| {
        let (sin, cos) = (rate * n * t_s).sin_cos();
        let a = stroke_m * share;
        (a * sin, a * rate * n * cos, -a * (rate * n).powi(2) * sin)
    };
    let (p, q) = (wave(1.0, 1.0), wave(3.0, 0.4));
    Instant { position_m: p.0 + q.0, velocity_m_per_s: p.1 + q.1, acceleration_m_per_s2: p.2 + q.2 }
}

/// Noise from a hash, the same in every run: the sum of four uniform numbers.
fn noise(seed: u64) -> f64 {
    let uniform = |k: u64| {
        let mut x = seed.wrapping_mul(4).wrapping_add(k).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        x ^= x >> 32;
        x = x.wrapping_mul(0xD6E8_FEB8_6659_FD93);
        x ^= x >> 32;
        (x >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    (0..4).map(uniform).sum::<f64>() * 3.0_f64.sqrt()
}

/// A bundle of trials of two periods of these lengths and strokes, whose command is the mass's
/// inertia and `force`; `delay_s` after the force the position is reported.
fn bundle(
    trials: &[(f64, f64)],
    delay_s: f64,
    cycles: f64,
    force: impl Fn(f64, &Instant) -> f64,
) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let rig = format!(
        "format = \"trial-bundle/1\"\nname = \"made\"\nplant = \"drive\"\n[drive]\nmoving_mass_kg = {MASS_KG:?}\n[sensor]\nposition_noise_sd_m = 1e-9\n"
    );
    std::fs::write(folder.path().join("rig.toml"), rig).unwrap();
    std::fs::create_dir(folder.path().join("trials")).unwrap();
    for (number, &(period_s, stroke_m)) in trials.iter().enumerate() {
        let mut text = String::from("t_s,setpoint_m,position_m,drive_command_N\n");
        for i in 0..(cycles * period_s / DT_S) as u64 {
            let t_s = i as f64 * DT_S;
            let now = motion(t_s, period_s, stroke_m);
            let seen = motion(t_s - delay_s, period_s, stroke_m);
            let command = MASS_KG * now.acceleration_m_per_s2
                + force(t_s, &now)
                + NOISE_N * noise(i + 100_000 * number as u64);
            writeln!(text, "{t_s},{},{},{command}", now.position_m, seen.position_m).unwrap();
        }
        std::fs::write(folder.path().join(format!("trials/{number:03}.csv")), text).unwrap();
    }
    folder
}

fn ask(folder: &Path) -> Diagnosis {
    let bundle = Bundle::open(folder).unwrap();
    diagnose(&Drive::new(&bundle).unwrap(), "made", &|_| {})
}

fn names(answer: &Diagnosis) -> Vec<&str> {
    answer.effects.iter().map(|effect| effect.id.as_str()).collect()
}

fn value(effect: &NamedEffect, name: &str) -> f64 {
    effect.parameters[name].value
}

const TWO: [(f64, f64); 2] = [(2.5, 0.05), (2.5, 0.05)];

fn coulomb(_: f64, now: &Instant) -> f64 {
    6.0 * now.velocity_m_per_s.signum()
}

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
    let again = ask(folder.path());
    assert_eq!(answer, again, "the same data give the same answer");
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

#[test]
fn a_regime_that_training_lacks_is_not_scored() {
    // The second trial is four times as fast throughout.
    let answer = ask(bundle(&[(6.0, 0.05), (1.5, 0.05)], 0.0, 2.0, coulomb).path());
    assert!(answer.remarks.iter().any(|remark| remark.contains("regime")), "{:?}", answer.remarks);
    assert!(
        names(&answer).iter().all(|id| *id != "sensor.drift"),
        "a split by speed must not look like drift: {}",
        answer.sentence()
    );
}

#[test]
fn one_trial_without_cycles_carries_no_verdict() {
    let answer = ask(bundle(&[(2.5, 0.05)], 0.0, 1.5, coulomb).path());
    // Without a whole repetition the trial is cut into equal parts, which is said.
    assert!(
        answer.remarks.iter().any(|remark| remark.contains("one trial")),
        "{:?}",
        answer.remarks
    );
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
        assert!((found / truth - 1.0).abs() < within, "{id}.{name}: {found} for {truth}");
    }
    let shrinks: Vec<f64> = answer.effects.iter().map(|effect| effect.shrink).collect();
    assert!(shrinks.iter().all(|shrink| *shrink > -1e-3), "{shrinks:?}");
    let rests = |remark: &&String| remark.contains("% of the time, where friction holds any force");
    assert_eq!(answer.remarks.iter().filter(rests).count(), 3, "{:?}", answer.remarks);
}

#[test]
fn a_force_that_differs_from_end_to_end_is_no_ripple() {
    let answer = ask(bundle(&TWO, 0.0, 2.0, |_, now| 150.0 * now.position_m).path());
    assert_eq!(answer.verdict, Verdict::Unknown, "{}", answer.sentence());
}

#[test]
fn without_a_set_point_the_floor_is_the_noise_of_the_rows() {
    let folder = bundle(&TWO, 0.0, 2.0, |_, _| 0.0);
    for trial in ["000", "001"] {
        let path = folder.path().join(format!("trials/{trial}.csv"));
        let text = std::fs::read_to_string(&path).unwrap();
        let without = |line: &str| {
            let fields: Vec<&str> = line.split(',').collect();
            [fields[0], fields[2], fields[3]].join(",") + "\n"
        };
        std::fs::write(&path, text.lines().map(without).collect::<String>()).unwrap();
    }
    let answer = ask(folder.path());
    assert_eq!(answer.verdict, Verdict::NoGap, "{}", answer.sentence());
    let said = |remark: &&String| remark.contains("the noise of drive_command_N is not stated");
    assert_eq!(answer.remarks.iter().filter(said).count(), 1, "{:?}", answer.remarks);
}

#[test]
fn runs_of_one_set_point_are_repeats_of_each_other() {
    // One cycle a trial: nothing is repeated within.
    let drive = |trials: &[(f64, f64)]| {
        let folder = bundle(trials, 0.0, 1.0, coulomb);
        let plant = Drive::new(&Bundle::open(folder.path()).unwrap()).unwrap();
        plant.repeats().iter().map(|r| (r.first.0, r.second.0)).collect::<Vec<_>>()
    };
    let same = drive(&[(2.5, 0.05), (2.5, 0.05), (2.5, 0.04)]);
    assert!(!same.is_empty() && same.iter().all(|pair| *pair == (0, 1)), "{same:?}");
    assert!(drive(&[(2.5, 0.05), (2.0, 0.05)]).is_empty());
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

#[test]
fn a_jump_of_the_clock_is_said_and_left_out() {
    let folder = bundle(&TWO, 0.0, 2.0, coulomb);
    let file = folder.path().join("trials/001.csv");
    let text = std::fs::read_to_string(&file).unwrap();
    let kept: Vec<&str> = text
        .lines()
        .enumerate()
        .filter(|(i, _)| !(1500..1700).contains(i))
        .map(|(_, l)| l)
        .collect();
    std::fs::write(&file, kept.join("\n")).unwrap();
    let answer = ask(folder.path());
    assert!(answer.remarks.iter().any(|remark| remark.contains("clock jumps")));
    assert_eq!(names(&answer)[..1], ["drive.coulomb"], "{}", answer.sentence());
}

/// Changes the fields of every row of all trials: t_s, setpoint_m, position_m, drive_command_N.
fn rewritten(folder: &Path, change: impl Fn(usize, &mut Vec<String>)) {
    for name in ["trials/000.csv", "trials/001.csv"] {
        let file = folder.join(name);
        let text = std::fs::read_to_string(&file).unwrap();
        let changed = text.lines().enumerate().map(|(row, line)| {
            let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
            if row > 0 {
                change(row, &mut fields);
            }
            fields.join(",") + "\n"
        });
        let changed: String = changed.collect();
        std::fs::write(&file, changed).unwrap();
    }
}

#[test]
fn a_row_that_was_misread_is_named_and_changes_nothing() {
    let folder = bundle(&TWO, 0.0, 2.0, coulomb);
    rewritten(folder.path(), |row, fields| {
        if row == 2000 {
            fields[2] = "0".to_owned();
        }
    });
    let answer = ask(folder.path());
    assert_eq!(names(&answer), ["drive.coulomb"], "{}", answer.sentence());
    let dry = value(&answer.effects[0], "force_n");
    assert!((dry / 6.0 - 1.0).abs() < 0.05, "{dry}");
    let said = |remark: &&String| remark.contains("position_m of one row at 1.999 s");
    assert_eq!(answer.remarks.iter().filter(said).count(), 2, "{:?}", answer.remarks);
}

#[test]
fn columns_that_are_swapped_carry_no_verdict() {
    let folder = bundle(&TWO, 0.0, 2.0, coulomb);
    rewritten(folder.path(), |_, fields| fields.swap(2, 3));
    let answer = ask(folder.path());
    assert_eq!(answer.verdict, Verdict::Unknown);
    assert!(answer.remarks.iter().any(|r| r.contains("swapped")), "{:?}", answer.remarks);
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
    assert!((dry / 6.0 - 1.0).abs() < 0.05, "{dry}");
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
    assert_eq!(answer.verdict, Verdict::Unknown, "{}", answer.sentence());
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
fn a_command_that_is_nothing_is_refused() {
    let folder = bundle(&TWO, 0.0, 2.0, coulomb);
    rewritten(folder.path(), |_, fields| fields[3] = "0".to_owned());
    let refused = Drive::new(&Bundle::open(folder.path()).unwrap()).err();
    assert_eq!(refused, Some(DriveError::NoCommand));
}

#[test]
fn a_command_in_millinewtons_carries_no_verdict() {
    let folder = bundle(&TWO, 0.0, 2.0, |_, _| 0.0);
    rewritten(folder.path(), |_, fields| {
        fields[3] = format!("{}", 1e3 * fields[3].parse::<f64>().unwrap());
    });
    let answer = ask(folder.path());
    assert_eq!(answer.verdict, Verdict::Unknown);
    assert!(answer.effects.is_empty());
    assert!(answer.remarks.iter().any(|remark| remark.contains("unit")), "{:?}", answer.remarks);
}

/// The drive's columns of a trial.
fn columns(trial: &mut cathforce_rig::Trial) -> &mut DriveTrial {
    let TrialData::Drive(data) = &mut trial.data else { panic!("a drive's trial") };
    data
}

/// Reads positions in steps.
fn read_in_steps(bundle: &mut Bundle, step_m: f64) {
    for trial in &mut bundle.trials {
        columns(trial).position_m.iter_mut().for_each(|x| *x = (*x / step_m).round() * step_m);
    }
}

/// Keeps every so many rows.
fn thin(bundle: &mut Bundle, every: usize) {
    for trial in &mut bundle.trials {
        let kept = |column: &[f64]| column.iter().step_by(every).copied().collect();
        trial.t_s = kept(&trial.t_s);
        let data = columns(trial);
        data.position_m = kept(&data.position_m);
        data.drive_command_n = kept(&data.drive_command_n);
        data.setpoint_m =
            data.setpoint_m.as_ref().map(|own| own.iter().step_by(every).copied().collect());
    }
}

#[test]
fn a_floor_that_hides_friction_is_no_verdict() {
    // Friction of 1 % of the force, and an encoder that leaves open three times as much.
    let folder = bundle(&TWO, 0.0, 2.0, |_, now| 0.2 * now.velocity_m_per_s.signum());
    let mut bundle = Bundle::open(folder.path()).unwrap();
    read_in_steps(&mut bundle, 1e-5);
    bundle.trials.iter_mut().for_each(|trial| columns(trial).setpoint_m = None);
    let answer = diagnose(&Drive::new(&bundle).unwrap(), "made", &|_| {});
    assert_eq!(answer.verdict, Verdict::Unknown, "{:?}", answer.gap);
    assert!(answer.effects.is_empty());
    let said = |remark: &String| remark.contains("finer encoder");
    assert!(answer.remarks.iter().any(said), "{:?}", answer.remarks);
}

/// Fits that smooth what the encoder's steps leave in the prediction are no latency of the drive.
#[test]
fn steps_of_an_encoder_are_neither_a_latency_nor_a_time_constant() {
    for step_m in [1e-5, 3e-5] {
        let folder = bundle(&TWO, 0.0, 2.0, coulomb);
        let mut bundle = Bundle::open(folder.path()).unwrap();
        read_in_steps(&mut bundle, step_m);
        bundle.trials.iter_mut().for_each(|trial| columns(trial).setpoint_m = None);
        let answer = diagnose(&Drive::new(&bundle).unwrap(), "made", &|_| {});
        assert_eq!(names(&answer), ["drive.coulomb"], "{step_m}: {}", answer.sentence());
    }
}

/// The measured axis, when it is there.
fn measured() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/emps-drive");
    path.exists().then_some(path)
}

/// What the authors of the data documented, `PROVENANCE.md` beside it.
const COULOMB_N: f64 = 20.3935;
const VISCOUS_N_S_PER_M: f64 = 203.5034;
const OFFSET_N: f64 = -3.1648;
const DOCUMENTED: [(&str, &str, f64); 3] = [
    ("drive.coulomb", "force_n", COULOMB_N),
    ("drive.viscous", "n_s_per_m", VISCOUS_N_S_PER_M),
    ("drive.offset", "force_n", OFFSET_N),
];

#[test]
fn documented_friction_is_recovered_from_real_measurements() {
    let Some(path) = measured() else { return };
    let answer = ask(&path);
    assert_eq!(answer.verdict, Verdict::Named);
    for (id, name, documented) in DOCUMENTED {
        let effect = answer.effects.iter().find(|e| e.id == id);
        let found = value(effect.unwrap_or_else(|| panic!("{id}: {}", answer.sentence())), name);
        assert!((found / documented - 1.0).abs() < 0.05, "{id}: {found} for {documented}");
    }
    // Frozen on the other record.
    for held_out in &answer.details.held_out {
        assert!(held_out.before_n > 37.0 && held_out.after_n < 3.4, "{held_out:?}");
    }
    assert!(answer.confusable.iter().any(|set| set.contains(&"sensor.bias".to_owned())));
}

#[test]
fn rows_that_are_far_apart_are_refused_or_say_the_same() {
    let Some(path) = measured() else { return };
    let whole = Bundle::open(path).unwrap();
    for every in [21, 25, 40] {
        let mut bundle = whole.clone();
        thin(&mut bundle, every);
        let refused = Drive::new(&bundle).err();
        assert!(matches!(refused, Some(DriveError::TooSeldom { .. })), "{every}: {refused:?}");
    }
    // Of every twentieth row, at 50 Hz, the smallest of the three is hidden by the floor.
    for (stated, every, found) in [(None, 10, 3), (Some(1e-6), 10, 3), (None, 20, 2)] {
        let mut bundle = whole.clone();
        bundle.rig.sensor.position_noise_sd_m = stated;
        thin(&mut bundle, every);
        let answer = diagnose(&Drive::new(&bundle).unwrap(), "thin", &|_| {});
        println!("every {every}: {}", answer.sentence());
        assert_eq!(answer.verdict, Verdict::Named, "{stated:?}: {}", answer.sentence());
        for (id, name, documented) in &DOCUMENTED[..found] {
            let effect = answer.effects.iter().find(|effect| effect.id == *id);
            let effect = effect.unwrap_or_else(|| panic!("{id}: {}", answer.sentence()));
            let found = value(effect, name);
            assert!((found / documented - 1.0).abs() < 0.05, "{id}: {found} for {documented}");
        }
    }
}

#[test]
fn an_effect_taken_out_of_the_model_is_found_in_real_data() {
    let Some(path) = measured() else { return };
    let bundle = Bundle::open(path).unwrap();
    let drive = Drive::new(&bundle).unwrap();
    let offset: (&str, &[f64]) = ("drive.offset", &[OFFSET_N]);
    let dry: (&str, &[f64]) = ("drive.coulomb", &[COULOMB_N]);
    let viscous: (&str, &[f64]) = ("drive.viscous", &[VISCOUS_N_S_PER_M]);
    for (kept, removed) in [([offset, viscous], "drive.coulomb"), ([offset, dry], "drive.viscous")]
    {
        let answer = diagnose(&Altered::assuming(&drive, &kept), "ablation", &|_| {});
        assert_eq!(answer.verdict, Verdict::Named, "{removed}: {}", answer.sentence());
        assert_eq!(names(&answer)[0], removed, "{}", answer.sentence());
    }
    // The smallest of them is beside 2 N that nothing explains, and only a part of what is there
    // then; that a bias of the measurement explains as much speaks not against it.
    let answer = diagnose(&Altered::assuming(&drive, &[dry, viscous]), "ablation", &|_| {});
    assert_eq!(answer.verdict, Verdict::Partial, "{}", answer.sentence());
    assert_eq!(names(&answer), ["drive.offset"], "{}", answer.sentence());
    assert!(answer.confusable[0].contains(&"sensor.bias".to_owned()), "{:?}", answer.confusable);
}

#[test]
fn effects_are_put_in_beside_what_is_there() {
    let Some(path) = measured() else { return };
    let bundle = Bundle::open(path).unwrap();
    let spiking = Spiking::new(&bundle).unwrap();
    for (id, name, there) in
        [("drive.coulomb", "force_n", 32.0), ("drive.viscous", "n_s_per_m", 360.0)]
    {
        let spike = Spike { id: id.to_owned(), parameters: vec![(name.to_owned(), there)] };
        let spiked = spiking.put_in(&[spike]).unwrap();
        let changed = spiked.changes.force_n.unwrap();
        assert!((5.0..20.0).contains(&changed), "{id}: {changed}");
        let answer = spiking.diagnose(&spiked.bundle).unwrap();
        assert_eq!(names(&answer), [id], "{}", answer.sentence());
        let found = value(&answer.effects[0], name);
        assert!((found / there - 1.0).abs() < 0.05, "{id}: {found} for {there}");
    }
}

#[test]
fn an_effect_put_into_real_data_is_found() {
    let Some(path) = measured() else { return };
    let mut bundle = Bundle::open(path).unwrap();
    // More viscous friction, by differences of the recorded position.
    const ADDED_N_S_PER_M: f64 = 150.0;
    for trial in &mut bundle.trials {
        let t_s = trial.t_s.clone();
        let data = columns(trial);
        let reach = 10;
        for i in reach..t_s.len() - reach {
            let speed = (data.position_m[i + reach] - data.position_m[i - reach])
                / (t_s[i + reach] - t_s[i - reach]);
            data.drive_command_n[i] += ADDED_N_S_PER_M * speed;
        }
    }
    let drive = Drive::new(&bundle).unwrap();
    let validated: [(&str, &[f64]); 3] = [
        ("drive.coulomb", &[COULOMB_N]),
        ("drive.viscous", &[VISCOUS_N_S_PER_M]),
        ("drive.offset", &[OFFSET_N]),
    ];
    let answer = diagnose(&Altered::assuming(&drive, &validated), "spike", &|_| {});
    assert_eq!(names(&answer)[0], "drive.viscous", "{}", answer.sentence());
    let found = value(&answer.effects[0], "n_s_per_m") - VISCOUS_N_S_PER_M;
    assert!((found / ADDED_N_S_PER_M - 1.0).abs() < 0.1, "{found}");
}

#[test]
fn a_poor_encoder_does_not_tell_two_frictions_apart_and_is_not_claimed_to() {
    const STEP_M: f64 = 1e-4;
    let Some(path) = measured() else { return };
    let mut bundle = Bundle::open(path).unwrap();
    read_in_steps(&mut bundle, STEP_M);
    let answer = diagnose(&Drive::new(&bundle).unwrap(), "poor", &|_| {});
    let both = ["drive.coulomb", "drive.viscous"];
    let tells = |set: &Vec<String>| both.iter().all(|id| set.iter().any(|own| own == id));
    assert!(answer.confusable.iter().any(tells), "{}", answer.sentence());
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
fn a_clock_that_jumps_far_ahead_costs_no_more_than_a_pause() {
    let folder = bundle(&[(2.0, 0.05), (2.5, 0.04)], 0.0, 3.0, coulomb);
    let mut bundle = Bundle::open(folder.path()).unwrap();
    // As of a clock that was set while it recorded.
    for trial in &mut bundle.trials {
        let middle = trial.t_s.len() / 2;
        trial.t_s[middle..].iter_mut().for_each(|t| *t += 1.7e9);
    }
    let answer = diagnose(&Drive::new(&bundle).unwrap(), "jumps", &|_| {});
    assert_eq!(names(&answer), ["drive.coulomb"], "{}", answer.sentence());
    let said = |remark: &String| remark.contains("clock jumps by 1700000000.001 s after 2.999 s");
    assert!(answer.remarks.iter().any(said), "{:?}", answer.remarks);
}

#[test]
fn a_drive_that_only_trembles_is_refused() {
    let folder = bundle(&[(2.0, 0.05)], 0.0, 2.0, coulomb);
    let mut bundle = Bundle::open(folder.path()).unwrap();
    for trial in &mut bundle.trials {
        let data = columns(trial);
        let shake = |(row, x): (usize, &mut f64)| *x = 0.1 + 1e-6 * noise(row as u64);
        data.position_m.iter_mut().enumerate().for_each(shake);
    }
    assert_eq!(Drive::new(&bundle).err(), Some(DriveError::NothingCompared));
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

#[test]
fn trials_of_one_speed_each_are_held_out_in_parts() {
    // To and fro at a constant speed, every trial at its own.
    let folder = bundle(&[(2.0, 0.05)], 0.0, 1.0, coulomb);
    let mut bundle = Bundle::open(folder.path()).unwrap();
    let first = bundle.trials[0].clone();
    bundle.trials = [0.02, 0.05, 0.09]
        .into_iter()
        .zip(0..)
        .map(|(speed_m_per_s, number)| {
            let mut trial = first.clone();
            trial.number = number;
            trial.t_s = (0..8000).map(|i| f64::from(i) * DT_S).collect();
            // The turns are rounded: half a second of even deceleration.
            let turn = |phase: f64| (4.0 * (phase - 1.0).abs() - 2.0).clamp(-1.0, 1.0);
            let speeds: Vec<f64> =
                trial.t_s.iter().map(|t| speed_m_per_s * turn((t + 0.5) % 2.0)).collect();
            let position = |x: &mut f64, v: &f64| {
                *x += v * DT_S;
                Some(*x)
            };
            let data = columns(&mut trial);
            data.position_m = speeds.iter().scan(0.1, position).collect();
            let friction = |v: &f64| 6.0 * (v / 5e-4).tanh() + 40.0 * v;
            let accelerations = speeds.windows(2).map(|pair| (pair[1] - pair[0]) / DT_S);
            let forces = speeds.iter().zip(accelerations.chain([0.0])).enumerate();
            let command = |(i, (v, a)): (usize, (&f64, f64))| {
                MASS_KG * a + friction(v) + NOISE_N * noise(i as u64 + 100_000 * u64::from(number))
            };
            data.drive_command_n = forces.map(command).collect();
            data.setpoint_m = None;
            trial
        })
        .collect();
    let answer = diagnose(&Drive::new(&bundle).unwrap(), "speeds", &|_| {});
    println!("{} {:?} {:?}", answer.sentence(), answer.effects, answer.remarks);
    assert_eq!(names(&answer), ["drive.coulomb", "drive.viscous"], "{}", answer.sentence());
    for (effect, name, there) in
        [(&answer.effects[0], "force_n", 6.0), (&answer.effects[1], "n_s_per_m", 40.0)]
    {
        let found = value(effect, name);
        assert!((found / there - 1.0).abs() < 0.1, "{name}: {found} for {there}");
    }
    let said = |remark: &String| remark.contains("parts of all trials are held out");
    assert!(answer.remarks.iter().any(said), "{:?}", answer.remarks);
}

#[test]
fn a_clock_that_trembles_is_no_latency() {
    let folder = bundle(&[(2.0, 0.05), (2.5, 0.04), (3.0, 0.03)], 0.0, 2.0, coulomb);
    let mut bundle = Bundle::open(folder.path()).unwrap();
    for trial in &mut bundle.trials {
        let late_s = |row: usize| 0.25 * DT_S * noise(row as u64).clamp(-1.9, 1.9);
        trial.t_s.iter_mut().enumerate().for_each(|(row, t)| *t += late_s(row));
    }
    let answer = diagnose(&Drive::new(&bundle).unwrap(), "trembles", &|_| {});
    assert_eq!(names(&answer), ["drive.coulomb"], "{}", answer.sentence());
    let found = value(&answer.effects[0], "force_n");
    assert!((found / 6.0 - 1.0).abs() < 0.03, "{found}");
    let said = |remark: &&String| remark.contains("tremble by 0.2");
    assert_eq!(answer.remarks.iter().filter(said).count(), 3, "{:?}", answer.remarks);
}
