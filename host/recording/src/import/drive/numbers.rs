//! A table of text with any separator, as programs of labs write it.

use super::super::error::ImportError;

/// A table with a heading.
pub struct Table {
    pub names: Vec<String>,
    /// Fields of each row, with its line.
    pub rows: Vec<(u64, Vec<String>)>,
    has_decimal_commas: bool,
}

impl Table {
    /// Separated by commas, semicolons or tabs. With semicolons or tabs, a number may have a decimal comma. Lines that
    /// begin with `#` before the heading are left out.
    pub fn read(text: &str) -> Result<Self, ImportError> {
        let text = text.trim_start_matches('\u{feff}');
        let mut lines = text.lines().enumerate().map(|(i, line)| (i as u64 + 1, line));
        let heading = lines.find(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
        let Some((_, heading)) = heading else {
            return Err(ImportError::new(1, "the file is empty", "give a log with a heading"));
        };
        let count = |separator: char| heading.matches(separator).count();
        let separator = [',', ';', '\t'].into_iter().max_by_key(|own| (count(*own), *own == ','));
        let separator = separator.unwrap_or(',');
        let split = |line: &str| -> Vec<String> {
            let mut reader = csv::ReaderBuilder::new()
                .has_headers(false)
                .delimiter(separator as u8)
                .trim(csv::Trim::All)
                .from_reader(line.as_bytes());
            let record = reader.records().next().and_then(Result::ok);
            record.map_or(Vec::new(), |own| own.iter().map(str::to_owned).collect())
        };
        let names = split(heading);
        let mut rows = Vec::new();
        for (line, text) in lines {
            if text.trim().is_empty() {
                continue;
            }
            let fields = split(text);
            if fields.len() != names.len() {
                let fix = "mend the line, or take it out where the log was cut: a field may hold the separator without quotes around it";
                let problem =
                    format!("the row has {} fields, the heading {}", fields.len(), names.len());
                return Err(ImportError::new(line, problem, fix));
            }
            rows.push((line, fields));
        }
        Ok(Self { names, rows, has_decimal_commas: separator != ',' })
    }

    /// A number; `None` where there is none.
    pub fn number(&self, row: usize, column: usize) -> Result<Option<f64>, ImportError> {
        let (line, fields) = &self.rows[row];
        let text = fields[column].as_str();
        if text.is_empty() || ["nan", "null", "none", "n/a"].contains(&text.to_lowercase().as_str())
        {
            return Ok(None);
        }
        let text = match self.has_decimal_commas {
            true => text.replace(',', "."),
            false => text.to_owned(),
        };
        match text.parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(Some(x)),
            Ok(_) => Ok(None),
            Err(_) => Err(ImportError {
                line: *line,
                column: Some(column + 1),
                problem: format!("`{text}` in column `{}` is not a number", self.names[column]),
                fix: "a heading is one line, and units stand in it; leave a field empty where nothing was measured"
                    .into(),
            }),
        }
    }
}
