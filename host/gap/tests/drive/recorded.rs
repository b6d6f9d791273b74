//! How a drive was recorded: its clock, its rows, its encoder, and which trials there are.

use std::path::Path;

use cathforce_bundle::Bundle;
use cathforce_gap::diagnose;
use cathforce_gap::drive::{Drive, DriveError};
use cathforce_gap::plant::Plant as _;
use cathforce_gap::report::Verdict;

use crate::made::{
    DT_S, MASS_KG, NOISE_N, TWO, ask, bundle, columns, coulomb, names, noise, read_in_steps, value,
};

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

#[test]
fn a_command_that_is_nothing_is_refused() {
    let folder = bundle(&TWO, 0.0, 2.0, coulomb);
    rewritten(folder.path(), |_, fields| fields[3] = "0".to_owned());
    let refused = Drive::new(&Bundle::open(folder.path()).unwrap()).err();
    assert_eq!(refused, Some(DriveError::NoCommand { column: "drive_command_N" }));
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

#[test]
fn a_floor_that_hides_friction_is_no_verdict() {
    // Friction of 1 % of the force, and an encoder that leaves open three times as much.
    let folder = bundle(&TWO, 0.0, 2.0, |_, now| 0.2 * now.velocity_m_per_s.signum());
    let mut bundle = Bundle::open(folder.path()).unwrap();
    read_in_steps(&mut bundle, 5e-4);
    bundle.trials.iter_mut().for_each(|trial| columns(trial).setpoint = None);
    let answer = diagnose(&Drive::new(&bundle).unwrap(), "made", &cathforce_gap::unwatched);
    assert_eq!(answer.verdict, Verdict::Inconclusive, "{:?}", answer.gap);
    assert!(answer.effects.is_empty());
    let said = |remark: &String| remark.contains("finer encoder");
    assert!(answer.remarks.iter().any(said), "{} {:?}", answer.sentence(), answer.remarks);
}

/// Fits that smooth what the encoder's steps leave in the prediction are no latency of the drive.
#[test]
fn steps_of_an_encoder_are_neither_a_latency_nor_a_time_constant() {
    for step_m in [1e-5, 3e-5] {
        let folder = bundle(&TWO, 0.0, 2.0, coulomb);
        let mut bundle = Bundle::open(folder.path()).unwrap();
        read_in_steps(&mut bundle, step_m);
        bundle.trials.iter_mut().for_each(|trial| columns(trial).setpoint = None);
        let answer = diagnose(&Drive::new(&bundle).unwrap(), "made", &cathforce_gap::unwatched);
        assert_eq!(names(&answer), ["drive.coulomb"], "{step_m}: {}", answer.sentence());
    }
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
    let answer = diagnose(&Drive::new(&bundle).unwrap(), "jumps", &cathforce_gap::unwatched);
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
        data.position.iter_mut().enumerate().for_each(shake);
    }
    assert_eq!(Drive::new(&bundle).err(), Some(DriveError::NothingCompared));
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
            data.position = speeds.iter().scan(0.1, position).collect();
            let friction = |v: &f64| 6.0 * (v / 5e-4).tanh() + 40.0 * v;
            let accelerations = speeds.windows(2).map(|pair| (pair[1] - pair[0]) / DT_S);
            let forces = speeds.iter().zip(accelerations.chain([0.0])).enumerate();
            let command = |(i, (v, a)): (usize, (&f64, f64))| {
                MASS_KG * a + friction(v) + NOISE_N * noise(i as u64 + 100_000 * u64::from(number))
            };
            data.command = forces.map(command).collect();
            data.setpoint = None;
            trial
        })
        .collect();
    let answer = diagnose(&Drive::new(&bundle).unwrap(), "speeds", &cathforce_gap::unwatched);
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
    let answer = diagnose(&Drive::new(&bundle).unwrap(), "trembles", &cathforce_gap::unwatched);
    assert_eq!(names(&answer), ["drive.coulomb"], "{}", answer.sentence());
    let found = value(&answer.effects[0], "force_n");
    assert!((found / 6.0 - 1.0).abs() < 0.03, "{found}");
    let said = |remark: &&String| remark.contains("tremble by 0.2");
    assert_eq!(answer.remarks.iter().filter(said).count(), 3, "{:?}", answer.remarks);
}
