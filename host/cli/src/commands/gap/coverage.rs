//! `cathforce gap coverage`: how many of the forces that were held out lie within the band that is
//! stated for them.

use std::path::Path;

use cathforce_gap::report::Verdict;
use cathforce_gap::{Coverage, Covered, covered};
use serde::Serialize;

use super::band_text::{CHANNELS, half_width, text};
use super::diagnose::Search;
use super::source::Source;
use crate::args::CoverageArguments;
use crate::failure::{Code, Failure};
use crate::ui::Ui;

/// One bundle, or all of them.
#[derive(Serialize)]
struct Row {
    rig: String,
    verdict: Option<Verdict>,
    channels: Vec<Shares>,
}

#[derive(Serialize)]
struct Shares {
    channel: &'static str,
    /// Of the samples with a band, those within it and the noise of the sensor.
    within: Option<f64>,
    #[serde(rename = "half_width_rms_N")]
    half_width_rms_n: Option<f64>,
    samples: usize,
    /// Samples for which no band is stated.
    unknown: usize,
}

pub fn run(ui: &Ui, arguments: &CoverageArguments) -> Result<(), Failure> {
    arguments.json_file.check()?;
    let (mut rows, mut all, mut failures) = (Vec::new(), Coverage::default(), Vec::new());
    for path in &arguments.bundles {
        match of_bundle(ui, path, &arguments.hold_back) {
            Ok(Some((row, coverage))) => {
                all.add(&coverage);
                rows.push(row);
                ui.say(format_args!("{}: {}", path.display(), text(&coverage)));
            }
            Ok(None) => {}
            // What the others took minutes for is not lost with one of them.
            Err(failure) if arguments.bundles.len() > 1 => {
                ui.warn(&failure.message);
                failures.push(failure.code);
            }
            Err(failure) => return Err(failure),
        }
    }
    rows.push(Row::of("all".to_owned(), None, &all));
    let lines: String = rows.iter().map(Row::text).collect();
    arguments.json_file.write(ui, &rows, format!("{}{lines}", Row::head()))?;
    match failures.last() {
        None => Ok(()),
        Some(&code) => {
            let (failed, all) = (failures.len(), arguments.bundles.len());
            let message = format!("{failed} of {all} bundles have no row; warnings say why");
            Err(Failure::new(code, message))
        }
    }
}

/// Diagnoses one; `None` where there is no band, which a warning says.
fn of_bundle(ui: &Ui, path: &Path, hold_back: &[u32]) -> Result<Option<(Row, Coverage)>, Failure> {
    let source = Source::open(ui, path)?;
    let name = source.bundle.rig.name.clone();
    let is_drive = source.bundle.catheter().is_none();
    let search = Search { hold_back, ..Search::default() };
    let answer = search.answer(ui, source, None)?;
    let Some(band) = &answer.band else {
        let why = match is_drive {
            true => "a drive on its own has none, it is of a catheter's forces".to_owned(),
            false => answer.remarks.join("; "),
        };
        ui.warn(format_args!("{}: no band: {why}", path.display()));
        return Ok(None);
    };
    let coverage = if hold_back.is_empty() {
        band.coverage
    } else {
        let plant = Source::open(ui, path)?.plant()?;
        let trials = plant.trials().iter().enumerate();
        let mut sum = Coverage::default();
        for (trial, _) in trials.filter(|(_, own)| hold_back.contains(&own.number)) {
            let own = covered(plant.as_ref(), trial, &answer).ok_or_else(|| {
                let message = format!("{}: a simulation broke down", path.display());
                Failure::new(Code::Failed, message)
            })?;
            sum.add(&own);
        }
        sum
    };
    Ok(Some((Row::of(name, Some(answer.verdict), &coverage), coverage)))
}

impl Row {
    fn of(rig: String, verdict: Option<Verdict>, coverage: &Coverage) -> Self {
        let own = |(channel, own): (&&'static str, &Covered)| Shares {
            channel,
            within: own.share(),
            half_width_rms_n: own.half_width_n(),
            samples: own.stated + own.unknown,
            unknown: own.unknown,
        };
        Self { rig, verdict, channels: CHANNELS.iter().zip(&coverage.channels).map(own).collect() }
    }

    /// As a table of Markdown.
    fn head() -> String {
        let names = CHANNELS.map(|name| format!(" {name} |")).concat();
        format!(
            "| bundle | verdict |{names} no band |\n| --- | --- |{} --- |\n",
            " --- |".repeat(4)
        )
    }

    fn text(&self) -> String {
        let verdict = self.verdict.map_or("–".to_owned(), |verdict| format!("{verdict:?}"));
        let cell = |own: &Shares| match own.within.zip(own.half_width_rms_n) {
            Some((share, width)) => format!(" {:.1} % (±{}) |", 100.0 * share, half_width(width)),
            None => " – |".to_owned(),
        };
        let cells: String = self.channels.iter().map(cell).collect();
        let (unknown, samples) = self
            .channels
            .iter()
            .fold((0, 0), |(unknown, samples), own| (unknown + own.unknown, samples + own.samples));
        let none = match samples {
            0 => "–".to_owned(),
            samples => format!("{:.1} %", 100.0 * unknown as f64 / samples as f64),
        };
        format!("| {} | {verdict} |{cells} {none} |\n", self.rig)
    }
}
