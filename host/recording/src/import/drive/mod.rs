//! Logs of a drive on its own, as labs have them: each becomes one or several trials of a drive bundle.
//!
//! Times, positions and commands are converted to SI units. Rows without a value are dropped, and where the log has no
//! row for longer than a trial may have none, it is cut in two. What was understood is said.

mod bam;
mod can;
mod columns;
mod numbers;
mod units;

use cathforce_bundle::bundle::{Axis, CommandKind, DriveTrial, LONGEST_GAP_S};

pub use bam::{Bam, BamOptions, read_bam};
pub use can::read_odrive_can;
pub use columns::{Column, Wanted, read_columns, read_moteus, read_odrive};
pub use units::{DriveUnit, Measure};

use super::error::ImportError;

/// Fewest rows of a piece that is kept: a diagnosis needs as many.
const FEWEST_ROWS: usize = 100;

/// Rows of a log in SI units, before they are checked.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows {
    pub t_s: Vec<f64>,
    pub position: Vec<f64>,
    pub command: Vec<f64>,
    pub setpoint: Option<Vec<Option<f64>>>,
    pub load: Option<Vec<f64>>,
    /// Line of each row in the file; of a JSON its entry.
    pub lines: Vec<u64>,
    /// Rows of the file that had no number somewhere, or were not driven.
    pub dropped: usize,
}

/// A log that was read.
#[derive(Clone, Debug, PartialEq)]
pub struct DriveLog {
    /// Times from 0 on, and columns.
    pub trials: Vec<(Vec<f64>, DriveTrial)>,
    pub understood: Vec<String>,
    pub remarks: Vec<String>,
}

impl Rows {
    /// Cuts the rows where there is none for long, and says what they are.
    pub fn into_log(
        self,
        axis: Axis,
        kind: CommandKind,
        mut understood: Vec<String>,
    ) -> Result<DriveLog, ImportError> {
        let mut remarks = Vec::new();
        let all = self.t_s.len() + self.dropped;
        if self.dropped > 0 {
            remarks.push(format!(
                "{} of {all} rows are dropped: a value is missing, or the drive was off",
                self.dropped
            ));
        }
        if self.t_s.is_empty() {
            return Err(ImportError::new(
                1,
                "no row has a time, a position and a command",
                "check which columns are named, and that the log holds a motion",
            ));
        }
        let mut kept = vec![0];
        let mut same = 0;
        for row in 1..self.t_s.len() {
            let (before, now) = (self.t_s[*kept.last().unwrap_or(&0)], self.t_s[row]);
            if now > before {
                kept.push(row);
            } else if now == before {
                same += 1;
            } else {
                return Err(ImportError::new(
                    self.lines.get(row).copied().unwrap_or(1),
                    format!("time goes back from {before} s to {now} s"),
                    "sort the rows by time; where the clock was set back, cut the log in two there",
                ));
            }
        }
        if same > 0 {
            remarks
                .push(format!("{same} rows have the time of the row before them and are dropped"));
        }
        let mut pieces: Vec<Vec<usize>> = vec![Vec::new()];
        let mut gaps = Vec::new();
        for &row in &kept {
            let last = pieces.last().and_then(|piece| piece.last()).copied();
            if let Some(last) = last
                && self.t_s[row] - self.t_s[last] > LONGEST_GAP_S
            {
                gaps.push(format!(
                    "{:.3} s after {:.3} s",
                    self.t_s[row] - self.t_s[last],
                    self.t_s[last]
                ));
                pieces.push(Vec::new());
            }
            if let Some(piece) = pieces.last_mut() {
                piece.push(row);
            }
        }
        if !gaps.is_empty() {
            remarks.push(format!(
                "there are no rows for {}; a trial needs one every {LONGEST_GAP_S} s, so the log is cut there",
                gaps.join(", ")
            ));
        }
        let short = pieces.iter().filter(|piece| piece.len() < FEWEST_ROWS).count();
        let pieces: Vec<Vec<usize>> =
            pieces.into_iter().filter(|piece| piece.len() >= FEWEST_ROWS).collect();
        if short > 0 {
            remarks.push(format!("{short} pieces of less than {FEWEST_ROWS} rows are left out"));
        }
        if pieces.is_empty() {
            return Err(ImportError::new(
                1,
                format!(
                    "no piece of the log has {FEWEST_ROWS} rows without a gap of {LONGEST_GAP_S} s"
                ),
                "record faster or longer; check the unit of the time: milliseconds that are taken for seconds have gaps",
            ));
        }
        let of = |column: &[f64], piece: &[usize]| {
            piece.iter().map(|&row| column[row]).collect::<Vec<f64>>()
        };
        let mut trials = Vec::new();
        for piece in &pieces {
            let start_s = self.t_s[piece[0]];
            let t_s: Vec<f64> = piece.iter().map(|&row| self.t_s[row] - start_s).collect();
            let position = of(&self.position, piece);
            let low = position.iter().copied().fold(f64::INFINITY, f64::min);
            let high = position.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let command = of(&self.command, piece);
            let most = command.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            let unit = match (kind, axis) {
                (CommandKind::Force, Axis::Linear) => "N",
                (CommandKind::Force, Axis::Rotary) => "N·m",
                (CommandKind::Current, _) => "A",
                (CommandKind::Voltage, _) => "V",
            };
            let last_s = t_s.last().copied().unwrap_or_default();
            understood.push(format!(
                "{} rows over {last_s:.3} s, {:.0} a second; position {low:.4} to {high:.4} {}; command up to {most:.4} {unit}",
                piece.len(),
                (piece.len() - 1) as f64 / last_s.max(f64::MIN_POSITIVE),
                axis.unit()
            ));
            let setpoint = self.setpoint.as_ref();
            let data = DriveTrial {
                axis,
                kind,
                position,
                command,
                setpoint: setpoint.map(|own| piece.iter().map(|&row| own[row]).collect()),
                load: self.load.as_ref().map(|own| of(own, piece)),
            };
            trials.push((t_s, data));
        }
        Ok(DriveLog { trials, understood, remarks })
    }
}
