//! The result, as JSON and as tables.

use cathforce_calibration::{Outcome, Stop};
use cathforce_gap::calibrating::{Errors, Fitted};
use cathforce_gap::plant::Quantity;
use cathforce_gap::report::{Estimate, quantity};
use serde::Serialize;

use super::data::Data;
use super::fit::Fit;
use super::parameters::owner;
use super::settings::Change;

#[derive(Serialize)]
pub struct Report {
    sources: Vec<String>,
    method: &'static str,
    reason: String,
    seed: u64,
    stop: Stop,
    evaluations: usize,
    /// Of these, what an interrupted run had done.
    resumed: usize,
    parameters: Vec<Parameter>,
    errors: Vec<Error>,
    /// What was held out: `each trial in turn`, `the trials held back`, or null.
    held_out: Option<&'static str>,
    /// Of the derivatives over the priors' scales, the largest first.
    singular_values: Vec<f64>,
    not_identifiable: Vec<Pair>,
    pub changes: Vec<Change>,
    pub settings: Option<String>,
    notes: Vec<String>,
}

#[derive(Serialize)]
struct Parameter {
    name: &'static str,
    unit: &'static str,
    bounds: [f64; 2],
    start: f64,
    fitted: f64,
    /// 90 % interval; null of a calibration that was interrupted.
    interval: Option<[f64; 2]>,
    at_bound: bool,
    /// Whether the data tell it better than its prior does.
    told_by_data: bool,
}

#[derive(Serialize)]
struct Error {
    quantity: &'static str,
    unit: &'static str,
    before: f64,
    after: f64,
    held_out: Option<f64>,
    floor: f64,
}

/// Parameters of which the data tell a combination only.
#[derive(Serialize)]
struct Pair {
    parameters: [&'static str; 2],
    correlation: f64,
    /// Motions that tell them apart.
    record: Vec<&'static str>,
}

impl Report {
    pub fn new(data: &Data, wanted: &[Fit], outcome: &Outcome, seed: u64) -> Self {
        let parameter = |own: &Fit| Parameter {
            name: own.wanted.key,
            unit: own.info.unit,
            bounds: [own.wanted.low, own.wanted.high],
            start: own.start,
            fitted: own.start,
            interval: None,
            at_bound: false,
            told_by_data: false,
        };
        Self {
            sources: data.paths.iter().map(|path| path.display().to_string()).collect(),
            method: outcome.choice.method.name(),
            reason: outcome.choice.reason.clone(),
            seed,
            stop: outcome.stop,
            evaluations: outcome.evaluations,
            resumed: outcome.resumed,
            parameters: wanted.iter().map(parameter).collect(),
            errors: Vec::new(),
            held_out: None,
            singular_values: Vec::new(),
            not_identifiable: Vec::new(),
            changes: Vec::new(),
            settings: None,
            notes: Vec::new(),
        }
    }

    /// Values without intervals.
    pub fn best(&mut self, best: &[f64]) {
        for (own, value) in self.parameters.iter_mut().zip(best) {
            own.fitted = *value;
        }
    }

    pub fn fitted(&mut self, fitted: &Fitted) {
        for (own, value) in self.parameters.iter_mut().zip(&fitted.values) {
            own.fitted = value.fitted;
            own.interval = Some([value.low, value.high]);
            own.at_bound = value.at_bound;
            own.told_by_data = value.is_told;
        }
        self.evaluations += fitted.evaluations;
        self.errors = fitted.errors.iter().map(error).collect();
        self.held_out = match fitted.errors.iter().any(|own| own.held_out.is_some()) {
            true if fitted.in_turn => Some("each trial in turn"),
            true => Some("the trials held back"),
            false => None,
        };
        self.singular_values.clone_from(&fitted.singular_values);
        let pair = |own: &cathforce_calibration::Pair| {
            let names = [own.first, own.second].map(|k| self.parameters[k].name);
            let mut record: Vec<_> =
                names.iter().filter_map(|name| Some(owner(name)?.excited_by)).collect();
            record.dedup();
            Pair { parameters: names, correlation: own.correlation, record }
        };
        self.not_identifiable = fitted.pairs.iter().map(pair).collect();
        self.remark();
    }

    fn remark(&mut self) {
        if self.stop == Stop::Budget {
            self.notes.push(
                "the budget was spent before the search had come to its end: --budget gives more"
                    .to_owned(),
            );
        }
        if self.held_out.is_none() {
            self.notes.push(
                "nothing was held out, because there is one trial only: record another one"
                    .to_owned(),
            );
        }
        for own in &self.parameters {
            if !own.told_by_data {
                let record =
                    owner(own.name).map(|effect| format!("; record {}", effect.excited_by));
                self.notes.push(format!(
                    "{} is hardly told by the data: what is said of it is mostly its prior{}",
                    own.name,
                    record.unwrap_or_default()
                ));
            }
            if own.at_bound {
                self.notes.push(format!(
                    "{} ended at a bound: give it others, {}=LOW..HIGH, or look for another cause with \
                     `cathforce gap diagnose`",
                    own.name, own.name
                ));
            }
        }
    }

    /// Settings with their values, as a device has them.
    pub fn values(&self) -> Vec<(&'static str, f32)> {
        self.parameters.iter().map(|own| (own.name, own.fitted as f32)).collect()
    }

    pub fn text(&self) -> String {
        let mut text = self.table();
        if !self.errors.is_empty() {
            text += &self.error_table();
        }
        for Pair { parameters: [a, b], correlation, record } in &self.not_identifiable {
            text += &format!(
                "not told apart: {a} and {b} (their errors correlate by {correlation:.3})\n  record: {}\n",
                record.join("; ")
            );
        }
        for change in &self.changes {
            text += &format!("  {}\n", change.text());
        }
        for note in &self.notes {
            text += &format!("note: {note}\n");
        }
        text += &format!(
            "{}, {} evaluations{}\n",
            self.method,
            self.evaluations,
            match self.resumed {
                0 => String::new(),
                resumed => format!(", {resumed} of them before it was interrupted"),
            }
        );
        if let Some(settings) = &self.settings {
            text += &format!("settings: {settings}\n");
        }
        text
    }

    fn table(&self) -> String {
        let mut rows =
            vec![["parameter", "start", "fitted", "90 %", "bounds", ""].map(str::to_owned)];
        for own in &self.parameters {
            let [low, high] = own.interval.unwrap_or([own.fitted; 2]);
            let estimate =
                Estimate { value: own.fitted, low, high, unit: own.unit, off: own.fitted };
            let ([fitted, low, high], unit) = (estimate.digits(), estimate.unit_after());
            let interval = match own.interval {
                Some(_) => format!("{low} to {high}"),
                None => "none".to_owned(),
            };
            let [from, to] = own.bounds.map(short);
            rows.push([
                own.name.to_owned(),
                short(own.start),
                format!("{fitted}{unit}"),
                interval,
                format!("{from} to {to}"),
                if own.at_bound { "at its bound".to_owned() } else { String::new() },
            ]);
        }
        aligned(&rows)
    }

    fn error_table(&self) -> String {
        let held_out = match self.held_out {
            Some(what) => format!("held out ({what})"),
            None => "held out".to_owned(),
        };
        let heading = ["RMS error", "before", "after", &held_out, "floor"].map(str::to_owned);
        let mut rows = vec![heading];
        for own in &self.errors {
            let shown = |value: f64| quantity(value, own.unit);
            rows.push([
                own.quantity.to_owned(),
                shown(own.before),
                shown(own.after),
                own.held_out.map_or("none".to_owned(), shown),
                shown(own.floor),
            ]);
        }
        aligned(&rows)
    }
}

fn error(own: &Errors) -> Error {
    let name = match own.quantity {
        Quantity::Force => "force",
        Quantity::DriveForce => "drive force",
        Quantity::Tip => "tip",
        Quantity::Shape => "shape",
    };
    Error {
        quantity: name,
        unit: own.quantity.unit(),
        before: own.before,
        after: own.after,
        held_out: own.held_out,
        floor: own.floor,
    }
}

/// Four digits say enough of a start or a bound.
fn short(value: f64) -> String {
    cathforce_gap::rounding::shortest(value, 4)
}

/// Columns as wide as their widest cell.
fn aligned<const N: usize>(rows: &[[String; N]]) -> String {
    let width = |k: usize| rows.iter().map(|row| row[k].chars().count()).max().unwrap_or(0);
    let widths: [usize; N] = std::array::from_fn(width);
    let line = |row: &[String; N]| {
        let cells = row.iter().zip(widths);
        let cells =
            cells.map(|(cell, width)| cell.to_owned() + &" ".repeat(width - cell.chars().count()));
        cells.collect::<Vec<_>>().join("  ").trim_end().to_owned() + "\n"
    };
    rows.iter().map(line).collect()
}
