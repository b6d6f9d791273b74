//! `cathforce identify`: a steerable catheter's parameters from dynamic experiments.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Mutex;
use std::time::Instant;

use cathforce_identification::{
    DESCRIPTION, Description, Found, IdentificationError, Known, ParameterFound, TrialFound,
    example,
};
use cathforce_reproduce::number;
use serde_json::{Value, json};

use crate::args::{
    IdentifyAction, IdentifyArguments, IdentifyExampleArguments, IdentifyFitArguments,
};
use crate::failure::{Code, Failure};
use crate::output::{check_new_folder, shown, write_new_folder};
use crate::session::interrupt_flag;
use crate::ui::Ui;

/// Cost of a feature above which the model does not explain the records: features then differ by two
/// standard deviations in the mean, where one is expected.
const MUCH_COST: f64 = 4.0;

pub fn run(ui: &Ui, arguments: &IdentifyArguments) -> Result<(), Failure> {
    match &arguments.action {
        IdentifyAction::Fit(arguments) => fit(ui, arguments),
        IdentifyAction::Example(arguments) => write_example(ui, arguments),
    }
}

fn fit(ui: &Ui, arguments: &IdentifyFitArguments) -> Result<(), Failure> {
    arguments.json_file.check()?;
    let path = &arguments.description;
    let description = Description::read(path).map_err(failed)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let study = description.study(folder).map_err(failed)?;
    let [records, trials] = study.counts();
    ui.say(format_args!("fitting {records} records of {trials} trials"));
    let start = Instant::now();
    let progress = Mutex::new(ui.progress("searching", study.work(), "units of work"));
    let tell = |done| {
        if let Ok(mut progress) = progress.lock() {
            progress.set(done);
        }
    };
    let found = study.fit(interrupt_flag()?, &tell);
    drop(progress);
    let found = found.map_err(failed)?;
    let seconds = start.elapsed().as_secs_f64();
    warn(ui, &found);
    let json = to_json(path, &description, &found, seconds);
    arguments.json_file.write(ui, &json, text(&found, seconds))
}

fn failed(error: IdentificationError) -> Failure {
    match error {
        IdentificationError::Interrupted => {
            Failure::new(Code::Failed, "interrupted: nothing is written")
        }
        error => Failure::input(error),
    }
}

/// What the figures of a fit do not say.
fn warn(ui: &Ui, found: &Found) {
    for TrialFound { trial, parameters, cost_per_feature, .. } in &found.trials {
        if *cost_per_feature > MUCH_COST {
            ui.warn(format_args!(
                "trial {trial}: simulated and measured features differ by {:.1} standard deviations of the \
                 noise, so the intervals are too narrow\n  fix: check `noise_m`, [catheter] and the units of \
                 the records",
                cost_per_feature.sqrt()
            ));
        }
        for own in parameters.iter().filter(|own| own.at_bound) {
            ui.warn(format_args!(
                "trial {trial}: {} lies at a bound\n  fix: widen its bounds in [parameters], if it may lie \
                 beyond",
                own.name
            ));
        }
    }
}

fn text(found: &Found, seconds: f64) -> String {
    let mut text = String::new();
    for own in &found.trials {
        trial(&mut text, own);
    }
    if !found.spread.is_empty() {
        let _ = writeln!(text, "over {} trials", found.trials.len());
        for own in &found.spread {
            let _ = writeln!(
                text,
                "  {:<20} {:>10}{}, from {} to {}, standard deviation {}",
                own.name,
                number(own.nominal),
                unit(own.unit),
                number(own.lower),
                number(own.upper),
                number(own.sd)
            );
        }
        text.push('\n');
    }
    let _ = writeln!(text, "{seconds:.1} s");
    text
}

fn trial(text: &mut String, found: &TrialFound) {
    // Writing to a string does not fail.
    let _ = writeln!(text, "trial {}", found.trial);
    for own in &found.parameters {
        let _ = writeln!(text, "  {:<20} {}", own.name, value(own));
    }
    for pair in &found.inseparable {
        let _ = writeln!(
            text,
            "  {} and {} cannot be told apart (correlation {:.3}): {}",
            pair.first, pair.second, pair.correlation, pair.advice
        );
    }
    let [coarse, fine] = found.simulations;
    let _ = writeln!(
        text,
        "  cost {:.2} per feature of {}, {coarse} coarse and {fine} fine simulations\n",
        found.cost_per_feature, found.features
    );
}

/// A unit behind a number; a ratio has none.
fn unit(unit: &str) -> String {
    if unit == "1" { String::new() } else { format!(" {unit}") }
}

fn value(own: &ParameterFound) -> String {
    let value = number(own.value.unwrap_or(f64::NAN));
    match (own.known, own.interval_95) {
        (Known::Found, Some([low, high])) => {
            let (low, high) = (number(low), number(high));
            format!("{value:>10}{}, 95 % interval {low} to {high}", unit(own.unit))
        }
        (Known::NotTold, _) => format!(
            "cannot be told from these records: {}",
            own.advice.as_deref().unwrap_or_default()
        ),
        (Known::Given | Known::Found, _) => format!("{value:>10}{}, given", unit(own.unit)),
    }
}

fn to_json(path: &Path, description: &Description, found: &Found, seconds: f64) -> Value {
    json!({
        "description": shown(path),
        "kind": description.kind.name(),
        "trials": found.trials,
        "spread": found.spread,
        "seconds": seconds,
    })
}

fn write_example(ui: &Ui, arguments: &IdentifyExampleArguments) -> Result<(), Failure> {
    let IdentifyExampleArguments { kind, out: folder } = arguments;
    check_new_folder(folder)?;
    let kind = kind.kind();
    let files = example(kind)
        .map_err(|error| Failure::new(Code::Failed, format!("the example: {error}")))?;
    write_new_folder(folder, files.iter().map(|(name, text)| (name.as_str(), text.as_bytes())))?;
    let description = folder.join(DESCRIPTION);
    let json = json!({
        "folder": shown(folder), "kind": kind.name(), "records": files.len() - 1,
        "description": shown(&description),
    });
    let text = format!(
        "{} records in {}\nnext: cathforce identify fit {}\n",
        files.len() - 1,
        folder.display(),
        description.display()
    );
    ui.data(&json, text)
}
