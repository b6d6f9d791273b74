//! Reads the log of an ATI force/torque sensor; counts become newtons in the vessel frame.

use std::io::Read;

use super::ati_heading::Heading;
use super::error::{ImportError, read_text};

/// For each axis of the vessel frame, the axis of the sensor and its sign.
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

    /// Whether it is a rotation. A map with a reflection is right only for a sensor that reports the
    /// reaction force.
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

/// What a sensor's log does not state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtiOptions {
    /// Counts that are one newton; 1 for a log in newtons.
    pub counts_per_n: f64,
    pub axes: AxisMap,
    /// Time at the log's beginning whose mean force is subtracted \[s\].
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

/// The forces of a log.
#[derive(Clone, Debug, PartialEq)]
pub struct AtiLog {
    /// At least one sample, sorted by time.
    pub samples: Vec<ForceSample>,
    /// Whether the log has a time column, so that no rate is needed.
    pub has_time: bool,
}

/// Reads the log of an ATI sensor: lines of text, among them one that names the columns, then
/// rows of numbers.
///
/// `Fx`, `Fy`, `Fz` must be among the names, with or without a unit; `Time` \[s\] may be.
/// Commas, semicolons and tabs separate. Numbers have a point.
pub fn read_ati(mut log: impl Read, options: &AtiOptions) -> Result<AtiLog, ImportError> {
    let text = read_text(&mut log)?;
    if text.trim().is_empty() {
        return Err(ImportError::new(1, "the file is empty", "log anew"));
    }
    let text = text.trim_start_matches('\u{feff}');
    let mut lines = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty());
    let names = lines.by_ref().map(|(at, line)| (at, split(line)));
    let named = names.into_iter().find(|(_, names)| Heading::is_one(names));
    let Some((named_at, names)) = named else {
        let fix = "give the log with its heading, which names Fx, Fy and Fz";
        return Err(ImportError::new(1, "no line names the columns Fx, Fy and Fz", fix));
    };
    let wrong = |(problem, fix): (String, String)| ImportError::new(named_at, problem, fix);
    let heading = Heading::read(&names, options.counts_per_n).map_err(wrong)?;
    let period_s = match (heading.time, options.rate_hz) {
        (Some(_), _) => None,
        (None, Some(rate_hz)) => Some(1.0 / rate_hz),
        (None, None) => {
            let fix = "give the rate of the sensor with --rate";
            return Err(ImportError::new(named_at, "there is no column Time", fix));
        }
    };
    let mut rows = Rows { names, heading, period_s, options, samples: Vec::new(), start_s: None };
    let mut last_line = named_at;
    for (line, row) in lines {
        rows.take(line, row)?;
        last_line = line;
    }
    let (has_time, mut samples) = (rows.heading.time.is_some(), rows.samples);
    let Some(last) = samples.last() else {
        return Err(ImportError::new(named_at, "no row of numbers follows", "log anew"));
    };
    // The mean would then include the contact force.
    if options.tare_s > last.t_s && samples.len() > 1 {
        let problem = format!("the log ends {} s after its beginning, within the tare", last.t_s);
        let fix = "give --tare only the seconds in which nothing touched";
        return Err(ImportError::new(last_line, problem, fix));
    }
    tare(&mut samples, options.tare_s);
    Ok(AtiLog { samples, has_time })
}

/// The rows of a log below its heading.
struct Rows<'a> {
    names: Vec<&'a str>,
    heading: Heading,
    /// Time between rows \[s\], for a log without a time column.
    period_s: Option<f64>,
    options: &'a AtiOptions,
    samples: Vec<ForceSample>,
    /// Time of the first row \[s\].
    start_s: Option<f64>,
}

impl Rows<'_> {
    /// Reads the next row.
    fn take(&mut self, line: u64, row: &str) -> Result<(), ImportError> {
        let fields = split(row);
        if fields.len() != self.names.len() {
            let problem =
                format!("{} fields, but {} columns are named", fields.len(), self.names.len());
            // A decimal comma splits a number into two fields.
            let fix = match row.contains(',') && row.contains([';', '\t']) {
                true => "write numbers with a point, a comma separates",
                false => "take this line out, or log anew",
            };
            return Err(ImportError::new(line, problem, fix));
        }
        if self.samples.is_empty() && fields.iter().all(|field| field.parse::<f64>().is_err()) {
            let problem = "the row has words and no number";
            let fix = "take it out, and write units into the names, `Fx (N)`";
            return Err(ImportError::new(line, problem, fix));
        }
        let number = |index: usize| number(line, self.names[index], fields[index]);
        let [x, y, z] = self.heading.force;
        let counts = [number(x)?, number(y)?, number(z)?];
        let t_s = match self.heading.time {
            Some(index) => {
                let t_s = number(index)?;
                t_s - *self.start_s.get_or_insert(t_s)
            }
            None => self.samples.len() as f64 * self.period_s.unwrap_or_default(),
        };
        if let Some(before) = self.samples.last().filter(|before| before.t_s >= t_s) {
            let problem = format!("time goes from {} s to {t_s} s", before.t_s);
            return Err(ImportError::new(line, problem, "sort the rows, drop repeated ones"));
        }
        let force_n = self.options.axes.apply(counts.map(|x| x / self.options.counts_per_n));
        self.samples.push(ForceSample { t_s, force_n });
        Ok(())
    }
}

/// The fields of a line; a separator at its end begins no further field.
fn split(line: &str) -> Vec<&str> {
    let mut fields: Vec<_> = line.split([',', ';', '\t']).map(str::trim).collect();
    if fields.len() > 1 && fields.last() == Some(&"") {
        fields.pop();
    }
    fields
}

fn number(line: u64, name: &str, field: &str) -> Result<f64, ImportError> {
    let found = field.parse::<f64>().ok().filter(|x| x.is_finite());
    found.ok_or_else(|| {
        let problem = match field {
            "" => format!("column `{name}` is empty"),
            field => format!("`{field}` is no number, in column `{name}`"),
        };
        let fix = "take the line out; a number has a point, e.g. 0.25";
        ImportError::new(line, problem, fix)
    })
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
        let AtiLog { samples, has_time } = read_ati(LOG.as_bytes(), &options()).unwrap();
        assert!(has_time);
        assert_eq!(samples[0], ForceSample { t_s: 0.0, force_n: [0.2, -0.1, -0.3] });
        assert_eq!(samples[2], ForceSample { t_s: 1.0, force_n: [0.2, -1.1, -0.3] });
        let tared = AtiOptions { tare_s: 0.75, ..options() };
        let tared = read_ati(LOG.as_bytes(), &tared).unwrap().samples;
        assert_eq!(tared[1].force_n, [0.0; 3]);
        assert_eq!(tared[2].force_n, [0.0, -1.0, 0.0]);
    }

    #[test]
    fn without_time_the_rate_says_when() {
        let log = "Fx;Fy;Fz\n1;2;3\n4;5;6\n";
        let error = read_ati(log.as_bytes(), &options()).unwrap_err().to_string();
        assert!(error.contains("no column Time") && error.contains("--rate"), "{error}");
        let log =
            read_ati(log.as_bytes(), &AtiOptions { rate_hz: Some(4.0), ..options() }).unwrap();
        assert_eq!((log.samples[1].t_s, log.has_time), (0.25, false));
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
        let nan = wrong("0,2,100,", "0,2,NaN,");
        assert!(nan.starts_with("line 4: `NaN` is no number, in column `Fx`"), "{nan}");
        assert!(wrong("0,2,100,", "0,2,,").starts_with("line 4: column `Fx` is empty"));
        let units = wrong("Time (s)\n", "Time (s)\n-,-,N,N,N,Nm,Nm,Nm,s\n");
        assert!(units.contains("line 3: the row has words") && units.contains("Fx (N)"), "{units}");
        assert!(wrong("10.5", "9.5").starts_with("line 4: time goes"));
        let bytes = [LOG.as_bytes(), &[0xFF]].concat();
        let error = read_ati(&bytes[..], &options()).unwrap_err().to_string();
        assert!(error.starts_with("line 6: this is no UTF-8"), "{error}");
        let heading = LOG.lines().take(2).collect::<Vec<_>>().join("\n");
        let error = read_ati(heading.as_bytes(), &options()).unwrap_err().to_string();
        assert!(error.starts_with("line 2: no row"), "{error}");
        let empty = read_ati("\n".as_bytes(), &options()).unwrap_err().to_string();
        assert!(empty.contains("the file is empty"), "{empty}");
        let comma = "Fx;Fy;Fz;Time\n1,5;2;3;0\n";
        let comma = read_ati(comma.as_bytes(), &options()).unwrap_err().to_string();
        assert!(comma.contains("numbers with a point"), "{comma}");
    }

    #[test]
    fn a_tare_that_is_longer_than_the_log_is_refused() {
        let long = AtiOptions { tare_s: 1.5, ..options() };
        let error = read_ati(LOG.as_bytes(), &long).unwrap_err().to_string();
        assert!(
            error.contains("ends 1 s after its beginning") && error.contains("--tare"),
            "{error}"
        );
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
}
