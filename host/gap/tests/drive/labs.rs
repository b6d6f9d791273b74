//! Drives as labs have them: servos with a pendulum, motors with amperes or volts, known loads, slow rows.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::path::Path;

use cathforce_bundle::Bundle;
use cathforce_gap::diagnose;
use cathforce_gap::drive::{Drive, DriveError};
use cathforce_gap::report::{Diagnosis, Verdict};
use tempfile::TempDir;

use crate::made::{DT_S, noise, value};

/// Angle, speed and acceleration of a servo that swings by up to 1.4 rad at several speeds.
fn swing(t_s: f64, trial: u32) -> [f64; 3] {
    let slow = 0.35 + 0.05 * f64::from(trial);
    let wave = |rate: f64, size: f64| {
        let (sin, cos) = (TAU * rate * t_s).sin_cos();
        let w = TAU * rate;
        [size * sin, size * w * cos, -size * w * w * sin]
    };
    let (a, b) = (wave(slow, 1.0), wave(2.6 * slow, 0.4));
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// Writes a bundle of two trials of 12 s from rows of `(t, trial)`.
fn written(
    rig: &str,
    heading: &str,
    row: impl Fn(f64, u32) -> Vec<f64>,
    step_s: f64,
    long_s: f64,
) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let rig = format!("format = \"trial-bundle/1\"\nname = \"made\"\nplant = \"drive\"\n{rig}");
    std::fs::write(folder.path().join("rig.toml"), rig).unwrap();
    std::fs::create_dir(folder.path().join("trials")).unwrap();
    for trial in 0..2 {
        let mut text = format!("t_s,{heading}\n");
        for i in 0..(long_s / step_s) as u64 {
            let t_s = i as f64 * step_s;
            let fields: Vec<String> = row(t_s, trial).iter().map(f64::to_string).collect();
            writeln!(text, "{t_s},{}", fields.join(",")).unwrap();
        }
        std::fs::write(folder.path().join(format!("trials/{trial:03}.csv")), text).unwrap();
    }
    folder
}

fn ask(folder: &Path) -> Diagnosis {
    let bundle = Bundle::open(folder).unwrap();
    let answer = diagnose(&Drive::new(&bundle).unwrap(), "made", &cathforce_gap::unwatched);
    println!("{}\n{:?}\n{}", answer.sentence(), answer.remarks, answer.details.compared);
    answer
}

/// Checks that these effects are named with these values, within shares of them, and no other.
fn named(answer: &Diagnosis, truth: &[(&str, &str, f64, f64)]) {
    assert_eq!(answer.verdict, Verdict::Named, "{}", answer.sentence());
    for &(id, name, there, within) in truth {
        let effect = answer.effects.iter().find(|effect| effect.id == id);
        let found = value(effect.unwrap_or_else(|| panic!("{id}: {}", answer.sentence())), name);
        assert!((found / there - 1.0).abs() < within, "{id}.{name}: {found} for {there}");
    }
    for effect in &answer.effects {
        assert!(truth.iter().any(|(id, ..)| *id == effect.id), "{}", answer.sentence());
    }
}

const INERTIA_KG_M2: f64 = 0.012;
const MASS_KG: f64 = 0.5;
const LENGTH_M: f64 = 0.15;
const GRAVITY: f64 = 9.806_65;
/// A turn of a 12-bit encoder.
const STEP_RAD: f64 = TAU / 4096.0;
const PENDULUM: &str = "[drive]\nmoving_inertia_kg_m2 = 0.012\n[drive.pendulum]\nmass_kg = 0.5\nlength_m = 0.15\nhangs_at_rad = 0.3\n";

/// Torque of a servo whose friction grows with the load that it carries.
fn servo_nm(t_s: f64, trial: u32, per_load: f64) -> (f64, f64) {
    let [angle, speed, acceleration] = swing(t_s, trial);
    let weight = MASS_KG * GRAVITY * LENGTH_M * (angle - 0.3).sin();
    let carried = INERTIA_KG_M2 * acceleration + weight;
    let friction = (0.08 + per_load * carried.abs()) * (speed / 0.005).tanh() + 0.05 * speed;
    (angle, carried + friction)
}

#[test]
fn a_servo_with_a_pendulum_and_a_coarse_encoder_shows_its_friction() {
    let row = |t_s: f64, trial: u32| {
        let (angle, torque) = servo_nm(t_s, trial, 0.0);
        let seen = (angle / STEP_RAD).round() * STEP_RAD;
        vec![seen, torque + 2e-3 * noise((t_s / DT_S) as u64 + 100_000 * u64::from(trial))]
    };
    let answer = ask(written(PENDULUM, "position_rad,drive_command_Nm", row, DT_S, 12.0).path());
    named(
        &answer,
        &[("drive.coulomb", "torque_nm", 0.08, 0.1), ("drive.viscous", "nm_s_per_rad", 0.05, 0.1)],
    );
    let said = answer.sentence();
    assert!(said.contains("N·m·s/rad") && said.contains("mN·m on data"), "{said}");
    assert!(!said.contains(" mm"), "{said}");
}

#[test]
fn friction_that_goes_by_the_load_is_told_from_that_of_constant_size() {
    let row = |t_s: f64, trial: u32| {
        let (angle, torque) = servo_nm(t_s, trial, 0.2);
        vec![angle, torque + 2e-3 * noise((t_s / DT_S) as u64 + 100_000 * u64::from(trial))]
    };
    let answer = ask(written(PENDULUM, "position_rad,drive_command_Nm", row, DT_S, 12.0).path());
    named(
        &answer,
        &[
            ("drive.coulomb", "torque_nm", 0.08, 0.1),
            ("drive.load_friction", "per_force", 0.2, 0.1),
            ("drive.viscous", "nm_s_per_rad", 0.05, 0.1),
        ],
    );
}

/// The same pendulum as a column, and a payload of one trial.
#[test]
fn a_load_in_a_column_and_a_payload_are_taken_into_account() {
    let row = |t_s: f64, trial: u32| {
        let [angle, speed, acceleration] = swing(t_s, trial);
        let weight = MASS_KG * GRAVITY * LENGTH_M * (angle - 0.3).sin();
        let torque =
            INERTIA_KG_M2 * acceleration + weight + 0.08 * (speed / 0.005).tanh() + 0.05 * speed;
        let more = if trial == 1 { 0.25 } else { 0.0 };
        let noise = 2e-3 * noise((t_s / DT_S) as u64 + 100_000 * u64::from(trial));
        vec![angle, torque + more + noise, weight]
    };
    let rig =
        "[drive]\nmoving_inertia_kg_m2 = 0.012\n[[drive.carried]]\ntrial = 1\nload_Nm = 0.25\n";
    let folder = written(rig, "position_rad,drive_command_Nm,load_Nm", row, DT_S, 12.0);
    named(
        &ask(folder.path()),
        &[
            ("drive.coulomb", "torque_nm", 0.08, 0.05),
            ("drive.viscous", "nm_s_per_rad", 0.05, 0.05),
        ],
    );
    // A payload on the pendulum: weight and inertia.
    let payload = |t_s: f64, trial: u32| {
        let [angle, speed, acceleration] = swing(t_s, trial);
        let more = if trial == 1 { 0.2 } else { 0.0 };
        let moment = MASS_KG * LENGTH_M + more * 0.25;
        let inertia = INERTIA_KG_M2 + more * 0.25 * 0.25;
        let weight = GRAVITY * moment * (angle - 0.3).sin();
        let torque = inertia * acceleration + weight + 0.08 * (speed / 0.005).tanh() + 0.05 * speed;
        vec![angle, torque + 2e-3 * noise((t_s / DT_S) as u64 + 100_000 * u64::from(trial))]
    };
    let rig = format!("{PENDULUM}[[drive.carried]]\ntrial = 1\nmass_kg = 0.2\nlength_m = 0.25\n");
    let folder = written(&rig, "position_rad,drive_command_Nm", payload, DT_S, 12.0);
    named(
        &ask(folder.path()),
        &[
            ("drive.coulomb", "torque_nm", 0.08, 0.05),
            ("drive.viscous", "nm_s_per_rad", 0.05, 0.05),
        ],
    );
}

const MOTOR: &str = "[drive]\nmoving_inertia_kg_m2 = 0.002\n[drive.motor]\ntorque_constant_Nm_per_A = 0.05\n\
                     gear_ratio = 20.0\nrotor_inertia_kg_m2 = 2.5e-5\nresistance_ohm = 2.0\n";

#[test]
fn amperes_and_volts_of_a_geared_motor_show_the_friction_at_the_axis() {
    // The rotor's inertia is seen 400 times as large at the axis.
    let inertia = 0.002 + 400.0 * 2.5e-5;
    let current = |t_s: f64, trial: u32| {
        let [_, speed, acceleration] = swing(t_s, trial);
        (inertia * acceleration + 0.1 * (speed / 0.005).tanh() + 0.03 * speed) / (20.0 * 0.05)
    };
    let amperes = |t_s: f64, trial: u32| {
        let noise = noise((t_s / DT_S) as u64 + 100_000 * u64::from(trial));
        vec![swing(t_s, trial)[0], current(t_s, trial) + 2e-3 * noise]
    };
    // U = R I + k ω, with ω of the motor.
    let volts = |t_s: f64, trial: u32| {
        let noise = noise((t_s / DT_S) as u64 + 100_000 * u64::from(trial));
        let [angle, speed, _] = swing(t_s, trial);
        vec![angle, 2.0 * current(t_s, trial) + 0.05 * 20.0 * speed + 4e-3 * noise]
    };
    let truth =
        [("drive.coulomb", "torque_nm", 0.1, 0.05), ("drive.viscous", "nm_s_per_rad", 0.03, 0.05)];
    let folder = written(MOTOR, "position_rad,motor_current_A", amperes, DT_S, 12.0);
    named(&ask(folder.path()), &truth);
    let folder = written(MOTOR, "position_rad,motor_voltage_V", volts, DT_S, 12.0);
    named(&ask(folder.path()), &truth);
}

/// The voltage that the motor induces is nine tenths of what drives it, and a scale of the encoder would change that
/// as viscous friction does.
#[test]
fn friction_is_named_beside_a_large_induced_voltage_and_no_scale_of_the_encoder() {
    let motor = "[drive]\nmoving_inertia_kg_m2 = 0.002\n[drive.pendulum]\nmass_kg = 0.5\nlength_m = 0.15\n\
                 [drive.motor]\ntorque_constant_Nm_per_A = 0.05\ngear_ratio = 50.0\n\
                 rotor_inertia_kg_m2 = 2.5e-5\nresistance_ohm = 2.0\n";
    let inertia = 0.002 + 2500.0 * 2.5e-5;
    let volts = |t_s: f64, trial: u32| {
        let noise = noise((t_s / DT_S) as u64 + 100_000 * u64::from(trial));
        let [angle, speed, acceleration] = swing(t_s, trial);
        let weight = MASS_KG * GRAVITY * LENGTH_M * angle.sin();
        let torque = inertia * acceleration + weight + 0.04 * (speed / 0.005).tanh() + 0.04 * speed;
        vec![angle, 2.0 * torque / (50.0 * 0.05) + 0.05 * 50.0 * speed + 4e-3 * noise]
    };
    let folder = written(motor, "position_rad,motor_voltage_V", volts, DT_S, 12.0);
    named(
        &ask(folder.path()),
        &[
            ("drive.coulomb", "torque_nm", 0.04, 0.05),
            ("drive.viscous", "nm_s_per_rad", 0.04, 0.05),
        ],
    );
}

/// A cable in a sheath, pulled to and fro by hand at 10 rows a second.
#[test]
fn slow_rows_are_taken_without_inertia_where_it_does_not_matter() {
    let slow = |rate: f64| {
        move |t_s: f64, trial: u32| {
            let rate = rate * (1.0 + 0.2 * f64::from(trial));
            let (sin, cos) = (2.0 * PI * rate * t_s).sin_cos();
            let speed = 0.05 * 2.0 * PI * rate * cos;
            let acceleration = -0.05 * (2.0 * PI * rate).powi(2) * sin;
            let force = 0.4 * acceleration + 6.0 * (speed / 5e-4).tanh() + 100.0 * speed;
            vec![
                0.05 * sin,
                force + 0.05 * noise((10.0 * t_s).round() as u64 + 10_000 * u64::from(trial)),
            ]
        }
    };
    let rig = "[drive]\nmoving_mass_kg = 0.4\n";
    let folder = written(rig, "position_m,drive_command_N", slow(0.05), 0.1, 80.0);
    let answer = ask(folder.path());
    named(
        &answer,
        &[("drive.coulomb", "force_n", 6.0, 0.02), ("drive.viscous", "n_s_per_m", 100.0, 0.03)],
    );
    for words in ["quasi-statically, without inertia", "do not tell when friction turned over"] {
        let said = |remark: &&String| remark.contains(words);
        assert_eq!(answer.remarks.iter().filter(said).count(), 2, "{:?}", answer.remarks);
    }
    let rig = "[drive]\nmoving_mass_kg = 8.0\n";
    let folder = written(rig, "position_m,drive_command_N", slow(1.0), 0.1, 120.0);
    let refused = Drive::new(&Bundle::open(folder.path()).unwrap()).err().unwrap();
    assert!(matches!(refused, DriveError::TooSeldom { trial: 0, .. }), "{refused}");
    assert!(refused.to_string().contains("moving the stated inertia takes"), "{refused}");
}
