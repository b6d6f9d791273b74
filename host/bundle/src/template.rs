//! A bundle to begin with: every key of `rig.toml` explained, a vessel and a trial.

use std::f64::consts::FRAC_PI_2;
use std::fmt::Write as _;

use crate::bundle::columns;

/// What a rig has, as `plant` in `rig.toml` names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TemplatePlant {
    /// An instrument in a vessel.
    Catheter,
    /// One axis on its own.
    Drive,
    /// What carries a motion from a drive to where it is used.
    Transmission,
}

/// The files of a bundle that reads without a warning: path within the bundle, and text.
///
/// `name`: of the rig; what is neither a letter, a digit, `-`, `_` nor a point becomes `-`.
pub fn template(plant: TemplatePlant, name: &str) -> Vec<(&'static str, String)> {
    let keep = |c: char| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' };
    let name: String = name.chars().map(keep).collect();
    let own = |text: &str| text.replace("{name}", &name);
    match plant {
        TemplatePlant::Catheter => vec![
            ("README.md", own(include_str!("template/catheter.md"))),
            ("rig.toml", own(include_str!("template/catheter.toml"))),
            ("centreline.csv", centre_line()),
            ("trials/000.csv", feed()),
        ],
        TemplatePlant::Drive => vec![
            ("README.md", own(include_str!("template/drive.md"))),
            ("rig.toml", own(include_str!("template/drive.toml"))),
            ("trials/000.csv", swings()),
        ],
        TemplatePlant::Transmission => vec![
            ("README.md", own(include_str!("template/transmission.md"))),
            ("rig.toml", own(include_str!("template/transmission.toml"))),
            ("trials/000.csv", carried(0.3, 2)),
            ("trials/001.csv", carried(0.37, 3)),
        ],
    }
}

// Writing to a string does not fail.
macro_rules! row {
    ($text:expr, $($of:tt)*) => {{ let _ = writeln!($text, $($of)*); }};
}

/// A tube of 6 mm: 30 mm straight, a bend of 60° with a radius of 30 mm, 60 mm straight.
fn centre_line() -> String {
    const STRAIGHT_M: [f64; 2] = [0.03, 0.06];
    const BEND_RADIUS_M: f64 = 0.03;
    const BEND_RAD: f64 = std::f64::consts::FRAC_PI_3;
    const RADIUS_M: f64 = 0.003;
    const STATIONS: usize = 60;

    let bend_m = BEND_RADIUS_M * BEND_RAD;
    let length_m = STRAIGHT_M[0] + bend_m + STRAIGHT_M[1];
    let mut text = String::from("branch,s_m,x_m,y_m,z_m,radius_m\n");
    for k in 0..=STATIONS {
        let s_m = length_m * k as f64 / STATIONS as f64;
        let turned = ((s_m - STRAIGHT_M[0]) / BEND_RADIUS_M).clamp(0.0, BEND_RAD);
        let before_m = s_m.min(STRAIGHT_M[0]);
        let after_m = (s_m - STRAIGHT_M[0] - bend_m).max(0.0);
        let x_m = before_m + BEND_RADIUS_M * turned.sin() + after_m * turned.cos();
        let y_m = BEND_RADIUS_M * (1.0 - turned.cos()) + after_m * turned.sin();
        row!(text, "vessel,{s_m:.6},{x_m:.6},{y_m:.6},0.000000,{RADIUS_M:.6}");
    }
    text
}

/// From 0 to 1 between two times, without a jump of the speed.
fn smooth(t_s: f64, from_s: f64, to_s: f64) -> f64 {
    let x = ((t_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// A feed through the bend with a quarter turn on the way, and part of the way back.
fn feed() -> String {
    const RATE_HZ: f64 = 50.0;
    const ROWS: u32 = 551;

    let mut text = columns::REQUIRED.join(",") + "\n";
    for row in 0..ROWS {
        let t_s = f64::from(row) / RATE_HZ;
        let insertion_m = 0.02 + 0.07 * smooth(t_s, 0.5, 6.5) - 0.03 * smooth(t_s, 7.5, 10.5);
        let rotation_rad = FRAC_PI_2 * smooth(t_s, 2.5, 5.0);
        row!(text, "{t_s:.2},{insertion_m:.6},{rotation_rad:.5}");
    }
    text
}

/// Swings of a mass with friction, of growing frequency.
fn swings() -> String {
    const RATE_HZ: f64 = 500.0;
    const ROWS: u32 = 5001;
    // As rig.toml states them.
    const MASS_KG: f64 = 12.0;
    const POSITION_NOISE_M: f64 = 2e-6;
    const COMMAND_NOISE_N: f64 = 0.2;
    // As README.md states them.
    const COULOMB_N: f64 = 3.0;
    const VISCOUS_N_S_PER_M: f64 = 20.0;
    /// Speed over which the friction turns round.
    const TURN_M_PER_S: f64 = 1e-3;

    let mut noise = Noise(1);
    let mut text = [columns::TIME, columns::POSITION, columns::COMMAND].join(",") + "\n";
    for row in 0..ROWS {
        let t_s = f64::from(row) / RATE_HZ;
        // Sum of two swings, whose derivatives are known.
        let swing = |size_m: f64, w: f64| {
            let (sin, cos) = (w * t_s).sin_cos();
            [size_m * (1.0 - cos), size_m * w * sin, size_m * w * w * cos]
        };
        let (slow, fast) = (swing(0.05, 2.0), swing(0.004, 11.0));
        let [position_m, speed, acceleration] = [0, 1, 2].map(|k| slow[k] + fast[k]);
        let friction_n = COULOMB_N * (speed / TURN_M_PER_S).tanh() + VISCOUS_N_S_PER_M * speed;
        let command_n = MASS_KG * acceleration + friction_n + COMMAND_NOISE_N * noise.draw();
        let position_m = position_m + POSITION_NOISE_M * noise.draw();
        row!(text, "{t_s:.3},{position_m:.7},{command_n:.3}");
    }
    text
}

/// What comes out of a cable with a dead zone, for two swings of the input that beat.
fn carried(rate_hz: f64, seed: u64) -> String {
    const ROWS_PER_S: f64 = 100.0;
    const ROWS: u32 = 2501;
    // As rig.toml states them.
    const INPUT_NOISE_M: f64 = 1e-6;
    const OUTPUT_NOISE_M: f64 = 5e-6;
    // As README.md states them.
    const GAIN: f64 = 0.97;
    const DEAD_ZONE_M: f64 = 4e-4;

    let mut noise = Noise(seed);
    let mut text = [columns::TIME, columns::INPUTS[0], columns::OUTPUTS[0]].join(",") + "\n";
    let mut held_m = 0.0_f64;
    for row in 0..ROWS {
        let t_s = f64::from(row) / ROWS_PER_S;
        let swing = |size_m: f64, hz: f64| size_m * (std::f64::consts::TAU * hz * t_s).sin();
        let input_m = swing(0.008, rate_hz) + swing(0.004, 0.31 * rate_hz);
        held_m = held_m.clamp(input_m - 0.5 * DEAD_ZONE_M, input_m + 0.5 * DEAD_ZONE_M);
        let output_m = GAIN * held_m + OUTPUT_NOISE_M * noise.draw();
        let input_m = input_m + INPUT_NOISE_M * noise.draw();
        row!(text, "{t_s:.2},{input_m:.7},{output_m:.7}");
    }
    text
}

/// Numbers that look normally distributed, with a standard deviation of 1: sums of twelve evenly
/// distributed ones. The same on every computer.
struct Noise(u64);

impl Noise {
    fn draw(&mut self) -> f64 {
        let even = (0..12).map(|_| {
            // A linear congruential generator modulo 2^64, with Knuth's multiplier (MMIX).
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        });
        even.sum::<f64>() - 6.0
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::bundle::Rig;
    use crate::rig::known_keys;

    const PLANTS: [TemplatePlant; 3] =
        [TemplatePlant::Catheter, TemplatePlant::Drive, TemplatePlant::Transmission];

    fn rig_toml(plant: TemplatePlant) -> String {
        let files = template(plant, "my rig");
        files.into_iter().find(|(name, _)| *name == "rig.toml").unwrap().1
    }

    /// A rig has one of these tables.
    const ALTERNATIVES: [&str; 2] = ["[tendon]", "[[tendons]]"];

    /// With every key that is left out stated, once with each of the alternatives.
    fn stated(text: &str) -> [String; 2] {
        ALTERNATIVES.map(|left_out| {
            let mut skipped = false;
            let mut stated = String::new();
            for line in text.lines() {
                let key = |rest: &&str| !rest.is_empty() && !rest.starts_with(' ');
                let line = line.strip_prefix('#').filter(key).unwrap_or(line);
                if line.starts_with('[') {
                    skipped = line == left_out;
                }
                if !skipped {
                    stated.push_str(line);
                    stated.push('\n');
                }
            }
            stated
        })
    }

    /// Words of each table, remarks included; those before the first table are the document's.
    fn words(text: &str) -> BTreeSet<(String, String)> {
        let mut table = String::new();
        let mut words = BTreeSet::new();
        for line in text.lines() {
            if let Some(name) = line.strip_prefix('[') {
                table = name.trim_matches(['[', ']']).to_owned();
                words.insert((String::new(), table.clone()));
            }
            let of_line = line.split(|c: char| !(c.is_alphanumeric() || c == '_'));
            words.extend(of_line.map(|word| (table.clone(), word.to_owned())));
        }
        words
    }

    #[test]
    fn a_template_reads_without_a_warning() {
        for plant in PLANTS {
            let folder = std::env::temp_dir()
                .join(format!("cathforce-template-{plant:?}-{}", std::process::id()));
            std::fs::create_dir_all(folder.join("trials")).unwrap();
            for (name, text) in template(plant, "a \"rig\"") {
                std::fs::write(folder.join(name), text).unwrap();
            }
            let bundle = crate::Bundle::open(&folder);
            std::fs::remove_dir_all(&folder).unwrap();
            let bundle = bundle.unwrap();
            assert_eq!(bundle.warnings, [], "{plant:?}");
            assert_eq!(bundle.rig.name, "a--rig-");
            let trials = if plant == TemplatePlant::Transmission { 2 } else { 1 };
            assert_eq!(bundle.trials.len(), trials);
        }
    }

    #[test]
    fn what_is_left_out_can_be_stated() {
        for plant in PLANTS {
            for text in stated(&rig_toml(plant)) {
                let (_, warnings) = Rig::parse(&text).unwrap();
                assert_eq!(warnings, [], "{plant:?}");
            }
        }
    }

    /// A key that the reader learns has to be explained here.
    #[test]
    fn every_key_that_is_read_is_explained() {
        let texts = PLANTS.map(|plant| stated(&rig_toml(plant))).concat();
        let known = known_keys(|| {
            for text in &texts {
                Rig::parse(text).unwrap();
            }
        });
        assert!(known.len() > 60, "{}", known.len());
        let explained: BTreeSet<_> = texts.iter().flat_map(|text| words(text)).collect();
        for (table, key) in known {
            // Entries of arrays stand in their table.
            let name = table.split(['.', '[']).next().unwrap_or_default().to_owned();
            assert!(explained.contains(&(name, key.clone())), "{key} of [{table}] is missing");
        }
    }
}
