//! Encoders and clocks that no drive can follow: a unit or a reading is wrong.

use thiserror::Error;

use super::columns;
use super::types::Trial;

/// An encoder that goes faster than a drive can.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error("{column} goes by {speed:.3} {unit} at t_s = {at_s}, faster than any drive: {why}?")]
pub struct Rush {
    pub column: &'static str,
    pub at_s: f64,
    /// In `unit`.
    pub speed: f64,
    pub unit: &'static str,
    /// What it may be instead.
    pub why: &'static str,
}

/// No instrument is fed faster \[m/s\], or turned faster \[rad/s\] (three turns a second).
const FASTEST_M_PER_S: f64 = 1.0;
const FASTEST_RAD_PER_S: f64 = 20.0;
/// No tendon is pulled faster \[m/s\]; a device takes no more by default.
const FASTEST_TENDON_M_PER_S: f64 = 0.2;
/// Motion over which a speed is measured; longer than the steps of any encoder \[m\], \[rad\].
const RUSH_M: f64 = 5e-3;
const RUSH_RAD: f64 = 1.0;

/// Largest median step between rows \[s\]: 0.1 s, with room for rounding.
const LONGEST_STEP_S: f64 = 0.101;
/// Fewest steps from which a median is taken.
const FEWEST_STEPS: usize = 10;
/// How far from a thousand a ratio may be and still look like a slip of the unit.
const THOUSANDFOLD: std::ops::RangeInclusive<f64> = 400.0..=2500.0;

impl Trial {
    /// Where an encoder first goes faster than a drive can; `None` if nowhere. A unit of encoder or
    /// time is wrong then, or the encoder jumps.
    pub fn rush(&self) -> Option<Rush> {
        let catheter = self.catheter()?;
        let pulled = || {
            let mut tendons = columns::TENDONS.into_iter().zip(&catheter.tendons_m);
            tendons.find_map(|(column, at_m)| {
                let (at_s, speed) = faster(&self.t_s, at_m, RUSH_M, FASTEST_TENDON_M_PER_S)?;
                let why = "is it in metres, and not in millimetres or counts";
                Some(Rush { column, at_s, speed, unit: "m/s", why })
            })
        };
        let driven = catheter.encoders().find_map(|[insertion, rotation]| {
            let ((insertion, insertion_m), (rotation, rotation_rad)) = (insertion, rotation);
            let fed = faster(&self.t_s, insertion_m, RUSH_M, FASTEST_M_PER_S);
            let fed = fed.map(|(at_s, speed)| {
                let why = "is t_s in seconds and the insertion in metres, or does the encoder jump";
                Rush { column: insertion, at_s, speed, unit: "m/s", why }
            });
            let turned = || faster(&self.t_s, rotation_rad, RUSH_RAD, FASTEST_RAD_PER_S);
            fed.or_else(|| {
                let (at_s, speed) = turned()?;
                let why = "is it in degrees, or does the encoder begin anew after a turn";
                Some(Rush { column: rotation, at_s, speed, unit: "rad/s", why })
            })
        });
        driven.or_else(pulled)
    }

    /// Why `t_s` seems to be in milliseconds; `None` if it does not: rows are too far apart for any
    /// drive, or some thousand times as far as the sensor's rate says.
    pub fn slow_clock(&self, force_rate_hz: Option<f64>) -> Option<String> {
        let mut steps: Vec<f64> = self.t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        let step_s = *steps.get(steps.len() / 2).filter(|_| steps.len() >= FEWEST_STEPS)?;
        let of_rate = force_rate_hz.filter(|rate| THOUSANDFOLD.contains(&(rate * step_s)));
        let beside = match of_rate {
            Some(rate) => format!(", and force_rate_hz = {rate} is {} s", 1.0 / rate),
            None if step_s > LONGEST_STEP_S => String::new(),
            None => return None,
        };
        let step_s = (1e6 * step_s).round() / 1e6;
        Some(format!("the rows are {step_s} s apart by t_s{beside}: milliseconds?"))
    }
}

/// The first time at which a column moves by at least `way` faster than `limit`, and its speed.
fn faster(t_s: &[f64], column: &[f64], way: f64, limit: f64) -> Option<(f64, f64)> {
    let mut first = 0;
    (1..t_s.len()).find_map(|row| {
        let (time_s, gone) = (t_s[row] - t_s[first], (column[row] - column[first]).abs());
        let found = (gone >= way && gone > limit * time_s).then(|| (t_s[first], gone / time_s));
        if limit * time_s >= way {
            first = row;
        }
        found
    })
}
