//! The inverse of a transmission: the input that gives a desired output.
//!
//! A table has one input for each direction of motion. It is exact where a motion has left the last reversal behind.
//! Along a path that is known beforehand, [`Compensation::along`] inverts the model with what it remembers.

use std::f64::consts::TAU;

use serde::Serialize;

use super::effects::MOST_SLACK;
use super::model::{Model, State};
use super::plant::Transmission;
use crate::plant::{Plant, Point};

/// Steps over the travel by which branches are played.
const STEPS: usize = 4000;
/// Motion before a branch, over the travel: what it remembers of before is gone then.
const LEAD: f64 = 1.5 * MOST_SLACK;
/// Halvings of an interval: 2⁻⁶⁰ of the travel is below rounding.
const HALVINGS: usize = 60;
/// Two outputs that differ by less of the range are one.
const SAME: f64 = 1e-12;

/// One row of the table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Row {
    pub output: f64,
    /// Input while the desired output rises, and while it falls.
    pub rising: f64,
    pub falling: f64,
}

/// How far the output of the model is off the desired one, in the unit of the output.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Achieved {
    pub rms: f64,
    pub largest: f64,
}

/// A model that can be inverted, and its table.
#[derive(Clone, Debug)]
pub struct Compensation {
    pub model: Model,
    pub rows: Vec<Row>,
    /// Along a motion to and fro of shrinking size by the table, by the inverse with memory, and where the stated gain
    /// alone is inverted.
    pub by_table: Achieved,
    pub by_memory: Achieved,
    pub by_gain: Achieved,
    /// Load at the output for which it holds \[N\] or \[N·m\].
    pub load: f64,
    input: [f64; 2],
}

/// Why a transmission has no such table.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CompensationError {
    #[error(
        "{0} is no effect of this transmission\n  fix: give the diagnosis of this bundle, or see \
         `cathforce gap effects`"
    )]
    NoEffect(String),
    #[error(
        "the model has no inverse: after a reversal its output runs against the input\n  fix: record slower and \
         longer strokes, and diagnose again; hysteresis of Bouc and Wen needs a length above its height"
    )]
    NoInverse,
    #[error(
        "no output is reached in both directions: what is lost is as large as the travel\n  fix: record strokes \
         over the whole travel"
    )]
    NoRange,
    #[error(
        "the desired output of {desired} in row {row} is beyond what the input's travel of {low} to {high} reaches\n  \
         fix: keep it between {} and {}", .reached[0], .reached[1]
    )]
    OutOfReach { row: usize, desired: f64, low: f64, high: f64, reached: [f64; 2] },
}

impl Compensation {
    /// For a transmission with effects of these values, each with its identifier, of so many rows and for a load.
    pub fn of(
        transmission: &Transmission,
        effects: &[(String, Vec<f64>)],
        rows: usize,
        load: Option<f64>,
    ) -> Result<Self, CompensationError> {
        let mut point = Point::nominal(transmission);
        for (id, values) in effects {
            let index = transmission.effects().iter().position(|own| own.id == id);
            let index = index.filter(|&index| point.effects[index].len() == values.len());
            let index = index.ok_or_else(|| CompensationError::NoEffect(id.clone()))?;
            point.effects[index].clone_from(values);
        }
        // What depends on the rate or on the time is no matter of a position.
        let model = Model {
            time_constant_s: 0.0,
            latency_s: 0.0,
            drift_per_s: 0.0,
            ..transmission.model(&point)
        };
        let half = 0.5 * model.travel;
        let input = [model.middle - half, model.middle + half];
        let load = load.unwrap_or(transmission.mean_load);
        let none = Achieved { rms: 0.0, largest: 0.0 };
        let mut own = Self {
            model,
            rows: Vec::new(),
            by_table: none,
            by_memory: none,
            by_gain: none,
            load,
            input,
        };
        own.rows = own.table(rows)?;
        own.check(&transmission.stated)?;
        Ok(own)
    }

    /// The next output, with its zero.
    fn next(&self, state: &mut State, input: f64) -> f64 {
        self.model.step(state, input, self.load, None) + self.model.offset
    }

    /// Inputs and outputs of a stroke over the travel in one direction of the input, beyond what it remembers.
    fn branch(&self, rises: bool) -> Vec<(f64, f64)> {
        let [low, high] = self.input;
        let lead = LEAD * (high - low);
        let steps = (STEPS as f64 * (1.0 + LEAD)) as usize;
        let (from, to) = if rises { (low - lead, high) } else { (high + lead, low) };
        let mut state = self.model.start(from, None);
        let at = |k: usize| from + (to - from) * k as f64 / steps as f64;
        let played = (0..=steps).map(|k| (at(k), self.next(&mut state, at(k))));
        played.filter(|(u, _)| (low..=high).contains(u)).collect()
    }

    fn table(&self, rows: usize) -> Result<Vec<Row>, CompensationError> {
        let sign = self.model.gain.signum();
        let mut branches = [true, false].map(|rises| self.branch(rises));
        branches[1].reverse();
        // By rising output; of the falling branch the input falls.
        for branch in &mut branches {
            if sign < 0.0 {
                branch.reverse();
            }
            if branch.windows(2).any(|pair| pair[1].1 < pair[0].1) {
                return Err(CompensationError::NoInverse);
            }
        }
        // The input rises while the output does, unless the gain is negative.
        if sign < 0.0 {
            branches.swap(0, 1);
        }
        let output = |at: Option<&(f64, f64)>| at.map_or(f64::NAN, |(_, y)| *y);
        let lows = branches.each_ref().map(|branch| output(branch.first()));
        let highs = branches.each_ref().map(|branch| output(branch.last()));
        let (low, high) = (lows[0].max(lows[1]), highs[0].min(highs[1]));
        let is_reached = low < high;
        if !is_reached {
            return Err(CompensationError::NoRange);
        }
        let last = rows.max(2) - 1;
        let row = |k: usize| {
            let output = low + (high - low) * k as f64 / last as f64;
            let [rising, falling] = branches.each_ref().map(|branch| inverse(branch, output));
            Row { output, rising, falling }
        };
        Ok((0..=last).map(row).collect())
    }

    /// Outputs that the table reaches.
    pub fn range(&self) -> [f64; 2] {
        [self.rows[0].output, self.rows[self.rows.len() - 1].output]
    }

    /// The input of the table.
    fn by_row(&self, output: f64, rises: bool) -> f64 {
        let last = self.rows.len() - 1;
        let [low, high] = self.range();
        let at = ((output - low) / (high - low) * last as f64).clamp(0.0, last as f64);
        let row = (at as usize).min(last - 1);
        let of = |row: &Row| if rises { row.rising } else { row.falling };
        let (a, b) = (of(&self.rows[row]), of(&self.rows[row + 1]));
        a + (at - row as f64) * (b - a)
    }

    /// The inputs along desired outputs, by the model with what it remembers. It begins as after a motion from below.
    pub fn along(&self, desired: &[f64]) -> Result<Vec<f64>, CompensationError> {
        let Some(&first) = desired.first() else { return Ok(Vec::new()) };
        let (mut state, mut input) = self.begin(first);
        let mut inputs = Vec::with_capacity(desired.len());
        for (row, &output) in desired.iter().enumerate() {
            input = self.invert(&mut state, input, output).ok_or_else(|| {
                let [low, high] = self.input;
                CompensationError::OutOfReach {
                    row: row + 1,
                    desired: output,
                    low,
                    high,
                    reached: self.range(),
                }
            })?;
            inputs.push(input);
        }
        Ok(inputs)
    }

    /// After a motion that raised the output up to this one.
    fn begin(&self, output: f64) -> (State, f64) {
        let to = self.by_row(output, true);
        let sign = self.model.gain.signum();
        let from = to - sign * LEAD * self.model.travel;
        let mut state = self.model.start(from, None);
        for k in 1..=STEPS {
            self.next(&mut state, from + (to - from) * k as f64 / STEPS as f64);
        }
        (state, to)
    }

    /// The input nearest to the last one that gives an output; the state then is that after it.
    fn invert(&self, state: &mut State, last: f64, output: f64) -> Option<f64> {
        let [low, high] = self.input;
        let room = LEAD * (high - low);
        let sign = self.model.gain.signum();
        let off = |input: f64| sign * (self.next(&mut state.clone(), input) - output);
        let same = SAME * self.model.gain.abs() * self.model.travel;
        let now = off(last);
        let found = if now.abs() <= same {
            last
        } else {
            let (mut a, mut b) = if now < 0.0 { (last, high + room) } else { (low - room, last) };
            if off(a) > same || off(b) < -same {
                return None;
            }
            for _ in 0..HALVINGS {
                let middle = 0.5 * (a + b);
                if off(middle) < 0.0 { a = middle } else { b = middle }
            }
            if now < 0.0 { b } else { a }
        };
        self.next(state, found);
        Some(found)
    }

    /// Plays the inverses on the model, along swings over the range whose size shrinks to a tenth.
    fn check(&mut self, stated: &Model) -> Result<(), CompensationError> {
        const POINTS: usize = 6000;
        const SWINGS: f64 = 8.0;

        let [low, high] = self.range();
        let at = |k: usize| {
            let share = k as f64 / POINTS as f64;
            let size = 0.98 * 0.5 * (high - low) * (1.0 - 0.9 * share);
            0.5 * (low + high) + size * (TAU * SWINGS * share).sin()
        };
        let desired: Vec<f64> = (0..POINTS).map(at).collect();
        let mut rises = true;
        let table = desired.iter().enumerate().map(|(k, output)| {
            if k > 0 && desired[k - 1] != *output {
                rises = desired[k - 1] < *output;
            }
            self.by_row(*output, rises)
        });
        let table: Vec<f64> = table.collect();
        let memory = self.along(&desired)?;
        let gain: Vec<f64> = desired.iter().map(|output| output / stated.gain).collect();
        self.by_table = self.achieved(&desired, &table);
        self.by_memory = self.achieved(&desired, &memory);
        self.by_gain = self.achieved(&desired, &gain);
        Ok(())
    }

    /// What the model makes of inputs, against what was desired.
    fn achieved(&self, desired: &[f64], inputs: &[f64]) -> Achieved {
        let (mut state, _) = self.begin(desired[0]);
        let (mut sum, mut largest) = (0.0, 0.0_f64);
        for (input, output) in inputs.iter().zip(desired) {
            let off = self.next(&mut state, *input) - output;
            sum += off * off;
            largest = largest.max(off.abs());
        }
        Achieved { rms: (sum / desired.len() as f64).sqrt(), largest }
    }
}

/// The input of a branch, by rising output, at an output within it.
fn inverse(branch: &[(f64, f64)], output: f64) -> f64 {
    let after = branch.partition_point(|(_, y)| *y < output).clamp(1, branch.len() - 1);
    let ((u, y), (later_u, later_y)) = (branch[after - 1], branch[after]);
    let share = if later_y > y { ((output - y) / (later_y - y)).clamp(0.0, 1.0) } else { 0.0 };
    u + share * (later_u - u)
}
