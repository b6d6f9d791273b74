//! Many operations: where the loop is stable, with and without the passivity observer.

use std::fmt::Write as _;

use cathforce_control::Config;
use rayon::prelude::*;
use serde::Serialize;

use crate::handle::{Axis, Hand};
use crate::operation::{HapticsError, Operation, Passed};

/// How an operation ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Stable, whether or not the passivity observer is on.
    Stable,
    /// Stable only because the passivity observer limits the output.
    Held,
    /// It swings on, with an energy that the passivity observer bounds.
    Swings,
}

/// Operations of one gain and one hand.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cell {
    pub gain: f32,
    /// Of the hand \[N/m\], \[N·m/rad\].
    pub stiffness: f64,
    pub with: Passed,
    pub without: Passed,
}

/// Gains by hands, for one delay.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Map {
    pub operation: Operation,
    pub gains: Vec<f32>,
    pub stiffnesses: Vec<f64>,
    /// By hand, then by gain.
    pub cells: Vec<Cell>,
}

impl Cell {
    pub fn outcome(&self) -> Outcome {
        match (self.with.is_stable, self.without.is_stable) {
            (true, true) => Outcome::Stable,
            (true, false) => Outcome::Held,
            (false, _) => Outcome::Swings,
        }
    }
}

impl Map {
    /// Runs an operation with these hands and gains.
    pub fn of(
        operation: Operation,
        config: &Config<'_>,
        stiffnesses: &[f64],
        gains: &[f32],
    ) -> Result<Self, HapticsError> {
        let pairs: Vec<(f64, f32)> =
            stiffnesses.iter().flat_map(|k| gains.iter().map(|gain| (*k, *gain))).collect();
        let run = |(stiffness, gain): (f64, f32)| {
            let operation = Operation { hand: Hand { stiffness, ..operation.hand }, ..operation };
            let mut own = config.clone();
            match operation.axis {
                Axis::Linear => own.settings.force_gain = gain,
                Axis::Rotary => own.settings.torque_gain = gain,
            }
            let (with, without) = (operation.run(&own)?, operation.run_without_observer(&own)?);
            Ok(Cell { gain, stiffness, with, without })
        };
        let cells: Result<Vec<Cell>, HapticsError> = pairs.into_par_iter().map(run).collect();
        let (gains, stiffnesses) = (gains.to_vec(), stiffnesses.to_vec());
        Ok(Self { operation, gains, stiffnesses, cells: cells? })
    }

    /// A row a hand, a column a gain.
    pub fn table(&self) -> String {
        let unit = match self.operation.axis {
            Axis::Linear => "N/m",
            Axis::Rotary => "N·m/rad",
        };
        let mut text = format!("| hand, {unit} |");
        // Writing to a string does not fail.
        for gain in &self.gains {
            let _ = write!(text, " gain {gain} |");
        }
        let _ = write!(text, "\n| ---: |{}\n", " --- |".repeat(self.gains.len()));
        for (stiffness, row) in self.stiffnesses.iter().zip(self.cells.chunks(self.gains.len())) {
            let _ = write!(text, "| {stiffness} |");
            for cell in row {
                let word = match cell.outcome() {
                    Outcome::Stable => "stable",
                    Outcome::Held => "held",
                    Outcome::Swings => "swings",
                };
                let _ = write!(text, " {word} |");
            }
            text.push('\n');
        }
        text
    }

    /// The largest step that fingers felt where the loop is stable \[N\], \[N·m\].
    pub fn largest_step(&self) -> f64 {
        let stable = self.cells.iter().filter(|cell| cell.outcome() == Outcome::Stable);
        stable.map(|cell| cell.with.largest_step).fold(0.0, f64::max)
    }
}
