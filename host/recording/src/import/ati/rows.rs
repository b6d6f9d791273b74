//! The rows of a sensor's log, below the names of its columns.

use super::clock;
use super::fields::split;
use super::heading::Heading;
use super::status;
use crate::import::error::ImportError;

/// What gives the rows their time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Times {
    /// A column, and its unit \[s\].
    Column(usize, f64),
    /// A column of times of day with fractions.
    OfDay(usize),
    /// The number of the packet over the rate.
    Sequence(usize, f64),
    /// The number of the row over the rate.
    Rows(f64),
}

/// Packets that did not arrive, before a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Lost {
    pub(super) line: u64,
    pub(super) packets: u64,
}

/// Rows with the same error.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Faulty {
    /// As in "an error status", "overrange set".
    pub(super) what: String,
    pub(super) first_line: u64,
    pub(super) rows: usize,
}

/// The rows that were read so far.
pub(super) struct Rows<'a> {
    pub(super) names: Vec<&'a str>,
    pub(super) heading: Heading,
    pub(super) times: Times,
    /// Time since the first row \[s\], and the values of the forces and torques as written; torques that
    /// the log does not have are 0.
    pub(super) samples: Vec<(f64, [f64; 6])>,
    /// Rows with numbers, whatever their status.
    pub(super) count: u64,
    /// Whether all forces are whole numbers.
    pub(super) are_whole: bool,
    /// Largest value of a force, as written.
    pub(super) largest: f64,
    pub(super) lost: Vec<Lost>,
    pub(super) faulty: Vec<Faulty>,
    /// Rows whose packet was there already.
    pub(super) repeated: usize,
    /// Time of the first row, in the unit of its column.
    start: Option<f64>,
    last_s: Option<f64>,
    last_packet: Option<u32>,
    /// Packets since the first row.
    packets: u64,
    /// Time of day of the first row and of the last one \[s\].
    day_s: Option<(f64, f64)>,
}

impl<'a> Rows<'a> {
    pub(super) fn new(names: Vec<&'a str>, heading: Heading, times: Times) -> Self {
        Self {
            names,
            heading,
            times,
            samples: Vec::new(),
            count: 0,
            are_whole: true,
            largest: 0.0,
            lost: Vec::new(),
            faulty: Vec::new(),
            repeated: 0,
            start: None,
            last_s: None,
            last_packet: None,
            packets: 0,
            day_s: None,
        }
    }

    /// Reads the next row.
    pub(super) fn take(&mut self, line: u64, row: &str) -> Result<(), ImportError> {
        let fields = split(row);
        if fields.len() != self.names.len() {
            return Err(self.other_fields(line, row, fields.len()));
        }
        if self.count == 0 && fields.iter().all(|field| field.parse::<f64>().is_err()) {
            let problem = "the row has words and no number";
            let fix = "take it out, and write units into the names, `Fx (N)`";
            return Err(ImportError::new(line, problem, fix));
        }
        if !self.next_packet(line, &fields)? {
            self.repeated += 1;
            return Ok(());
        }
        let t_s = self.time(line, &fields)?;
        if let Some(before_s) = self.last_s.filter(|before| *before >= t_s) {
            let problem = format!("time goes from {before_s} s to {t_s} s");
            return Err(ImportError::new(line, problem, "sort the rows, drop repeated ones"));
        }
        (self.last_s, self.count) = (Some(t_s), self.count + 1);
        let force = self.heading.force;
        if let Some(what) = self.fault(line, &fields)? {
            self.leave_out(line, what);
            return Ok(());
        }
        let number = |index: usize| number(line, self.names[index], fields[index]);
        let mut values = [0.0; 6];
        for (value, at) in values
            .iter_mut()
            .zip(force.into_iter().chain(self.heading.torque.into_iter().flatten()))
        {
            *value = number(at)?;
        }
        let is_whole = |at: &usize| fields[*at].parse::<i64>().is_ok();
        self.are_whole &= force.iter().all(is_whole);
        self.largest = values[..3].iter().fold(self.largest, |most, x| most.max(x.abs()));
        self.samples.push((t_s, values));
        Ok(())
    }

    /// What makes a row no measurement, by its status and flags.
    fn fault(&self, line: u64, fields: &[&str]) -> Result<Option<String>, ImportError> {
        let wrong = |at: usize| {
            let problem = format!("`{}` is no status, in column `{}`", fields[at], self.names[at]);
            let fix = "take the line out; a status is 0 or like 0x80000001";
            ImportError::new(line, problem, fix)
        };
        for &at in &self.heading.flags {
            let field = fields[at].to_lowercase();
            match field.parse::<f64>().ok().map(|number| number != 0.0) {
                Some(true) => return Ok(Some(format!("{} set", self.names[at]))),
                None if field == "true" => return Ok(Some(format!("{} set", self.names[at]))),
                None if field != "false" => return Err(wrong(at)),
                Some(false) | None => {}
            }
        }
        let Some((at, is_hex)) = self.heading.status else { return Ok(None) };
        let word = status::parse(fields[at], is_hex).ok_or_else(|| wrong(at))?;
        // The bits are ATI's where the rest is, too.
        let is_atis = is_hex || self.heading.sequence.is_some() || fields[at].starts_with("0x");
        Ok(match is_atis {
            true => {
                status::is_error(word).then(|| format!("the error status {}", status::text(word)))
            }
            false => (word != 0).then(|| format!("the status {word}")),
        })
    }

    /// Notes the number of the packet. Returns whether the packet is new.
    fn next_packet(&mut self, line: u64, fields: &[&str]) -> Result<bool, ImportError> {
        let Some(at) = self.heading.sequence else { return Ok(true) };
        let text = fields[at];
        // It has 32 bits and may be printed with a sign; an export may add a point.
        let read =
            text.parse::<f64>().ok().filter(|x| x.fract() == 0.0 && x.abs() <= f64::from(u32::MAX));
        let packet = read.map(|x| (x as i64) as u32).ok_or_else(|| {
            let problem =
                format!("`{text}` is no number of a packet, in column `{}`", self.names[at]);
            ImportError::new(line, problem, "take the line out")
        })?;
        let step = self.last_packet.map_or(0, |last| packet.wrapping_sub(last));
        let is_first = self.last_packet.is_none();
        if step > u32::MAX / 2 {
            let before = self.last_packet.unwrap_or_default();
            let problem = format!("the number of the packet goes from {before} back to {packet}");
            let fix = "sort the rows by it, or, where another run begins, take the runs apart here";
            return Err(ImportError::new(line, problem, fix));
        }
        self.last_packet = Some(packet);
        self.packets += u64::from(step);
        if step > 1 {
            self.lost.push(Lost { line, packets: u64::from(step) - 1 });
        }
        Ok(is_first || step > 0)
    }

    fn time(&mut self, line: u64, fields: &[&str]) -> Result<f64, ImportError> {
        if let Some(day_s) = self.heading.time.and_then(|(at, _)| clock::of_day_s(fields[at])) {
            let (first, _) = self.day_s.unwrap_or((day_s, day_s));
            self.day_s = Some((first, day_s));
        }
        Ok(match self.times {
            Times::Column(at, unit_s) => {
                let t = number(line, self.names[at], fields[at])?;
                (t - *self.start.get_or_insert(t)) * unit_s
            }
            Times::OfDay(at) => match (clock::of_day_s(fields[at]), self.day_s) {
                (Some(day_s), Some((first_s, _))) => clock::elapsed_s(first_s, day_s),
                _ => {
                    let problem = format!("`{}` is no time of day", fields[at]);
                    return Err(ImportError::new(line, problem, "take the line out"));
                }
            },
            Times::Sequence(_, rate_hz) => self.packets as f64 / rate_hz,
            Times::Rows(rate_hz) => self.count as f64 / rate_hz,
        })
    }

    fn leave_out(&mut self, line: u64, what: String) {
        match self.faulty.iter_mut().find(|faulty| faulty.what == what) {
            Some(faulty) => faulty.rows += 1,
            None => self.faulty.push(Faulty { what, first_line: line, rows: 1 }),
        }
    }

    /// Seconds from the first row to the last by the rows' times, and by their times of day.
    pub(super) fn spans_s(&self) -> (f64, Option<f64>) {
        let of_day = self.day_s.map(|(first, last)| clock::elapsed_s(first, last));
        (self.last_s.unwrap_or_default(), of_day)
    }

    /// Seconds from the first row to the last at a rate, by the numbers of the packets or the rows.
    pub(super) fn span_at_s(&self, rate_hz: f64) -> f64 {
        match self.heading.sequence {
            Some(_) => self.packets as f64 / rate_hz,
            None => self.count.saturating_sub(1) as f64 / rate_hz,
        }
    }

    fn other_fields(&self, line: u64, row: &str, found: usize) -> ImportError {
        let problem = format!("{found} fields, but {} columns are named", self.names.len());
        let decimal_comma = row.contains(',') && row.contains([';', '\t']);
        let fix = match (decimal_comma, self.count) {
            // A decimal comma splits a number into two fields.
            (true, _) => "write numbers with a point, a comma separates",
            // No row fits: the heading is wrong, or each row has a comma in a field.
            (false, 0) => {
                "name every column in the heading, or put the field that has a comma in it in quotes"
            }
            (false, _) => "take this line out, or log anew",
        };
        ImportError::new(line, problem, fix)
    }
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
