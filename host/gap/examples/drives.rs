//! A table on made drives whose truth is known: how often a diagnosis is right about their friction.
//!
//! `cargo run -p cathforce-gap --example drives -- 12` makes 12 drives, each read by a fine encoder and by
//! one of 12 bit, half of them slides and half servos with a pendulum.
//!
//! Friction turns over as a bristle does (Dahl), as it is fitted; which terms there are, their sizes, inertia, motion
//! and noise are drawn.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;

use cathforce_bundle::Bundle;
use cathforce_gap::diagnose;
use cathforce_gap::drive::Drive;
use cathforce_gap::plant::Plant as _;
use cathforce_gap::report::{Diagnosis, Verdict};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Between rows \[s\], and length of a trial.
const STEP_S: f64 = 1e-3;
const LONG_S: f64 = 12.0;
const TRIALS: u32 = 3;
/// Steps of the coarse encoder over the travel, or over a turn.
const STEPS: f64 = 4096.0;
/// Noise of the command, as a share of the force that moves the inertia.
const NOISE_SHARE: f64 = 0.01;

/// A drive whose friction is known.
struct Made {
    is_servo: bool,
    inertia: f64,
    /// Torque that holds the pendulum level.
    weight: f64,
    travel: f64,
    /// Size of the inertial force, which all others are shares of.
    force: f64,
    /// Rates of the two swings of a trial \[Hz\].
    rates: Vec<[f64; 2]>,
    coulomb: f64,
    viscous: f64,
    offset: f64,
    load: f64,
    /// Size and wavelength.
    ripple: [f64; 2],
    /// Excess at rest, and the speed over which it falls.
    stribeck: [f64; 2],
}

impl Made {
    fn draw(seed: u64) -> Self {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let is_servo = seed.is_multiple_of(2);
        let (inertia, travel, weight) = match is_servo {
            true => (rng.random_range(0.005..0.03), 2.4, rng.random_range(0.3..1.0)),
            false => (rng.random_range(1.0..30.0), rng.random_range(0.05..0.3), 0.0),
        };
        let rates: Vec<[f64; 2]> = (0..TRIALS)
            .map(|_| [rng.random_range(0.25..0.5), rng.random_range(0.8..1.6)])
            .collect();
        let speed = 0.5 * travel * TAU * 0.5;
        let force = (inertia * 0.5 * travel * (TAU * 0.8_f64).powi(2)).max(0.5 * weight);
        let mut some = |chance: f64, low: f64, high: f64| {
            if rng.random_bool(chance) { rng.random_range(low..high) } else { 0.0 }
        };
        let coulomb = force * some(0.9, 0.1, 0.8);
        let viscous = force / speed * some(0.7, 0.1, 0.6);
        let offset = force * some(0.3, 0.05, 0.2);
        let load = if is_servo { some(0.5, 0.05, 0.3) } else { 0.0 };
        let ripple = [force * some(0.25, 0.05, 0.2), travel * rng.random_range(0.05..0.2)];
        let excess =
            if coulomb > 0.0 && rng.random_bool(0.25) { rng.random_range(0.3..0.8) } else { 0.0 };
        let stribeck = [coulomb * excess, speed * rng.random_range(0.04..0.12)];
        Self {
            is_servo,
            inertia,
            weight,
            travel,
            force,
            rates,
            coulomb,
            viscous,
            offset,
            load,
            ripple,
            stribeck,
        }
    }

    /// What is there, with the parameter that is compared.
    fn truth(&self) -> Vec<(&'static str, usize, f64)> {
        let all = [
            ("drive.coulomb", 0, self.coulomb),
            ("drive.viscous", 0, self.viscous),
            ("drive.offset", 0, self.offset),
            ("drive.load_friction", 0, self.load),
            ("drive.ripple", 2, if self.ripple[0] > 0.0 { self.ripple[1] } else { 0.0 }),
            ("drive.stribeck", 0, self.stribeck[0]),
        ];
        all.into_iter().filter(|(.., value)| *value > 0.0).collect()
    }

    fn write(&self, folder: &Path, step: f64, seed: u64) {
        let rng = &mut ChaCha8Rng::seed_from_u64(1000 + seed);
        let (drive, names) = match self.is_servo {
            true => (
                format!(
                    "moving_inertia_kg_m2 = {:?}\n[drive.pendulum]\nmass_kg = {:?}\nlength_m = 0.1\n",
                    self.inertia,
                    self.weight / (0.1 * 9.806_65)
                ),
                "t_s,position_rad,drive_command_Nm",
            ),
            false => {
                (format!("moving_mass_kg = {:?}\n", self.inertia), "t_s,position_m,drive_command_N")
            }
        };
        let rig = format!(
            "format = \"trial-bundle/1\"\nname = \"made\"\nplant = \"drive\"\n[drive]\n{drive}"
        );
        std::fs::write(folder.join("rig.toml"), rig).unwrap();
        std::fs::create_dir(folder.join("trials")).unwrap();
        for (trial, [slow, fast]) in self.rates.iter().enumerate() {
            let (mut text, mut bent, mut last) = (format!("{names}\n"), 0.0, None);
            for row in 0..(LONG_S / STEP_S) as u64 {
                let t_s = row as f64 * STEP_S;
                let wave = |size: f64, rate: f64| {
                    let ((sin, cos), w) = ((TAU * rate * t_s).sin_cos(), TAU * rate);
                    [size * sin, size * w * cos, -size * w * w * sin]
                };
                let (a, b) = (wave(0.4 * self.travel, *slow), wave(0.1 * self.travel, *fast));
                let [at, speed, acceleration] = [0, 1, 2].map(|k| a[k] + b[k]);
                let moved = (at - last.replace(at).unwrap_or(at)).abs();
                let to = speed.signum();
                bent = to + (bent - to) * (-moved / (2e-4 * self.travel)).exp();
                let carried = self.inertia * acceleration + self.weight * at.sin();
                let excess = self.stribeck[0] * (-(speed / self.stribeck[1]).powi(2)).exp();
                let command = carried
                    + (self.coulomb + excess + self.load * carried.abs()) * bent
                    + self.viscous * speed
                    + self.offset
                    + self.ripple[0] * (TAU * at / self.ripple[1]).sin()
                    + NOISE_SHARE
                        * self.force
                        * (0..4).map(|_| rng.random_range(-0.866..0.866)).sum::<f64>();
                let seen = (at / step).round() * step;
                writeln!(text, "{t_s},{seen},{command}").unwrap();
            }
            std::fs::write(folder.join(format!("trials/{trial:03}.csv")), text).unwrap();
        }
    }
}

/// What came of some drives.
#[derive(Default)]
struct Counts {
    drives: usize,
    terms: usize,
    within: usize,
    exact: usize,
    clean: usize,
    slowest_s: f64,
}

impl Counts {
    fn add(&mut self, made: &Made, answer: &Diagnosis, drive: &[(&str, Vec<&str>)]) {
        let truth = made.truth();
        let named: Vec<&str> = answer.effects.iter().map(|effect| effect.id.as_str()).collect();
        let is_there = |id: &str| truth.iter().any(|(own, ..)| *own == id);
        for (id, parameter, value) in &truth {
            let Some(effect) = answer.effects.iter().find(|effect| effect.id == *id) else {
                continue;
            };
            let name = drive.iter().find(|(own, _)| own == id).map(|(_, names)| names[*parameter]);
            let own = &effect.parameters[name.unwrap_or_default()];
            self.terms += 1;
            self.within += usize::from((own.low..=own.high).contains(value));
        }
        // A sensor's bias and a constant force are one.
        let is_known = |id: &&str| {
            is_there(id)
                || answer.confusable.iter().any(|set| {
                    set.iter().any(|own| own == id) && set.iter().any(|own| is_there(own))
                })
        };
        let is_exact = answer.verdict == Verdict::Named
            && named.iter().all(&is_known)
            && named.len() == truth.len();
        self.drives += 1;
        self.exact += usize::from(is_exact);
        self.clean += usize::from(named.iter().all(is_known));
        self.slowest_s = self.slowest_s.max(answer.seconds);
    }
}

fn main() {
    let drives = std::env::args().nth(1).and_then(|own| own.parse().ok()).unwrap_or(6_u64);
    println!(
        "| encoder | drives | named terms within their 90 % interval | the true set is named | nothing named that is not there | slowest |"
    );
    println!("| --- | --- | --- | --- | --- | --- |");
    for (encoder, is_coarse) in [("fine", false), ("12 bit", true)] {
        let mut counts = Counts::default();
        for seed in 0..drives {
            let made = Made::draw(seed);
            let range = if made.is_servo { TAU } else { made.travel };
            let step = if is_coarse { range / STEPS } else { 1e-7 * range };
            let folder = tempfile::tempdir().unwrap();
            made.write(folder.path(), step, seed);
            let bundle = Bundle::open(folder.path()).unwrap();
            let drive = Drive::new(&bundle).unwrap();
            let answer = diagnose(&drive, "made", &cathforce_gap::unwatched);
            let names: Vec<(&str, Vec<&str>)> = drive
                .effects()
                .iter()
                .map(|effect| (effect.id, effect.parameters.iter().map(|p| p.name).collect()))
                .collect();
            let there: Vec<&str> = made.truth().into_iter().map(|(id, ..)| id).collect();
            eprintln!(
                "{encoder} {seed}: {there:?}\n    {:.1} s {:?} {}",
                answer.seconds, answer.verdict, answer.sentence
            );
            counts.add(&made, &answer, &names);
        }
        let Counts { drives, terms, within, exact, clean, slowest_s } = counts;
        println!(
            "| {encoder} | {drives} | {within} of {terms} | {exact} | {clean} | {slowest_s:.1} s |"
        );
    }
}
