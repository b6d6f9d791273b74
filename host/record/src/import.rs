//! Measurements of other tools, as the rows of a trial.
//!
//! Two kinds of text: the log of an ATI force/torque sensor, whose counts become a force in the
//! vessel frame, and any CSV, whose columns are named one by one.

mod table;

use std::io::{self, Read};

pub use table::{ColumnMap, read_csv};

use crate::trial::{Measured, MeasuredDrive};

/// What is wrong with a text, and where.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {problem}; fix: {fix}")]
pub struct ImportError {
    pub line: u64,
    pub problem: String,
    pub fix: String,
}

impl ImportError {
    fn new(line: u64, problem: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { line, problem: problem.into(), fix: fix.into() }
    }
}

/// Where the axis of the vessel frame lies in the sensor's: which of its axes, and the sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AxisMap([(usize, i8); 3]);

impl AxisMap {
    /// The frames are the same.
    pub const SAME: Self = Self([(0, 1), (1, 1), (2, 1)]);

    /// From `+y,-x,+z`: the vessel's x is the sensor's y, its y the sensor's −x.
    pub fn parse(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is no axis map: write three axes, e.g. `+y,-x,+z`");
        let axis = |word: &str| {
            let word = word.trim();
            let (sign, name) = match word.strip_prefix('-') {
                Some(name) => (-1, name),
                None => (1, word.strip_prefix('+').unwrap_or(word)),
            };
            let index = ["x", "y", "z"].iter().position(|axis| *axis == name)?;
            Some((index, sign))
        };
        let axes = text.split(',').map(axis).collect::<Option<Vec<_>>>().ok_or_else(wrong)?;
        let axes: [(usize, i8); 3] = axes.try_into().map_err(|_| wrong())?;
        let all = (0..3).all(|k| axes.iter().any(|(index, _)| *index == k));
        if all { Ok(Self(axes)) } else { Err(wrong()) }
    }

    /// Whether it turns one right-handed frame into another. One that does not is right only for
    /// a sensor that reports the reaction.
    pub fn is_rotation(self) -> bool {
        let [a, b, c] = self.0.map(|(index, _)| index);
        let even = matches!([a, b, c], [0, 1, 2] | [1, 2, 0] | [2, 0, 1]);
        let sign: i8 = self.0.iter().map(|(_, sign)| sign).product();
        even == (sign > 0)
    }

    fn apply(self, sensor: [f64; 3]) -> [f64; 3] {
        self.0.map(|(index, sign)| f64::from(sign) * sensor[index])
    }
}

/// What a sensor's log does not say of itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtiOptions {
    /// Counts that are one newton; 1 for a log in newtons.
    pub counts_per_n: f64,
    pub axes: AxisMap,
    /// The mean over so much of the log's beginning is subtracted \[s\].
    pub tare_s: f64,
    /// Rows a second, for a log without a column of time.
    pub rate_hz: Option<f64>,
}

/// A force \[N\], vessel frame, and its time since the log's first row \[s\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceSample {
    pub t_s: f64,
    pub force_n: [f64; 3],
}

/// Reads the log of an ATI sensor: lines of text, among them one that names the columns, then
/// rows of numbers.
///
/// `Fx`, `Fy`, `Fz` must be among the names, with or without a unit; `Time` \[s\] may be.
/// Commas, semicolons and tabs separate. Numbers have a point.
pub fn read_ati(mut log: impl Read, options: &AtiOptions) -> Result<Vec<ForceSample>, ImportError> {
    let text = read_text(&mut log)?;
    let mut lines = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty());
    let columns = lines.by_ref().find_map(|(at, line)| Some((at, AtiColumns::find(line)?)));
    let Some((named_at, columns)) = columns else {
        let fix = "give the log with its heading, which names Fx, Fy and Fz";
        return Err(ImportError::new(1, "no line names the columns Fx, Fy and Fz", fix));
    };
    let period_s = match (columns.time, options.rate_hz) {
        (Some(_), _) => None,
        (None, Some(rate_hz)) => Some(1.0 / rate_hz),
        (None, None) => {
            let fix = "give the rate of the sensor with --rate";
            return Err(ImportError::new(named_at, "there is no column Time", fix));
        }
    };
    let mut samples: Vec<ForceSample> = Vec::new();
    let mut start_s = None;
    for (line, row) in lines {
        let fields = split(row);
        if fields.len() != columns.count {
            let problem =
                format!("{} fields, but {} columns are named", fields.len(), columns.count);
            return Err(ImportError::new(line, problem, "take this line out, or log anew"));
        }
        let number = |index: usize| number(line, fields.get(index).copied().unwrap_or(""));
        let counts =
            [number(columns.force[0])?, number(columns.force[1])?, number(columns.force[2])?];
        let t_s = match (columns.time, period_s) {
            (Some(index), _) => {
                let t_s = number(index)?;
                t_s - *start_s.get_or_insert(t_s)
            }
            (None, period_s) => samples.len() as f64 * period_s.unwrap_or_default(),
        };
        if let Some(before) = samples.last().filter(|before| before.t_s >= t_s) {
            let problem = format!("time goes from {} s to {t_s} s", before.t_s);
            return Err(ImportError::new(line, problem, "sort the rows, drop repeated ones"));
        }
        let force_n = options.axes.apply(counts.map(|x| x / options.counts_per_n));
        samples.push(ForceSample { t_s, force_n });
    }
    if samples.is_empty() {
        return Err(ImportError::new(named_at, "no row of numbers follows", "log anew"));
    }
    tare(&mut samples, options.tare_s);
    Ok(samples)
}

struct AtiColumns {
    force: [usize; 3],
    time: Option<usize>,
    count: usize,
}

impl AtiColumns {
    fn find(line: &str) -> Option<Self> {
        let names = split(line);
        let plain = |name: &str| {
            let name = name.trim_matches(['"', '\'']).to_lowercase();
            let end = name.find(['(', '[', ' ', '_']).unwrap_or(name.len());
            name[..end].to_owned()
        };
        let at = |wanted: &str| names.iter().position(|name| plain(name) == wanted);
        Some(Self {
            force: [at("fx")?, at("fy")?, at("fz")?],
            time: at("time").or_else(|| at("t")),
            count: names.len(),
        })
    }
}

/// The fields of a line; a separator at its end begins none.
fn split(line: &str) -> Vec<&str> {
    let mut fields: Vec<_> = line.split([',', ';', '\t']).map(str::trim).collect();
    if fields.len() > 1 && fields.last() == Some(&"") {
        fields.pop();
    }
    fields
}

fn tare(samples: &mut [ForceSample], tare_s: f64) {
    let still = samples.partition_point(|sample| sample.t_s < tare_s);
    let Some(still) = samples.get(..still).filter(|still| !still.is_empty()) else { return };
    let mean: [f64; 3] = std::array::from_fn(|k| {
        still.iter().map(|sample| sample.force_n[k]).sum::<f64>() / still.len() as f64
    });
    for sample in samples {
        for (force_n, mean) in sample.force_n.iter_mut().zip(mean) {
            *force_n -= mean;
        }
    }
}

/// Puts a force beside a motion: a row for each force, with the motion interpolated there.
///
/// `offset_s` is added to the time of the force. Rows outside the motion are left out and
/// counted.
pub fn join(motion: &[Measured], forces: &[ForceSample], offset_s: f64) -> (Vec<Measured>, usize) {
    let rows: Vec<_> = forces
        .iter()
        .filter_map(|sample| {
            let t_s = sample.t_s + offset_s;
            let next = motion.partition_point(|row| row.t_s < t_s);
            let after = motion.get(next)?;
            let before = if after.t_s == t_s { after } else { motion.get(next.checked_sub(1)?)? };
            let span_s = after.t_s - before.t_s;
            let share = if span_s > 0.0 { (t_s - before.t_s) / span_s } else { 0.0 };
            let between = |a: f64, b: f64| a + share * (b - a);
            Some(Measured {
                t_s,
                insertion_m: between(before.insertion_m, after.insertion_m),
                rotation_rad: between(before.rotation_rad, after.rotation_rad),
                force_n: Some(sample.force_n),
                drive_force_n: None,
                tip_m: None,
                guidewire: before.guidewire.zip(after.guidewire).map(|(a, b)| MeasuredDrive {
                    insertion_m: between(a.insertion_m, b.insertion_m),
                    rotation_rad: between(a.rotation_rad, b.rotation_rad),
                    drive_force_n: None,
                }),
            })
        })
        .collect();
    let left_out = forces.len() - rows.len();
    (rows, left_out)
}

fn number(line: u64, field: &str) -> Result<f64, ImportError> {
    let found = field.parse::<f64>().ok().filter(|x| x.is_finite());
    found.ok_or_else(|| {
        let fix = "write a number with a point, e.g. 0.25";
        ImportError::new(line, format!("`{field}` is no number"), fix)
    })
}

fn read_text(log: &mut impl Read) -> Result<String, ImportError> {
    let mut bytes = Vec::new();
    let failed =
        |e: io::Error| ImportError::new(1, format!("cannot be read: {e}"), "copy it again");
    log.read_to_end(&mut bytes).map_err(failed)?;
    String::from_utf8(bytes).map_err(|e| {
        let whole = e.as_bytes().get(..e.utf8_error().valid_up_to()).unwrap_or_default();
        let line = 1 + whole.iter().filter(|b| **b == b'\n').count() as u64;
        ImportError::new(line, "this is no UTF-8 text", "give a text file, or save it as UTF-8")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOG: &str = "ATI Industrial Automation\n\
        Status (hex),RDT Sequence,Fx,Fy,Fz,Tx,Ty,Tz,Time (s)\n\
        0,1,100,200,-300,1,1,1,10.0\n\
        0,2,100,200,-300,1,1,1,10.5\n\
        0,3,1100,200,-300,1,1,1,11.0,\n";

    fn options() -> AtiOptions {
        let axes = AxisMap::parse("+y,-x,+z").unwrap();
        AtiOptions { counts_per_n: 1000.0, axes, tare_s: 0.0, rate_hz: None }
    }

    #[test]
    fn counts_become_newtons_in_the_vessel_frame() {
        let samples = read_ati(LOG.as_bytes(), &options()).unwrap();
        assert_eq!(samples[0], ForceSample { t_s: 0.0, force_n: [0.2, -0.1, -0.3] });
        assert_eq!(samples[2], ForceSample { t_s: 1.0, force_n: [0.2, -1.1, -0.3] });
        let tared = read_ati(LOG.as_bytes(), &AtiOptions { tare_s: 0.75, ..options() }).unwrap();
        assert_eq!(tared[1].force_n, [0.0; 3]);
        assert_eq!(tared[2].force_n, [0.0, -1.0, 0.0]);
    }

    #[test]
    fn without_time_the_rate_says_when() {
        let log = "Fx;Fy;Fz\n1;2;3\n4;5;6\n";
        let error = read_ati(log.as_bytes(), &options()).unwrap_err().to_string();
        assert!(error.contains("no column Time") && error.contains("--rate"), "{error}");
        let samples = read_ati(log.as_bytes(), &AtiOptions { rate_hz: Some(4.0), ..options() });
        assert_eq!(samples.unwrap()[1].t_s, 0.25);
    }

    #[test]
    fn what_is_wrong_in_a_log_is_named_with_its_line() {
        let wrong = |from: &str, to: &str| {
            let text = LOG.replace(from, to);
            let error = read_ati(text.as_bytes(), &options()).unwrap_err().to_string();
            assert!(error.contains("fix:"), "{error}");
            error
        };
        assert!(wrong("Fy", "Fq").starts_with("line 1: no line names"));
        assert!(wrong("0,2,100,", "0,2,").starts_with("line 4: 8 fields, but 9"));
        assert!(wrong("0,2,100,", "0,2,1OO,").starts_with("line 4: `1OO` is no number"));
        assert!(wrong("0,2,100,", "0,2,NaN,").starts_with("line 4: `NaN` is no number"));
        assert!(wrong("10.5", "9.5").starts_with("line 4: time goes"));
        let bytes = [LOG.as_bytes(), &[0xFF]].concat();
        let error = read_ati(&bytes[..], &options()).unwrap_err().to_string();
        assert!(error.starts_with("line 6: this is no UTF-8"), "{error}");
        let heading = LOG.lines().take(2).collect::<Vec<_>>().join("\n");
        let error = read_ati(heading.as_bytes(), &options()).unwrap_err().to_string();
        assert!(error.starts_with("line 2: no row"), "{error}");
    }

    #[test]
    fn an_axis_map_names_each_axis_once() {
        for (text, rotation) in [("x,y,z", true), ("+y,-x,+z", true), ("-x,-y,-z", false)] {
            assert_eq!(AxisMap::parse(text).unwrap().is_rotation(), rotation, "{text}");
        }
        assert!(!AxisMap::parse("y,x,z").unwrap().is_rotation());
        for text in ["", "x,y", "x,y,y", "x,y,w", "x,y,z,x"] {
            assert!(AxisMap::parse(text).unwrap_err().contains("+y,-x,+z"), "{text}");
        }
    }

    fn at(t_s: f64, insertion_m: f64) -> Measured {
        Measured {
            t_s,
            insertion_m,
            rotation_rad: -insertion_m,
            force_n: None,
            drive_force_n: None,
            tip_m: None,
            guidewire: None,
        }
    }

    #[test]
    fn a_force_takes_the_motion_of_its_time() {
        let force = |t_s| ForceSample { t_s, force_n: [t_s; 3] };
        let motion = [at(0.0, 0.1), at(1.0, 0.2)];
        let (rows, left_out) = join(&motion, &[-0.1, 0.0, 0.5, 1.0, 1.1].map(force), 0.0);
        assert_eq!((rows.len(), left_out), (3, 2));
        let expected = 0.1 + 0.5 * (0.2 - 0.1);
        assert_eq!((rows[1].insertion_m, rows[1].rotation_rad), (expected, -expected));
        assert_eq!(rows[2].insertion_m, 0.2);
        assert_eq!(rows[2].force_n, Some([1.0; 3]));
        let (rows, left_out) = join(&motion, &[force(0.0)], 2.0);
        assert_eq!((rows.len(), left_out), (0, 1));
        assert_eq!(join(&[], &[force(0.0)], 0.0), (vec![], 1));
    }
}
