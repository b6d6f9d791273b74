//! Logs of Dynamixel servos as Rhoban's `bam` records them: a JSON with the pendulum and a list of entries.
//!
//! An entry has `timestamp` \[s\], `position` \[rad\], `goal_position` \[rad\], `torque_enable`, `input_volts` \[V\] and
//! `load` \[0.1 % of the duty cycle\].

use std::io::Read;

use cathforce_bundle::bundle::{Axis, CommandKind};
use serde::Deserialize;

use super::{DriveLog, Rows};
use crate::import::error::{ImportError, read_text};

/// A step of `load` as a share of the whole duty cycle.
const LOAD_STEP: f64 = 1e-3;

/// How the voltage of the motor follows from an entry.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BamOptions {
    /// Duty cycle for each radian of error and unit of `kp`, and its largest value; without it, `load` is the duty cycle.
    pub error_gain: Option<f64>,
    pub most_duty: f64,
}

/// What the log says of the pendulum.
#[derive(Clone, Debug, PartialEq)]
pub struct Bam {
    pub log: DriveLog,
    pub mass_kg: f64,
    pub length_m: f64,
    /// Of the arm, whose middle is at half of the length.
    pub arm_mass_kg: f64,
    pub motor: Option<String>,
}

#[derive(Deserialize)]
struct File {
    mass: Option<f64>,
    length: Option<f64>,
    arm_mass: Option<f64>,
    kp: Option<f64>,
    vin: Option<f64>,
    motor: Option<String>,
    entries: Option<Vec<Entry>>,
}

#[derive(Deserialize)]
struct Entry {
    timestamp: Option<f64>,
    position: Option<f64>,
    load: Option<f64>,
    input_volts: Option<f64>,
    goal_position: Option<f64>,
    torque_enable: Option<bool>,
}

/// Reads a log. Rows in which the torque is off are dropped: the motor is open then, and no voltage drives it.
pub fn read_bam(mut log: impl Read, options: &BamOptions) -> Result<Bam, ImportError> {
    let text = read_text(&mut log)?;
    let file: File = serde_json::from_str(&text).map_err(|e| {
        let fix = "give the JSON that `bam.dynamixel.record` writes; a number is no text, and `torque_enable` is true or false";
        ImportError::new(e.line() as u64, format!("no log of bam: {e}"), fix)
    })?;
    let missing = |key: &str| {
        ImportError::new(
            1,
            format!("the log has no `{key}`"),
            "give the JSON that `bam.dynamixel.record` writes",
        )
    };
    let entries = file.entries.as_ref().ok_or_else(|| missing("entries"))?;
    let mass_kg = file.mass.ok_or_else(|| missing("mass"))?;
    let length_m = file.length.ok_or_else(|| missing("length"))?;
    let entry = |row: usize, problem: &str| {
        let fix = "record it: the entries of `bam.dynamixel.record` have it";
        ImportError::new(1, format!("entry {row} has no {problem}"), fix)
    };
    let gain = match options.error_gain {
        Some(gain) => Some(gain * file.kp.ok_or_else(|| missing("kp"))?),
        None => None,
    };
    let mut rows = Rows { setpoint: Some(Vec::new()), ..Rows::default() };
    for (row, own) in entries.iter().enumerate() {
        if own.torque_enable == Some(false) {
            rows.dropped += 1;
            continue;
        }
        let t_s = own.timestamp.ok_or_else(|| entry(row, "`timestamp`"))?;
        let position = own.position.ok_or_else(|| entry(row, "`position`"))?;
        let volts = own.input_volts.or(file.vin).ok_or_else(|| entry(row, "`input_volts`"))?;
        let duty = match gain {
            Some(gain) => {
                let goal = own.goal_position.ok_or_else(|| entry(row, "`goal_position`"))?;
                (gain * (goal - position)).clamp(-options.most_duty, options.most_duty)
            }
            None => LOAD_STEP * own.load.ok_or_else(|| entry(row, "`load`"))?,
        };
        rows.t_s.push(t_s);
        rows.position.push(position);
        rows.command.push(volts * duty);
        rows.lines.push(1);
        if let Some(column) = &mut rows.setpoint {
            column.push(own.goal_position);
        }
    }
    let how = match options.error_gain {
        Some(gain) => {
            format!("volts from the error of position, with {gain} a radian and unit of kp")
        }
        None => "volts from `load`, in 0.1 % of `input_volts`".to_owned(),
    };
    let motor = file.motor.as_deref().map_or(String::new(), |motor| format!(" of a {motor}"));
    let understood =
        vec![format!("a log of bam{motor}: pendulum of {mass_kg} kg at {length_m} m; {how}")];
    let log = rows.into_log(Axis::Rotary, CommandKind::Voltage, understood)?;
    let arm_mass_kg = file.arm_mass.unwrap_or(0.0);
    Ok(Bam { log, mass_kg, length_m, arm_mass_kg, motor: file.motor })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log(entry: impl Fn(usize) -> String) -> String {
        let entries: Vec<String> = (0..150).map(entry).collect();
        format!(
            "{{\"mass\": 0.5, \"length\": 0.1, \"kp\": 32, \"vin\": 15.0, \"motor\": \"mx106\", \"entries\": [{}]}}",
            entries.join(", ")
        )
    }

    fn entry(i: usize) -> String {
        format!(
            "{{\"position\": {}, \"speed\": 0.0, \"load\": -200, \"input_volts\": 14.8, \"temp\": 40, \"timestamp\": {}, \
             \"goal_position\": 0.1, \"torque_enable\": {}}}",
            0.01 * i as f64,
            0.01 * i as f64,
            i >= 10
        )
    }

    #[test]
    fn the_load_or_the_error_is_a_share_of_the_voltage() {
        let own = read_bam(log(entry).as_bytes(), &BamOptions::default()).unwrap();
        assert_eq!((own.mass_kg, own.length_m, own.motor.as_deref()), (0.5, 0.1, Some("mx106")));
        let (t_s, data) = &own.log.trials[0];
        assert_eq!((t_s.len(), data.kind), (140, CommandKind::Voltage));
        assert!((data.command[0] + 0.2 * 14.8).abs() < 1e-9);
        assert!(own.log.remarks[0].contains("10 of 150 rows are dropped"), "{:?}", own.log.remarks);
        let options = BamOptions { error_gain: Some(0.158), most_duty: 0.9625 };
        let own = read_bam(log(entry).as_bytes(), &options).unwrap();
        let data = &own.log.trials[0].1;
        // At 0.1 rad there is no error; at 0.12 rad −0.02 rad give 10 % of the voltage.
        assert!(data.command[0].abs() < 1e-9);
        assert!((data.command[2] + 0.02 * 0.158 * 32.0 * 14.8).abs() < 1e-9, "{}", data.command[2]);
        assert!((data.command[139] + 0.9625 * 14.8).abs() < 1e-9, "it is cut");
    }

    #[test]
    fn what_is_missing_is_named() {
        let refused = |text: &str, words: &str| {
            let error = read_bam(text.as_bytes(), &BamOptions::default()).unwrap_err().to_string();
            assert!(error.contains(words), "`{words}` in: {error}");
        };
        refused("{\"mass\": 0.5}", "the log has no `entries`");
        refused("[1, 2]", "no log of bam");
        refused(&log(entry).replace("\"mass\"", "\"weight\""), "the log has no `mass`");
        refused(&log(entry).replace("\"load\"", "\"torque\""), "entry 10 has no `load`");
        refused(&log(entry).replace("-200", "\"-200\""), "no log of bam");
    }
}
