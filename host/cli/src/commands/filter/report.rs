//! What was done, as JSON and as a table.

use std::path::Path;

use cathforce_filter::{Done, Pipeline};
use cathforce_gap::report::quantity;
use serde::Serialize;

use crate::args::FilterArguments;

/// What was done to one source.
#[derive(Serialize)]
pub struct Report {
    source: String,
    out: String,
    dry_run: bool,
    causal: bool,
    outlier_rows: usize,
    outlier_sd: f64,
    average_s: f64,
    tables: Vec<Filtered>,
}

#[derive(Serialize)]
struct Filtered {
    table: String,
    columns: Vec<Column>,
}

#[derive(Serialize)]
struct Column {
    name: String,
    #[serde(flatten)]
    done: Done,
}

impl Report {
    pub fn new(arguments: &FilterArguments, out: &Path) -> Self {
        let Pipeline { outlier_rows, outlier_sd, average_s, causal, .. } = arguments.pipeline();
        Self {
            source: arguments.source.display().to_string(),
            out: out.display().to_string(),
            dry_run: arguments.dry_run,
            causal,
            outlier_rows,
            outlier_sd,
            average_s,
            tables: Vec::new(),
        }
    }

    /// Adds a table with its columns, in the order in which they were filtered.
    pub fn add(&mut self, table: String, columns: Vec<String>, done: Vec<Done>) {
        let column = |(name, done)| Column { name, done };
        let columns = columns.into_iter().zip(done).map(column).collect();
        self.tables.push(Filtered { table, columns });
    }

    pub fn text(&self) -> String {
        let mut text = String::new();
        for Filtered { table, columns } in &self.tables {
            text += &format!("{table}\n");
            let width =
                columns.iter().map(|own| own.name.chars().count()).max().unwrap_or(0).max(6);
            text += &format!(
                "  {:width$}  {:>7}  {:>8}  {:>8}  {:>12}  {:>12}  {:>15}\n",
                "column", "values", "rate", "outliers", "noise before", "noise after", "delay"
            );
            for Column { name, done } in columns {
                let [before, after] =
                    [done.noise_before, done.noise_after].map(|noise| in_unit(noise, name));
                text += &format!(
                    "  {name:width$}  {:>7}  {:>8}  {:>8}  {before:>12}  {after:>12}  {:>15}\n",
                    done.values,
                    format!("{:.4} Hz", Short(done.rate_hz)),
                    done.outliers_replaced,
                    delay(done)
                );
            }
        }
        text += "The noise that is left is no white noise any more: neighbouring rows share it.\n";
        text += &match self.dry_run {
            true => format!("dry run: {} was not written\n", self.out),
            false => format!("{}\n", self.out),
        };
        text
    }
}

/// In the unit that the name of a column ends with.
fn in_unit(value: f64, name: &str) -> String {
    match name.rsplit_once('_').map(|(_, unit)| unit) {
        Some(unit @ ("N" | "m")) => quantity(value, if unit == "N" { "N" } else { "m" }),
        _ => format!("{value:.3e}"),
    }
}

fn delay(done: &Done) -> String {
    match (1e3 * done.delay_s, 1e3 * done.delay_at_most_s) {
        (_, 0.0) => "none".into(),
        (least, most) if least == most => format!("{least:.1} ms"),
        (least, most) => format!("{least:.1} to {most:.1} ms"),
    }
}

/// A number without superfluous zeros.
struct Short(f64);

impl std::fmt::Display for Short {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let digits = f.precision().unwrap_or(4);
        let decimals = digits.saturating_sub(1 + self.0.abs().max(1.0).log10() as usize);
        let text = format!("{:.decimals$}", self.0);
        let text = if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.')
        } else {
            &text
        };
        f.write_str(text)
    }
}
