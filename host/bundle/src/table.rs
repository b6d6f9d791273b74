//! CSV tables with a header, read strictly: every complaint has its line and field.

use std::ops::Range;

use csv::{ReaderBuilder, StringRecord, Trim};
use thiserror::Error;

use crate::nearest::nearest;
use crate::place::Place;

/// What is wrong with a table.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum TableCause {
    #[error("the file is empty; it has no header line")]
    NoHeader,
    #[error("not CSV: {0}")]
    Syntax(String),
    #[error("unknown column `{name}`{}", .nearest.as_ref().map(|n| format!("; did you mean `{n}`?")).unwrap_or_default())]
    UnknownColumn { name: String, nearest: Option<String> },
    #[error("the header has no commas but {0}")]
    Separator(&'static str),
    #[error("this line is a remark, {}", if *.heading { "not the names of the columns" } else { "not a row" })]
    Remark { heading: bool },
    #[error("the row has words and no number, like a row of units below the names of the columns")]
    Words,
    #[error("column `{0}` stands twice in the header")]
    RepeatedColumn(String),
    #[error("column `{0}` is missing")]
    MissingColumn(String),
    #[error("the row has {found} fields, the header {expected}")]
    FieldCount { expected: usize, found: usize },
    #[error("`{text}` in column `{column}` is not a number")]
    NotANumber { column: String, text: String },
    #[error("`{text}` in column `{column}` is not finite")]
    NotFinite { column: String, text: String },
    #[error("column `{0}` has no value in this row")]
    MissingValue(String),
}

impl TableCause {
    /// What to do about it.
    pub fn fix(&self) -> String {
        match self {
            TableCause::NoHeader => "write the header line with the column names first".into(),
            TableCause::Syntax(_) => "write UTF-8 text, comma separated".into(),
            TableCause::UnknownColumn { .. } => {
                "rename the column, or take it out; nothing reads it".into()
            }
            TableCause::Separator(_) => {
                "separate the columns by commas, and write decimal numbers with a point".into()
            }
            TableCause::Remark { .. } => {
                "take the lines that begin with `#` out, or the `#` before the names".into()
            }
            TableCause::Words => "take the row out; a column's unit is that of its name".into(),
            TableCause::RepeatedColumn(_) => "keep one of the two columns".into(),
            TableCause::MissingColumn(name) => format!("add the column `{name}`"),
            TableCause::FieldCount { .. } => {
                "the row is cut short or has a comma too many; leave a missing value empty, but \
                 keep its comma"
                    .into()
            }
            TableCause::NotANumber { .. } => {
                "write a decimal number with a point; leave a missing value empty".into()
            }
            TableCause::NotFinite { .. } => {
                "leave the field empty where nothing was measured, but keep its comma".into()
            }
            TableCause::MissingValue(name) => {
                format!("give `{name}` a number here, or take the row out")
            }
        }
    }
}

type Fault = (Place, TableCause);

/// Columns of numbers of a table that is no trial, read as strictly as one.
#[derive(Clone, Debug, PartialEq)]
pub struct Numbers {
    /// In the order in which they were asked for, a value a row.
    pub columns: Vec<Vec<f64>>,
    /// Line of each row in the file, from 1.
    pub lines: Vec<usize>,
}

impl Numbers {
    /// Reads columns by their names. Errors, with their place: a column is missing, there is another one
    /// (with the name that was probably meant), or a row lacks a finite number.
    pub fn read(text: &str, names: &[&str]) -> Result<Self, Fault> {
        let table = Table::parse(text)?;
        table.check_columns(names, names, |_| false)?;
        let columns = names.iter().map(|name| table.full_column(name)).collect::<Result<_, _>>()?;
        let lines = (0..table.len()).map(|row| table.line(row)).collect();
        Ok(Self { columns, lines })
    }
}

/// A table whose rows all have as many fields as the header.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    header: StringRecord,
    rows: Vec<StringRecord>,
    /// Index of each column in the file, from 0.
    places: Vec<usize>,
}

impl Table {
    /// Splits a text into header and rows; no two columns have one name.
    pub(crate) fn parse(text: &str) -> Result<Self, Fault> {
        let table = Self::split(text)?;
        for (at, name) in table.header.iter().enumerate() {
            if table.header.iter().take(at).any(|earlier| earlier == name) {
                let place = Place::LineColumn(1, at + 1);
                return Err((place, TableCause::RepeatedColumn(name.into())));
            }
        }
        Ok(table)
    }

    /// Splits a text into header and rows, whatever the columns are called.
    pub(crate) fn split(text: &str) -> Result<Self, Fault> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut reader =
            ReaderBuilder::new().flexible(true).trim(Trim::All).from_reader(text.as_bytes());
        let syntax = |error: csv::Error| {
            let line = error.position().map_or(1, |at| at.line() as usize);
            (Place::Line(line), TableCause::Syntax(error.to_string()))
        };
        let header = reader.headers().map_err(syntax)?.clone();
        if header.is_empty() || header.iter().all(str::is_empty) {
            return Err((Place::Line(1), TableCause::NoHeader));
        }
        if header.iter().next().is_some_and(|name| name.starts_with('#')) {
            return Err((Place::Line(1), TableCause::Remark { heading: true }));
        }
        for (separator, name) in [(';', "semicolons"), ('\t', "tabs")] {
            if header.len() == 1 && header.iter().any(|heading| heading.contains(separator)) {
                return Err((Place::Line(1), TableCause::Separator(name)));
            }
        }
        let rows = reader.records().collect::<Result<Vec<_>, _>>().map_err(syntax)?;
        let places = (0..header.len()).collect();
        let table = Self { header, rows, places };
        for (row, record) in table.rows.iter().enumerate() {
            if record.len() != table.header.len() {
                // A branch of a vessel may have such a name; a remark also has another number of fields.
                if record.iter().next().is_some_and(|field| field.starts_with('#')) {
                    let place = Place::Line(table.line(row));
                    return Err((place, TableCause::Remark { heading: false }));
                }
                let (expected, found) = (table.header.len(), record.len());
                let place = Place::LineColumn(table.line(row), expected.min(found) + 1);
                return Err((place, TableCause::FieldCount { expected, found }));
            }
        }
        Ok(table)
    }

    /// Refuses unknown columns, and the lack of a required one. `accepts` admits further names beside
    /// those of `known`.
    pub(crate) fn check_columns(
        &self,
        required: &[&str],
        known: &[&str],
        accepts: impl Fn(&str) -> bool,
    ) -> Result<(), Fault> {
        for (at, name) in self.header.iter().enumerate() {
            if !known.contains(&name) && !accepts(name) {
                let nearest = nearest(name, known).map(str::to_owned);
                let cause = TableCause::UnknownColumn { name: name.into(), nearest };
                return Err((Place::LineColumn(1, at + 1), cause));
            }
        }
        match required.iter().find(|name| self.column(name).is_none()) {
            Some(name) => Err((Place::Line(1), TableCause::MissingColumn((*name).into()))),
            None => Ok(()),
        }
    }

    /// Merges consecutive rows with the same number in `column` into one; values that several of
    /// them have are averaged. Returns how many rows were merged into others.
    pub(crate) fn join_rows(&mut self, column: usize) -> Result<usize, Fault> {
        let same: Vec<Option<f64>> =
            (0..self.len()).map(|row| self.number(row, column)).collect::<Result<_, _>>()?;
        let before = self.len();
        let mut joined: Vec<StringRecord> = Vec::with_capacity(before);
        let mut first = 0;
        while first < before {
            let others = same[first + 1..].iter().take_while(|&&x| x.is_some() && x == same[first]);
            let end = first + 1 + others.count();
            joined.push(if end > first + 1 {
                self.joined(first..end)?
            } else {
                self.rows[first].clone()
            });
            first = end;
        }
        self.rows = joined;
        Ok(before - self.len())
    }

    /// Merges some rows into one record.
    fn joined(&self, rows: Range<usize>) -> Result<StringRecord, Fault> {
        let mut record = StringRecord::new();
        for column in 0..self.header.len() {
            let given = rows.clone().filter(|row| !self.text(*row, column).is_empty());
            let texts: Vec<&str> = given.clone().map(|row| self.text(row, column)).collect();
            match texts[..] {
                [] => record.push_field(""),
                [first, ..] if texts.iter().all(|text| *text == first) => record.push_field(first),
                _ => {
                    let numbers: Vec<f64> = given
                        .filter_map(|row| self.number(row, column).transpose())
                        .collect::<Result<_, _>>()?;
                    let mean = numbers.iter().sum::<f64>() / numbers.len() as f64;
                    record.push_field(&mean.to_string());
                }
            }
        }
        record.set_position(self.rows[rows.start].position().cloned());
        Ok(record)
    }

    /// Removes the rows that lack a value in any of these columns. Returns how many were removed.
    pub(crate) fn drop_rows_without(&mut self, names: &[&str]) -> usize {
        let columns: Vec<usize> = names.iter().filter_map(|name| self.column(name)).collect();
        let before = self.len();
        let whole = |row: &StringRecord| {
            columns.iter().all(|&c| row.get(c).is_some_and(|text| !text.is_empty()))
        };
        self.rows.retain(whole);
        before - self.len()
    }

    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }

    /// Line of a row in the file, from 1.
    pub(crate) fn line(&self, row: usize) -> usize {
        let position = self.rows.get(row).and_then(StringRecord::position);
        position.map_or(row + 2, |at| at.line() as usize)
    }

    /// Where a field stands in the file.
    pub(crate) fn place(&self, row: usize, column: usize) -> Place {
        let column = self.places.get(column).copied().unwrap_or(column);
        Place::LineColumn(self.line(row), column + 1)
    }

    fn has_words_only(&self, row: usize) -> bool {
        let mut fields = self.rows[row].iter().filter(|field| !field.is_empty());
        fields.all(|field| field.parse::<f64>().is_err())
    }

    /// Selects and renames columns. `rewrite(row, k)` gives the text of the k-th of them; places in
    /// messages stay those of the file.
    pub(crate) fn select(
        &self,
        columns: &[(usize, &str)],
        rewrite: impl Fn(usize, usize) -> Result<String, Fault>,
    ) -> Result<Self, Fault> {
        let row = |row: usize| {
            let fields = (0..columns.len()).map(|k| rewrite(row, k));
            let fields = fields.collect::<Result<Vec<String>, Fault>>()?;
            let mut record = StringRecord::from(fields);
            record.set_position(self.rows[row].position().cloned());
            Ok(record)
        };
        Ok(Self {
            header: columns.iter().map(|(_, name)| *name).collect(),
            rows: (0..self.len()).map(row).collect::<Result<_, Fault>>()?,
            places: columns.iter().map(|(column, _)| *column).collect(),
        })
    }

    /// Column names, in order.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.header.iter()
    }

    /// Index of a column.
    pub(crate) fn column(&self, name: &str) -> Option<usize> {
        self.header.iter().position(|column| column == name)
    }

    /// A field as text.
    pub(crate) fn text(&self, row: usize, column: usize) -> &str {
        self.rows.get(row).and_then(|record| record.get(column)).unwrap_or_default()
    }

    /// A field as a number; `None` when it is empty.
    pub(crate) fn number(&self, row: usize, column: usize) -> Result<Option<f64>, Fault> {
        let text = self.text(row, column);
        if text.is_empty() {
            return Ok(None);
        }
        let place = self.place(row, column);
        let name = || self.header.get(column).unwrap_or_default().to_owned();
        let Ok(value) = text.parse::<f64>() else {
            if row == 0 && self.has_words_only(row) {
                return Err((Place::Line(self.line(row)), TableCause::Words));
            }
            return Err((place, TableCause::NotANumber { column: name(), text: text.into() }));
        };
        if !value.is_finite() {
            return Err((place, TableCause::NotFinite { column: name(), text: text.into() }));
        }
        Ok(Some(value))
    }

    /// A whole column that must have a number in every row.
    pub(crate) fn full_column(&self, name: &str) -> Result<Vec<f64>, Fault> {
        let missing = || TableCause::MissingColumn(name.into());
        let column = self.column(name).ok_or((Place::Line(1), missing()))?;
        let cell = |row| {
            self.number(row, column)?
                .ok_or_else(|| (self.place(row, column), TableCause::MissingValue(name.into())))
        };
        (0..self.len()).map(cell).collect()
    }

    /// A whole column with gaps; `None` when there is no such column.
    pub(crate) fn sparse_column(&self, name: &str) -> Result<Option<Vec<Option<f64>>>, Fault> {
        let Some(column) = self.column(name) else { return Ok(None) };
        (0..self.len()).map(|row| self.number(row, column)).collect::<Result<_, _>>().map(Some)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_by_name_and_a_near_miss_is_named() {
        let names = ["t_s", "height_m"];
        let read = Numbers::read("height_m,t_s\n0.1,0\n0.2,1\n", &names).unwrap();
        assert_eq!(read.columns, [vec![0.0, 1.0], vec![0.1, 0.2]]);
        assert_eq!(read.lines, [2, 3]);
        let (place, cause) = Numbers::read("t_s,height_mm\n0,1\n", &names).unwrap_err();
        assert_eq!(place, Place::LineColumn(1, 2));
        assert!(cause.to_string().contains("did you mean `height_m`?"), "{cause}");
        let (place, cause) = Numbers::read("t_s,height_m\n0,1\n1,\n", &names).unwrap_err();
        assert_eq!(
            (place, cause),
            (Place::LineColumn(3, 2), TableCause::MissingValue("height_m".into()))
        );
    }
}
