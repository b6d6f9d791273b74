//! A part of a system: one experiment and its figures.

use crate::meter::{Meter, Trouble};
use crate::plot::Plot;
use crate::row::Row;

/// What a part gives.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    pub rows: Vec<Row>,
    pub plots: Vec<Plot>,
}

impl Outcome {
    /// Rows without a drawing.
    pub fn rows(rows: Vec<Row>) -> Self {
        Self { rows, plots: Vec::new() }
    }
}

/// An experiment of a system.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// What it is of, for the row that says that it failed.
    pub name: &'static str,
    /// Its work, approximately, in the unit of a [`Meter`].
    pub work: fn() -> u64,
    pub run: fn(&Meter) -> Result<Outcome, Trouble>,
}
