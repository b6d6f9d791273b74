//! `cathforce gap challenge`: blind checks of the diagnosis.

use std::fmt::Write as _;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use cathforce_challenge::{Challenge, ChallengeError, Label, score};
use cathforce_gap::diagnose;
use rand::Rng;
use serde::Serialize;
use serde_json::Value;
use sha2::{Digest, Sha256};

use super::source::Source;
use crate::args::{
    ChallengeAction, ChallengeArguments, ChallengeFolder, ChallengeMakeArguments,
    ChallengeRunArguments,
};
use crate::failure::{Code, Failure};
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &ChallengeArguments) -> Result<(), Failure> {
    match &arguments.action {
        ChallengeAction::Make(arguments) => make(ui, arguments),
        ChallengeAction::Seal(arguments) => seal(ui, arguments),
        ChallengeAction::Run(arguments) => answer(ui, arguments),
        ChallengeAction::Reveal(arguments) => reveal(ui, arguments),
        ChallengeAction::Score(arguments) => show_score(ui, arguments),
    }
}

fn refuse(error: ChallengeError) -> Failure {
    Failure::input(error.to_string())
}

fn make(ui: &Ui, arguments: &ChallengeMakeArguments) -> Result<(), Failure> {
    let progress = Mutex::new(ui.progress("playing", arguments.cases as u64, "cases"));
    let made = AtomicU64::new(0);
    let salt_seed = rand::rng().random();
    let challenge = Challenge::at(&arguments.folder);
    let done = challenge.make(arguments.seed, arguments.cases, salt_seed, &|| {
        let made = made.fetch_add(1, Ordering::Relaxed) + 1;
        if let Ok(mut progress) = progress.lock() {
            progress.set(made);
        }
    });
    done.map_err(refuse)
}

fn seal(ui: &Ui, arguments: &ChallengeFolder) -> Result<(), Failure> {
    let seals = Challenge::at(&arguments.folder).seal().map_err(refuse)?;
    let text: String =
        seals.labels.iter().map(|(case, hash)| format!("{case}  {hash}\n")).collect();
    ui.data(&seals, text)
}

fn answer(ui: &Ui, arguments: &ChallengeRunArguments) -> Result<(), Failure> {
    let challenge = Challenge::at(&arguments.folder);
    let seals = challenge.seals().map_err(refuse)?;
    let binary = own_hash()?;
    let mut left = arguments.most.unwrap_or(usize::MAX);
    for case in seals.labels.keys() {
        if left == 0 {
            break;
        }
        if challenge.answer(case).map_err(refuse)?.is_some() {
            continue;
        }
        left -= 1;
        let begun = Instant::now();
        let path = challenge.bundle(case);
        let source = Source::open(ui, &path)?;
        let plant = source.plant()?;
        let found = diagnose(plant.as_ref(), &source.bundle.rig.name, &|_| {});
        let seconds = begun.elapsed().as_secs_f64();
        ui.say(format_args!("case {case}: {} ({seconds:.0} s)", found.sentence()));
        let mut answer = serde_json::to_value(&found)
            .map_err(|e| Failure::new(Code::Failed, format!("cannot write JSON: {e}")))?;
        answer["binary_sha256"] = Value::from(binary.clone());
        answer["seconds"] = Value::from(seconds);
        answer["simulations"] = Value::from(found.details.simulations);
        challenge.keep_answer(case, &answer).map_err(refuse)?;
    }
    Ok(())
}

/// SHA-256 of the program that answers.
fn own_hash() -> Result<String, Failure> {
    let read = || std::fs::read(std::env::current_exe()?);
    let bytes = read()
        .map_err(|e| Failure::new(Code::Failed, format!("cannot read the program itself: {e}")))?;
    Ok(Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect())
}

#[derive(Serialize)]
struct Revealed {
    label: Label,
    answer: Value,
}

fn reveal(ui: &Ui, arguments: &ChallengeFolder) -> Result<(), Failure> {
    let revealed = Challenge::at(&arguments.folder).reveal().map_err(refuse)?;
    let mut text = String::new();
    for answer in &score(&revealed).answers {
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "{}  {:<18} gap {:6.1}  {:<48} {:<8} {}{}",
            answer.case,
            answer.rig,
            answer.gap_over_noise,
            if answer.truth.is_empty() { "none".to_owned() } else { answer.truth.join(" + ") },
            answer.verdict,
            answer.named.join(" + "),
            answer.confidence.map_or(String::new(), |c| format!(" ({c:.2})")),
        );
    }
    let revealed: Vec<Revealed> =
        revealed.into_iter().map(|(label, answer)| Revealed { label, answer }).collect();
    ui.data(&revealed, text)
}

fn show_score(ui: &Ui, arguments: &ChallengeFolder) -> Result<(), Failure> {
    let challenge = Challenge::at(&arguments.folder);
    let score = score(&challenge.reveal().map_err(refuse)?);
    challenge.keep_score(&score).map_err(refuse)?;
    let text = format!(
        "{} cases, {} of them with a gap below {} times the noise, which count for nothing.\n\n{}",
        score.cases,
        score.too_small,
        cathforce_challenge::SMALLEST_GAP,
        score.table()
    );
    ui.data(&score, text)
}
