//! Tells what each part of the engine is worth: answers a set of cases with known labels without it, and counts.
//!
//! `without FOLDER OUT [--every K] [PART …]`. FOLDER: as `cathforce gap blind-test make` makes it. OUT: keeps the
//! answers, so that a run that was interrupted goes on. `--every K`: each K-th case only. PART: as in
//! [`cathforce_gap::rules::SWITCHES`]; without one, all of them.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use cathforce_blind_test::{Counted, Label, Published, Score, score};
use cathforce_bundle::Bundle;
use cathforce_gap::catheter::Catheter;
use cathforce_gap::plant::Plant;
use cathforce_gap::rules::{Rules, SWITCHES};
use serde_json::Value;

/// The name of the whole engine among the parts that are left out.
const NOTHING: &str = "nothing";
/// What is told of each run, as a head of its column.
const TOLD: [(Counted, &str); 6] = [
    (Counted::NamedFirst, "first"),
    (Counted::PairFound, "pairs"),
    (Counted::OutsideUnknown, "outside"),
    (Counted::GapClaimedWithoutEffect, "claimed"),
    (Counted::AnyEffectConfidentlyWrong, "wrong"),
    (Counted::IntervalsHoldTruth, "intervals"),
];

type Failed = Box<dyn std::error::Error>;

fn main() -> ExitCode {
    match run(&std::env::args().skip(1).collect::<Vec<_>>()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &[String]) -> Result<(), Failed> {
    let (every, named) = match arguments {
        [_, _, option, k, parts @ ..] if option == "--every" => (k.parse()?, parts),
        [_, _, parts @ ..] => (1, parts),
        _ => return Err("without FOLDER OUT [--every K] [PART …]".into()),
    };
    let (folder, out) = (Path::new(&arguments[0]), Path::new(&arguments[1]));
    let known = SWITCHES.map(|(name, ..)| name);
    if let Some(unknown) = named.iter().find(|own| !known.contains(&own.as_str())) {
        return Err(format!("{unknown}: the parts are {}", known.join(", ")).into());
    }
    let parts = known.into_iter().filter(|own| named.is_empty() || named.iter().any(|n| n == own));
    let cases = cases(folder, every)?;
    let heads: Vec<&str> = TOLD.iter().map(|(_, head)| *head).collect();
    println!("| without | {} | simulations |", heads.join(" | "));
    println!("| --- |{} --- |", " --- |".repeat(TOLD.len()));
    for part in [NOTHING].into_iter().chain(parts) {
        let answered: Result<Vec<(Label, Value)>, Failed> = cases
            .iter()
            .map(|(bundle, label)| {
                let answer = answer(bundle, part, &out.join(part).join(&label.case))?;
                Ok((label.clone(), answer))
            })
            .collect();
        println!("{}", row(part, &answered?));
    }
    Ok(())
}

/// Bundles with their labels.
fn cases(folder: &Path, every: usize) -> Result<Vec<(PathBuf, Label)>, Failed> {
    let entries: Result<Vec<_>, _> = fs::read_dir(folder.join("labels"))?.collect();
    let mut labels: Vec<PathBuf> = entries?.into_iter().map(|own| own.path()).collect();
    labels.sort();
    let read = |path: PathBuf| -> Result<_, Failed> {
        let label: Label = serde_json::from_str(&fs::read_to_string(path)?)?;
        Ok((folder.join("cases").join(&label.case), label))
    };
    labels.into_iter().step_by(every.max(1)).map(read).collect()
}

/// The answer without a part, from where it was kept if it was.
fn answer(bundle: &Path, part: &str, kept: &Path) -> Result<Value, Failed> {
    let kept = kept.with_extension("json");
    if kept.exists() {
        return Ok(serde_json::from_str(&fs::read_to_string(kept)?)?);
    }
    let rules = Rules::without(part).unwrap_or(Rules::USED);
    let mut own = Bundle::open(bundle)?;
    // The last trial is what a blind test withholds.
    own.trials.pop();
    let plant: Box<dyn Plant + '_> = Box::new(Catheter::new(&own)?);
    let found = cathforce_gap::diagnose_by(&rules, plant.as_ref(), part, &cathforce_gap::unwatched);
    let mut value = serde_json::to_value(&found)?;
    value["simulations"] = found.details.simulations.into();
    fs::create_dir_all(kept.parent().unwrap_or(Path::new(".")))?;
    fs::write(kept, value.to_string())?;
    Ok(value)
}

fn row(part: &str, answered: &[(Label, Value)]) -> String {
    let all: Score = score(Published::default(), String::new(), answered);
    let cell = |counted: Counted| {
        let figure = all.figure(counted);
        figure.map_or("–".to_owned(), |own| match own.reached {
            Some(reached) => format!("{reached:.0} % of {}", own.of),
            None => "–".to_owned(),
        })
    };
    let cells: Vec<String> = TOLD.iter().map(|(counted, _)| cell(*counted)).collect();
    // Simulations are most of what a diagnosis costs, and the same on every machine.
    let simulations = answered.iter().filter_map(|(_, own)| own["simulations"].as_f64());
    let mean = simulations.sum::<f64>() / answered.len() as f64;
    format!("| {part} | {} | {mean:.0} |", cells.join(" | "))
}
