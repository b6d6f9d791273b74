//! `cathforce gap blind-test`: the diagnosis answers cases whose true effects are sealed.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::Instant;

use cathforce_blind_test::{BlindTest, BlindTestError, Label, Published, Score, Set, Stand, score};
use cathforce_gap::{Altered, achieved, diagnose};
use rand::Rng;
use serde::Serialize;
use serde_json::Value;

use super::diagnose::reproduce;
use super::hash::own_sha256;
use super::source::Source;
use crate::args::{
    BlindTestAction, BlindTestArguments, BlindTestFolder, BlindTestFolders, BlindTestMakeArguments,
    BlindTestRunArguments, Strangers,
};
use crate::failure::{Code, Failure};
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &BlindTestArguments) -> Result<(), Failure> {
    match &arguments.action {
        BlindTestAction::Make(arguments) => make(ui, arguments),
        BlindTestAction::Seal(arguments) => seal(ui, arguments),
        BlindTestAction::Run(arguments) => answer(ui, arguments),
        BlindTestAction::Reveal(arguments) => reveal(ui, arguments),
        BlindTestAction::Score(arguments) => show_score(ui, arguments),
    }
}

fn refuse(error: BlindTestError) -> Failure {
    Failure::input(error.to_string())
}

fn make(ui: &Ui, arguments: &BlindTestMakeArguments) -> Result<(), Failure> {
    if arguments.cases == 0 {
        let why = "--cases 0: a blind test without cases tests nothing\n  fix: give 10 or more";
        return Err(Failure::new(Code::Usage, why.to_owned()));
    }
    let progress = Mutex::new(ui.progress("playing", arguments.cases as u64, "cases"));
    let made = AtomicU64::new(0);
    let secret = rand::rng().random();
    let blind_test = BlindTest::at(&arguments.folder);
    let stands = match &arguments.bundle[..] {
        [] => Stand::all_own(),
        bundles => {
            let stands = bundles.iter().map(|bundle| Stand::of_bundle(bundle));
            stands.collect::<Result<_, _>>().map_err(|e| Failure::input(e.to_string()))?
        }
    };
    let (seed, count) = (arguments.seed, arguments.cases);
    let tell = || {
        let made = made.fetch_add(1, Ordering::Relaxed) + 1;
        if let Ok(mut progress) = progress.lock() {
            progress.set(made);
        }
    };
    let set = arguments.strangers.map(|set| match set {
        Strangers::Tuning => Set::Tuning,
        Strangers::Sealed => Set::Sealed,
    });
    let done = match set {
        Some(set) => blind_test.make_strangers(set, None, seed, count, secret, &tell),
        None => blind_test.make(seed, count, secret, &stands, &tell),
    };
    for (case, error) in done.map_err(refuse)? {
        ui.say(format_args!("case {case:03} is left out: {error}"));
    }
    Ok(())
}

fn seal(ui: &Ui, arguments: &BlindTestFolder) -> Result<(), Failure> {
    let seals = BlindTest::at(&arguments.folder).seal().map_err(refuse)?;
    let hash = BlindTest::at(&arguments.folder).seals_sha256().map_err(refuse)?;
    let text: String =
        seals.labels.iter().map(|(case, hash)| format!("{case}  {hash}\n")).collect();
    ui.data(&seals, format!("{text}seals.json, to be published  {hash}\n"))
}

/// One case a core: each is diagnosed by one thread, whose processor time is the case's.
fn answer(ui: &Ui, arguments: &BlindTestRunArguments) -> Result<(), Failure> {
    let blind_test = BlindTest::at(&arguments.folder);
    let seals = blind_test.seals().map_err(refuse)?;
    let binary = own_sha256()?;
    let mut open = Vec::new();
    if let Some(unknown) = arguments.cases.iter().find(|case| !seals.labels.contains_key(*case)) {
        let sealed: Vec<&str> = seals.labels.keys().map(String::as_str).collect();
        let message =
            format!("--case {unknown}: not a sealed case\n  fix: one of {}", sealed.join(", "));
        return Err(Failure::new(Code::Usage, message));
    }
    let wanted = |case: &String| arguments.cases.is_empty() || arguments.cases.contains(case);
    for case in seals.labels.keys().filter(|case| wanted(case)) {
        if blind_test.answer(case).map_err(refuse)?.is_none() {
            open.push(case.as_str());
        }
    }
    let answered = seals.labels.keys().filter(|case| wanted(case)).count() - open.len();
    open.truncate(arguments.most.unwrap_or(usize::MAX));
    if answered > 0 {
        ui.say(format_args!("{answered} cases are answered already"));
    }
    let begun = Instant::now();
    let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let work = || -> Result<(), Failure> {
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
        let alone =
            alone.map_err(|e| Failure::new(Code::Failed, format!("cannot start a thread: {e}")))?;
        while let Some(case) = open.get(next.fetch_add(1, Ordering::Relaxed)) {
            blind_test.check_case(&seals, case).map_err(refuse)?;
            let mut found = alone.install(|| answer_case(ui, &blind_test.bundle(case)))?;
            found.json["binary_sha256"] = Value::from(binary.clone());
            blind_test.keep_answer(case, &found.json).map_err(refuse)?;
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            let each_s = begun.elapsed().as_secs_f64() / done as f64;
            let left_min = each_s * (open.len() - done) as f64 / 60.0;
            ui.say(format_args!(
                "{done}/{}, {left_min:.0} min left: case {case}: {}",
                open.len(),
                found.sentence
            ));
        }
        Ok(())
    };
    let workers = std::thread::available_parallelism().map_or(1, usize::from).min(open.len());
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        let panicked = || Err(Failure::new(Code::Failed, "a diagnosis panicked".to_owned()));
        workers.into_iter().try_for_each(|own| own.join().unwrap_or_else(|_| panicked()))
    })
}

/// One answer.
struct Found {
    json: Value,
    sentence: String,
}

fn answer_case(ui: &Ui, path: &Path) -> Result<Found, Failure> {
    let cpu_before_s = thread_cpu_s();
    let source = Source::open(ui, path)?;
    let all = source.plant()?;
    // The last trial is what an answer must predict.
    let diagnosed = all.trials().len().saturating_sub(1);
    let mut own = diagnose(
        &Altered::first_trials(all.as_ref(), diagnosed),
        &source.bundle.rig.name,
        &cathforce_gap::unwatched,
    );
    let last = source.bundle.trials.last().map(|trial| trial.number);
    own.reproduce = reproduce(&source, last.as_slice(), &[])?;
    let cpu_s = thread_cpu_s() - cpu_before_s;
    let mut json = serde_json::to_value(&own)
        .map_err(|e| Failure::new(Code::Failed, format!("cannot write JSON: {e}")))?;
    json["cpu_seconds"] = Value::from(cpu_s);
    json["simulations"] = Value::from(own.details.simulations);
    json["predicted_shrink"] = Value::from(own.details.shrink);
    if !own.effects.is_empty() {
        json["achieved_shrink"] = Value::from(achieved(all.as_ref(), diagnosed, &own));
    }
    Ok(Found { json, sentence: format!("{} ({cpu_s:.0} s)", own.sentence()) })
}

/// Processor time of this thread \[s\].
#[cfg(unix)]
fn thread_cpu_s() -> f64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}

/// Time since the first call \[s\], where a thread's own time is not to be had.
#[cfg(not(unix))]
fn thread_cpu_s() -> f64 {
    static FIRST: std::sync::LazyLock<std::time::Instant> =
        std::sync::LazyLock::new(std::time::Instant::now);
    FIRST.elapsed().as_secs_f64()
}

#[derive(Serialize)]
struct Revealed {
    label: Label,
    answer: Value,
}

fn reveal(ui: &Ui, arguments: &BlindTestFolder) -> Result<(), Failure> {
    let revealed = BlindTest::at(&arguments.folder).reveal().map_err(refuse)?;
    let mut text = String::new();
    for answer in &score(Published::default(), String::new(), &revealed).answers {
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

fn show_score(ui: &Ui, arguments: &BlindTestFolders) -> Result<(), Failure> {
    let published = Published {
        date: arguments.date.clone(),
        sealed_in: arguments.sealed_in.clone(),
        program_commit: arguments.program_commit.clone(),
    };
    let mut scores = Vec::new();
    for folder in &arguments.folders {
        let blind_test = BlindTest::at(folder);
        let revealed = blind_test.reveal().map_err(refuse)?;
        let seals_sha256 = blind_test.seals_sha256().map_err(refuse)?;
        let score = score(published.clone(), seals_sha256, &revealed);
        blind_test.keep_score(&score).map_err(refuse)?;
        scores.push(score);
    }
    let text: Vec<String> = scores.iter().map(Score::markdown).collect();
    ui.data(&scores, text.join("\n"))
}
