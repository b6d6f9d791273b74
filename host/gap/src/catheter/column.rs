//! The measured columns of a trial, and the channels that they are compared as.

use crate::plant::{Channel, Quantity};

/// Force samples are means over this time \[s\]; `Catheter::compared` says so.
pub const AVERAGE_S: f64 = 0.02;

/// One measured column.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Source {
    Force(usize),
    DriveForce,
    Tip(usize),
    Shape(usize, usize),
}

const AXES: [&str; 3] = ["x", "y", "z"];

impl Source {
    pub fn channel(self) -> Channel {
        let (name, quantity) = match self {
            Self::Force(axis) => (format!("f{}_N", AXES[axis]), Quantity::Force),
            Self::DriveForce => ("drive_fx_N".to_owned(), Quantity::DriveForce),
            Self::Tip(axis) => (format!("tip_{}_m", AXES[axis]), Quantity::Tip),
            Self::Shape(point, axis) => (format!("p{point:02}_{}_m", AXES[axis]), Quantity::Shape),
        };
        Channel { name, quantity }
    }
}

/// A measured column with gaps.
#[derive(Clone, Debug)]
pub struct Column {
    pub source: Source,
    pub rows: Vec<(usize, f64)>,
    /// Standard deviation of one row.
    pub noise: f64,
    /// Whether it was estimated from the rows.
    pub estimated: bool,
}
