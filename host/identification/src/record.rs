//! Records of experiments as files: CSV with a header, a row a sample.

use std::path::Path;

use cathforce_bundle::{Numbers, nearest};
use cathforce_filter::{Clock, ClockError};

use crate::error::IdentificationError;

/// Time since the release, since the drive started, or on the clock of the beats \[s\].
pub const TIME: &str = "t_s";
/// Height of the tip over the clamp \[m\].
pub const HEIGHT: &str = "height_m";
/// Displacement of the tendon's drive, positive where it pulls \[m\].
pub const TENDON: &str = "tendon_m";
/// Displacement of the tip from the clamp's axis, positive where the tendon bends it to \[m\].
pub const TIP: &str = "tip_m";
/// Displacement of the tip from the clamp's axis, positive along the flow \[m\].
pub const POSITION: &str = "position_m";

/// Steps that are longer are milliseconds which are taken for seconds: a catheter swings several times a
/// second, and a record with a step of a second tells nothing of it \[s\].
const LONGEST_STEP_S: f64 = 1.0;
/// A tip is no farther from its clamp than the free length, but for the errors of length and sensor.
const FARTHEST: f64 = 1.05;

/// A record as its file has it.
#[derive(Clone, Debug, PartialEq)]
pub struct Sampled {
    /// The file, for errors.
    pub shown: String,
    pub from_s: f64,
    pub step_s: f64,
    /// By column, but for the time.
    pub columns: Vec<Vec<f64>>,
}

impl Sampled {
    /// Reads a record with a column `t_s` and these ones of positions in metres, none of which is farther
    /// than the free length. Errors, with line, cause and fix: what no table is, other columns, missing or
    /// infinite numbers, times that are not even, and units that cannot be.
    pub fn read(path: &Path, names: &[&str], length_m: f64) -> Result<Self, IdentificationError> {
        let shown = path.display().to_string();
        let refused = |line: Option<usize>, cause: String, fix: String| {
            let place = line.map_or(shown.clone(), |line| format!("{shown}:{line}"));
            IdentificationError::file(place, cause, fix)
        };
        let text = std::fs::read_to_string(path).map_err(|error| {
            let fix = "check the path, which is relative to the description's folder";
            refused(None, format!("cannot be read: {error}"), fix.into())
        })?;
        let all: Vec<&str> = [TIME].into_iter().chain(names.iter().copied()).collect();
        let Numbers { mut columns, lines } =
            Numbers::read(&text, &all).map_err(|(place, cause)| {
                // What is meant by a unit that is not read, such as `height_mm`.
                let fix = match &cause {
                    cathforce_bundle::TableCause::UnknownColumn { name, .. }
                        if nearest(name, &all).is_some() =>
                    {
                        format!("name the columns `{}`, in seconds and metres", all.join("`, `"))
                    }
                    cause => cause.fix(),
                };
                IdentificationError::file(format!("{shown}{place}"), cause.to_string(), fix)
            })?;
        let t_s = columns.remove(0);
        let clock = Clock::of(&t_s, false).map_err(|error| {
            let line = error.row().map(|row| lines[row]);
            refused(line, format!("column `{TIME}`: {error}"), fix_of(error).into())
        })?;
        if clock.step_s > LONGEST_STEP_S {
            let cause =
                format!("the rows are {} s apart: milliseconds taken for seconds?", clock.step_s);
            return Err(refused(Some(lines[1]), cause, format!("give `{TIME}` in seconds")));
        }
        for (name, column) in names.iter().zip(&columns) {
            let most_m = FARTHEST * length_m;
            if let Some(row) = column.iter().position(|x| x.abs() > most_m) {
                let cause = format!(
                    "`{name}` is {} m, and the catheter is {length_m} m long: millimetres taken for metres?",
                    column[row]
                );
                let fix = "give positions in metres, from the clamp; check `length_m`";
                return Err(refused(Some(lines[row]), cause, fix.into()));
            }
        }
        // The mean step: the usual one may be rounded.
        let step_s = (t_s[t_s.len() - 1] - t_s[0]) / (t_s.len() - 1) as f64;
        Ok(Self { shown, from_s: t_s[0], step_s, columns })
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    /// A fault of the record as a whole.
    pub fn refused(&self, cause: impl std::fmt::Display, fix: &str) -> IdentificationError {
        IdentificationError::file(self.shown.clone(), cause.to_string(), fix)
    }
}

fn fix_of(error: ClockError) -> &'static str {
    match error {
        ClockError::TooFew { .. } => "record longer",
        ClockError::NotRising { .. } => "sort the rows by time, and give one experiment a file",
        ClockError::Gap { .. } => "give an experiment without a gap, or fill the gap",
        ClockError::Uneven { .. } => "resample the record to even times first",
    }
}

/// Writes a record. `columns`: names and values, the time first.
pub fn to_csv(columns: &[(&str, Vec<f64>)]) -> String {
    let names: Vec<&str> = columns.iter().map(|(name, _)| *name).collect();
    let mut text = names.join(",") + "\n";
    let rows = columns.iter().map(|(_, values)| values.len()).min().unwrap_or(0);
    for row in 0..rows {
        // Micrometres and microseconds, below what a sensor tells.
        let each: Vec<String> =
            columns.iter().map(|(_, values)| format!("{:.6}", values[row])).collect();
        text += &each.join(",");
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Sampled, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("swing.csv");
        std::fs::write(&path, text).unwrap();
        Sampled::read(&path, &[HEIGHT], 0.1).map_err(|error| error.to_string())
    }

    #[test]
    fn a_record_is_what_was_written() {
        let columns =
            [(TIME, vec![0.0, 0.025, 0.05, 0.075]), (HEIGHT, vec![0.0, 0.01, 0.02, 0.01])];
        let own = read(&to_csv(&columns)).unwrap();
        assert_eq!((own.samples(), own.from_s), (4, 0.0));
        assert!((own.step_s - 0.025).abs() < 1e-12);
        assert_eq!(own.columns, [columns[1].1.clone()]);
    }

    #[test]
    fn a_broken_record_is_refused_with_its_line_cause_and_fix() {
        let rows = "t_s,height_m\n0,0\n0.1,0.01\n0.2,0.02\n0.3,0.01\n0.4,0.02\n";
        let milliseconds = "t_s,height_m\n0,0\n25,0\n50,0\n75,0\n";
        for (text, words) in [
            (
                rows.replace("height_m", "height_mm"),
                "csv:1:2: unknown column `height_mm`; did you mean `height_m`?",
            ),
            (rows.replace("t_s,", "time,"), "csv:1:1: unknown column `time`"),
            (
                rows.replace("0.2,0.02", "0.2,nan"),
                "csv:4:2: `nan` in column `height_m` is not finite",
            ),
            (rows.replace("0.2,0.02", "0.2,"), "csv:4:2: column `height_m` has no value"),
            (rows.replace("0.2,0.02", "0.26,0.02"), "csv:4: column `t_s`: no value for 0.1600 s"),
            (
                rows.replace("0.2,0.02", "0.225,0.02"),
                "csv:4: column `t_s`: the rows are not equally far",
            ),
            (rows.replace("0.2,0.02\n", ""), "csv:4: column `t_s`: no value for 0.2000 s"),
            (
                rows.replace("0.3,", "0.1,"),
                "csv:5: column `t_s`: the time goes from 0.2 s to 0.1 s",
            ),
            (
                rows.replace("0.2,0.02", "0.2,20"),
                "csv:4: `height_m` is 20 m, and the catheter is 0.1 m long",
            ),
            (milliseconds.to_owned(), "csv:3: the rows are 25 s apart: milliseconds"),
            (rows[..26].to_owned(), "csv: column `t_s`: there are 2 values"),
            (String::new(), "csv:1: the file is empty"),
        ] {
            let error = read(&text).unwrap_err();
            assert!(error.contains(words) && error.contains("\n  fix: "), "`{words}` in: {error}");
        }
        let missing = Sampled::read(Path::new("/nowhere/a.csv"), &[HEIGHT], 0.1).unwrap_err();
        assert!(missing.to_string().contains("/nowhere/a.csv: cannot be read"), "{missing}");
    }
}
