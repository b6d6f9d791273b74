//! Drives that are made here: a mass, a motion and forces that are known.

use std::fmt::Write as _;
use std::path::Path;

use cathforce_bundle::Bundle;
use cathforce_bundle::bundle::{DriveTrial, TrialData};
use cathforce_gap::diagnose;
use cathforce_gap::drive::Drive;
use cathforce_gap::report::{Diagnosis, NamedEffect};
use tempfile::TempDir;

pub const MASS_KG: f64 = 20.0;
pub const DT_S: f64 = 1e-3;
pub const NOISE_N: f64 = 0.05;

/// One instant of a made drive.
pub struct Instant {
    pub position_m: f64,
    pub velocity_m_per_s: f64,
    pub acceleration_m_per_s2: f64,
}

/// A smooth motion there and back with many speeds; every `period_s` it repeats itself.
pub fn motion(t_s: f64, period_s: f64, stroke_m: f64) -> Instant {
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
pub fn noise(seed: u64) -> f64 {
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
pub fn bundle(
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

pub fn ask(folder: &Path) -> Diagnosis {
    let bundle = Bundle::open(folder).unwrap();
    diagnose(&Drive::new(&bundle).unwrap(), "made", &cathforce_gap::unwatched)
}

pub fn names(answer: &Diagnosis) -> Vec<&str> {
    answer.effects.iter().map(|effect| effect.id.as_str()).collect()
}

pub fn value(effect: &NamedEffect, name: &str) -> f64 {
    effect.parameters[name].value
}

pub const TWO: [(f64, f64); 2] = [(2.5, 0.05), (2.5, 0.05)];

pub fn coulomb(_: f64, now: &Instant) -> f64 {
    6.0 * now.velocity_m_per_s.signum()
}

/// The drive's columns of a trial.
pub fn columns(trial: &mut cathforce_bundle::Trial) -> &mut DriveTrial {
    let TrialData::Drive(data) = &mut trial.data else { panic!("a drive's trial") };
    data
}

/// Reads positions in steps.
pub fn read_in_steps(bundle: &mut Bundle, step_m: f64) {
    for trial in &mut bundle.trials {
        columns(trial).position.iter_mut().for_each(|x| *x = (*x / step_m).round() * step_m);
    }
}
