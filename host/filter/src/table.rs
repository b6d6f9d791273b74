//! CSV tables of numbers, of which some columns are replaced and everything else stays as it is.

use std::io;

use csv::{ReaderBuilder, StringRecord, Trim};
use thiserror::Error;

use crate::clock::{Clock, ClockError};
use crate::pipeline::{Done, Pipeline};

/// Digits that a filtered value has after the point beyond those that were measured.
const MORE_DIGITS: usize = 2;
/// Digits at most: what is left of a number in double precision near 1.
const MOST_DIGITS: usize = 15;

/// What is wrong with a table.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum TableCause {
    #[error("not CSV: {0}")]
    Syntax(String),
    #[error("the file has no header line with the names of its columns")]
    NoHeader,
    #[error("column `{0}` stands twice in the header")]
    Twice(String),
    #[error("there is no column `{0}`")]
    NoColumn(String),
    #[error("`{text}` in column `{column}` is not a number")]
    NotANumber { column: String, text: String },
    #[error("`{text}` in column `{column}` is not finite")]
    NotFinite { column: String, text: String },
    #[error("column `{0}` has no value in this row")]
    NoTime(String),
    #[error("column `{column}`: {clock}")]
    Clock { column: String, clock: ClockError },
}

/// A fault with its line, from 1.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("line {line}: {cause}")]
pub struct TableError {
    pub line: usize,
    pub cause: TableCause,
}

impl TableCause {
    /// What to do about it.
    pub fn fix(&self) -> String {
        match self {
            Self::Syntax(_) => {
                "write UTF-8 text, comma separated, as many fields in every row".into()
            }
            Self::NoHeader => "write the names of the columns into the first line".into(),
            Self::Twice(_) => "keep one of the two columns".into(),
            Self::NoColumn(_) => "name a column of the table".into(),
            Self::NotANumber { .. } => {
                "write a decimal number with a point, or leave the field empty".into()
            }
            Self::NotFinite { .. } => {
                "leave the field empty where nothing was measured, but keep its comma".into()
            }
            Self::NoTime(name) => format!("give `{name}` a number here, or take the row out"),
            Self::Clock { clock, .. } => clock.fix().into(),
        }
    }
}

/// A table with its header.
#[derive(Clone, Debug)]
pub struct Table {
    header: StringRecord,
    rows: Vec<Vec<String>>,
    /// Line of each row in the file.
    lines: Vec<usize>,
}

impl Table {
    /// Reads a table. Its fields need not be numbers.
    pub fn read(text: &str) -> Result<Self, TableError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut reader = ReaderBuilder::new().trim(Trim::All).from_reader(text.as_bytes());
        let syntax = |error: csv::Error| {
            let line = error.position().map_or(1, |at| at.line() as usize);
            TableError { line, cause: TableCause::Syntax(error.to_string()) }
        };
        let header = reader.headers().map_err(syntax)?.clone();
        if header.iter().all(str::is_empty) {
            return Err(TableError { line: 1, cause: TableCause::NoHeader });
        }
        let (mut rows, mut lines) = (Vec::new(), Vec::new());
        for record in reader.records() {
            let record = record.map_err(syntax)?;
            lines.push(record.position().map_or(1, |at| at.line() as usize));
            rows.push(record.iter().map(str::to_owned).collect());
        }
        Ok(Self { header, rows, lines })
    }

    /// Names of the columns.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.header.iter()
    }

    fn column(&self, name: &str) -> Result<usize, TableError> {
        let heading = |cause| TableError { line: 1, cause };
        let mut found = self.header.iter().enumerate().filter(|(_, own)| *own == name);
        let (at, _) = found.next().ok_or_else(|| heading(TableCause::NoColumn(name.into())))?;
        match found.next() {
            Some(_) => Err(heading(TableCause::Twice(name.into()))),
            None => Ok(at),
        }
    }

    fn number(&self, row: usize, column: usize) -> Result<Option<f64>, TableError> {
        let text = self.rows[row][column].as_str();
        if text.is_empty() {
            return Ok(None);
        }
        let name = || self.header[column].to_owned();
        let cause = match text.parse::<f64>() {
            Ok(number) if number.is_finite() => return Ok(Some(number)),
            Ok(_) => TableCause::NotFinite { column: name(), text: text.into() },
            Err(_) => TableCause::NotANumber { column: name(), text: text.into() },
        };
        Err(TableError { line: self.lines[row], cause })
    }

    /// Filters columns, each at the rows that have a value in it. `Err` holds everything that is wrong,
    /// and the table stays as it is.
    pub fn filter(
        &mut self,
        time: &str,
        columns: &[String],
        pipeline: &Pipeline,
    ) -> Result<Vec<Done>, Vec<TableError>> {
        let t_s = self.times(time).map_err(|error| vec![error])?;
        let (mut done, mut wrong) = (Vec::new(), Vec::new());
        for name in columns {
            match self.filtered(&t_s, name, pipeline) {
                Ok(found) => done.push(found),
                Err(error) => wrong.push(error),
            }
        }
        if !wrong.is_empty() {
            return Err(wrong);
        }
        for (column, texts, _) in &done {
            for (row, text) in texts {
                self.rows[*row][*column].clone_from(text);
            }
        }
        Ok(done.into_iter().map(|(.., done)| done).collect())
    }

    fn times(&self, time: &str) -> Result<Vec<f64>, TableError> {
        let column = self.column(time)?;
        let at = |row: usize| {
            let missing =
                || TableError { line: self.lines[row], cause: TableCause::NoTime(time.into()) };
            self.number(row, column)?.ok_or_else(missing)
        };
        (0..self.rows.len()).map(at).collect()
    }

    /// Why a column cannot be filtered that has a value in less than half of the rows, such as the tip of a
    /// camera that was logged by the clock of a load cell; `None` of any other.
    pub fn sparse_and_uneven(
        &self,
        time: &str,
        name: &str,
        pipeline: &Pipeline,
    ) -> Option<TableError> {
        let series = self.series(&self.times(time).ok()?, name).ok()?;
        let is_sparse = 2 * series.rows.len() < self.rows.len();
        let clock = Clock::of(&series.t_s, pipeline.split_at_gaps).err().filter(|_| is_sparse)?;
        Some(self.of_clock(&series, name, clock))
    }

    fn series(&self, t_s: &[f64], name: &str) -> Result<Series, TableError> {
        let column = self.column(name)?;
        let mut series = Series { column, ..Series::default() };
        for (row, t_s) in t_s.iter().enumerate() {
            if let Some(value) = self.number(row, column)? {
                series.rows.push(row);
                series.t_s.push(*t_s);
                series.values.push(value);
            }
        }
        Ok(series)
    }

    fn of_clock(&self, series: &Series, name: &str, clock: ClockError) -> TableError {
        TableError {
            line: clock.row().map_or(1, |row| self.lines[series.rows[row]]),
            cause: TableCause::Clock { column: name.into(), clock },
        }
    }

    /// The place of a column, its new fields by row, and what was done.
    #[allow(clippy::type_complexity, reason = "used in one place")]
    fn filtered(
        &self,
        t_s: &[f64],
        name: &str,
        pipeline: &Pipeline,
    ) -> Result<(usize, Vec<(usize, String)>, Done), TableError> {
        let series = self.series(t_s, name)?;
        let found = pipeline.apply(&series.t_s, &series.values);
        let found = found.map_err(|clock| self.of_clock(&series, name, clock))?;
        let Series { column, rows, .. } = series;
        let digits = rows.iter().map(|&row| digits(&self.rows[row][column])).max().unwrap_or(0);
        let text = |value: &f64| match digits {
            digits if digits <= MOST_DIGITS => format!("{value:.digits$}"),
            _ => value.to_string(),
        };
        let texts = rows.into_iter().zip(found.values.iter().map(text)).collect();
        Ok((column, texts, found.done))
    }

    /// Writes the table as CSV.
    pub fn write(&self, out: impl io::Write) -> io::Result<()> {
        let mut csv = csv::Writer::from_writer(out);
        let wrong = |error: csv::Error| io::Error::other(error.to_string());
        csv.write_record(&self.header).map_err(wrong)?;
        for row in &self.rows {
            csv.write_record(row).map_err(wrong)?;
        }
        csv.flush()
    }
}

/// The values of a column at the rows that have one.
#[derive(Default)]
struct Series {
    column: usize,
    rows: Vec<usize>,
    t_s: Vec<f64>,
    values: Vec<f64>,
}

/// Digits that a filtered value has after the point, from a measured one. What is written with an
/// exponent has too many.
fn digits(text: &str) -> usize {
    match text.split_once('.') {
        _ if text.contains(['e', 'E']) => usize::MAX,
        Some((_, after)) => after.len() + MORE_DIGITS,
        None => MORE_DIGITS + 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> String {
        let row = |i: usize| {
            let tip = if i.is_multiple_of(4) {
                format!("{:.4}", 0.001 * i as f64)
            } else {
                String::new()
            };
            let spike = if i == 20 { 9.0 } else { 0.0 };
            format!("{:.3},{:.3},{tip},note {i}\n", 0.004 * i as f64, 0.1 + spike)
        };
        "t_s,fx_N,tip_x_m,remark\n".to_owned() + &(0..40).map(row).collect::<String>()
    }

    fn filter(text: &str, names: &[&str]) -> Result<(Table, Vec<Done>), Vec<TableError>> {
        let mut table = Table::read(text).map_err(|e| vec![e])?;
        let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
        let done = table.filter("t_s", &names, &Pipeline::default())?;
        Ok((table, done))
    }

    #[test]
    fn named_columns_are_filtered_and_everything_else_stays_to_the_letter() {
        let (table, done) = filter(&example(), &["fx_N", "tip_x_m"]).unwrap();
        assert_eq!((done[0].values, done[0].outliers_replaced), (40, 1));
        assert!((done[1].values, done[1].average_rows) == (10, 1) && done[1].rate_hz < 63.0);
        let mut out = Vec::new();
        table.write(&mut out).unwrap();
        let out = String::from_utf8(out).unwrap();
        for (new, old) in out.lines().zip(example().lines()).skip(1) {
            let [new, old] = [new, old].map(|line| line.split(',').collect::<Vec<_>>());
            assert_eq!((new[0], new[3]), (old[0], old[3]));
            assert_eq!(new[1], "0.10000");
            assert_eq!(new[2].is_empty(), old[2].is_empty());
        }
    }

    #[test]
    fn a_sparse_column_of_another_clock_is_told_from_a_broken_one() {
        // Pictures come when they like.
        let uneven = example().replacen("0.032,0.100,0.0080", "0.032,0.100,", 1);
        let uneven = uneven.replacen("0.036,0.100,", "0.036,0.100,0.0090", 1);
        let table = Table::read(&uneven).unwrap();
        let of = |name: &str| table.sparse_and_uneven("t_s", name, &Pipeline::default());
        let found = of("tip_x_m").unwrap();
        assert_eq!(found.line, 11, "{found}");
        assert_eq!(of("fx_N"), None);
        assert_eq!(
            Table::read(&example()).unwrap().sparse_and_uneven(
                "t_s",
                "tip_x_m",
                &Pipeline::default()
            ),
            None
        );
    }

    #[test]
    fn what_is_wrong_has_its_line_and_nothing_is_half_done() {
        let cause = |text: &str, names: &[&str]| filter(text, names).unwrap_err().remove(0);
        let nan = example().replacen("0.028,0.100", "0.028,NaN", 1);
        let found = cause(&nan, &["fx_N"]);
        assert_eq!(found.line, 9, "{found}");
        assert!(
            matches!(found.cause, TableCause::NotFinite { .. })
                && found.cause.fix().contains("empty")
        );
        let word = example().replacen("0.028,0.100", "0.028,none", 1);
        assert!(matches!(cause(&word, &["fx_N"]).cause, TableCause::NotANumber { .. }));
        assert_eq!(cause(&example(), &["fy_N"]).cause, TableCause::NoColumn("fy_N".into()));
        let gap: String = example()
            .lines()
            .enumerate()
            .filter(|(i, _)| !(10..14).contains(i))
            .map(|(_, line)| format!("{line}\n"))
            .collect();
        let found = cause(&gap, &["fx_N"]);
        assert_eq!(found.line, 11, "{found}");
        assert!(found.to_string().contains("no value for 0.0200 s"), "{found}");
        assert!(cause("", &[]).cause == TableCause::NoHeader);
        assert!(matches!(cause("t_s,a\n1\n", &[]).cause, TableCause::Syntax(_)));
        // All columns are complained of at once.
        let both = filter(&nan, &["fx_N", "fy_N"]).unwrap_err();
        assert_eq!(both.len(), 2);
    }
}
