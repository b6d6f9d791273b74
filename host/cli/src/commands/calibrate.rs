//! `cathforce calibrate`: settings that somebody names, fitted to measured trials.

mod data;
mod fit;
mod parameters;
mod report;
mod settings;

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use cathforce_calibration::{Options, Outcome, Progress, RunError, Stop};
use cathforce_gap::calibrating::Calibration;
use cathforce_gap::catheter::Catheter;

use crate::args::CalibrateArguments;
use crate::failure::{Code, Failure};
use crate::output::check_apart;
use crate::session::interrupt_flag;
use crate::ui::Ui;
use data::Data;
use report::Report;

/// Evaluations for each parameter and two more: sixteen samples and a few searches of some ten steps.
const BUDGET_EACH: usize = 60;

pub fn run(ui: &Ui, arguments: &CalibrateArguments) -> Result<(), Failure> {
    // Said now: a calibration takes minutes.
    let state = state_file(arguments);
    let outputs =
        [arguments.json_file.out.as_deref(), arguments.settings.as_deref(), Some(&*state)];
    check_apart(outputs.into_iter().flatten())?;
    arguments.json_file.check()?;
    check_state(&state, arguments.resume)?;
    let data = Data::open(ui, arguments)?;
    let wanted = parameters::wanted(&data, &arguments.parameters)?;
    let old = settings::known(arguments, &data)?;
    let mut calibration = data.calibration(&wanted, &arguments.hold_back)?;
    check_influence(&calibration)?;
    let outcome = search(ui, arguments, &data, &calibration, &state)?;
    let mut report = Report::new(&data, &wanted, &outcome, arguments.seed);
    if outcome.stop == Stop::Interrupted {
        report.best(&outcome.best);
        arguments.json_file.write(ui, &report, report.text())?;
        return Err(interrupted(&state));
    }
    ui.say("following the finer model from there, and computing intervals");
    let fitted = calibration.finish(&outcome.best).map_err(|e| refused(&e))?;
    let fitted = fitted.ok_or_else(|| {
        Failure::new(
            Code::Failed,
            "simulations beside the best values break down, so no interval can be said\n  fix: narrow \
             the bounds, NAME=LOW..HIGH",
        )
    })?;
    report.fitted(&fitted);
    report.changes = settings::changes(&data, &old, &report.values())?;
    if let Some(path) = &arguments.settings {
        settings::write(path, &old, &report.values())?;
        report.settings = Some(path.display().to_string());
    }
    let written = arguments.json_file.write(ui, &report, report.text());
    // A file that is gone already is as good.
    let _ = std::fs::remove_file(&state);
    written
}

/// Where an interrupted calibration is kept.
fn state_file(arguments: &CalibrateArguments) -> PathBuf {
    let first = arguments.sources.first().map_or(Path::new("."), PathBuf::as_path);
    let whole = first.canonicalize().unwrap_or_else(|_| first.to_path_buf());
    let mut name = whole.file_stem().unwrap_or_default().to_owned();
    name.push(".calibration-state.json");
    arguments.state.clone().unwrap_or_else(|| PathBuf::from(name))
}

fn check_state(state: &Path, resume: bool) -> Result<(), Failure> {
    let shown = state.display();
    let refused = |why: &str| Err(Failure::new(Code::Usage, format!("{shown} {why}")));
    match (state.exists(), resume) {
        (true, false) => refused(
            "is there: a calibration was interrupted\n  fix: go on with it by --resume, or delete the \
             file, or name another one with --state",
        ),
        (false, true) => refused(
            "is not there, so nothing can be resumed\n  fix: leave --resume out, or name the file with \
             --state",
        ),
        _ => Ok(()),
    }
}

fn check_influence(calibration: &Calibration<Catheter>) -> Result<(), Failure> {
    let without = calibration.without_influence();
    if without.is_empty() {
        return Ok(());
    }
    let lines = without.iter().map(|name| {
        let excited = parameters::excited_by(name);
        let record = excited.map(|own| format!(", or record {own}")).unwrap_or_default();
        format!(
            "{name} changes nothing of what was measured, anywhere within its bounds\n  fix: leave it \
             out{record}"
        )
    });
    Err(Failure::input(lines.collect::<Vec<_>>().join("\n")))
}

fn search(
    ui: &Ui,
    arguments: &CalibrateArguments,
    data: &Data,
    calibration: &Calibration<Catheter>,
    state: &Path,
) -> Result<Outcome, Failure> {
    let count = calibration.parameters().len();
    let budget = arguments.budget.map_or(BUDGET_EACH * (count + 2), |budget| budget as usize);
    let options = Options {
        method: arguments.method.method(),
        budget,
        seed: arguments.seed,
        objective: data.fingerprint(&arguments.hold_back)?,
        state: Some(state.to_path_buf()),
        resume: arguments.resume,
    };
    ui.say(format_args!(
        "fitting {count} parameters to {} trials on {} cores",
        calibration.fitted_trials(),
        std::thread::available_parallelism().map_or(1, usize::from)
    ));
    let progress = Mutex::new(ui.progress("searching", budget as u64, "evaluations"));
    let tell = |now: Progress| {
        if let Ok(mut progress) = progress.lock() {
            progress.set(now.evaluations as u64);
        }
    };
    let found = calibration.search(&options, interrupt_flag()?, &tell);
    drop(progress);
    let outcome = found.map_err(|error| refused(&error))?;
    ui.say(format_args!("{}: {}", outcome.choice.method.name(), outcome.choice.reason));
    Ok(outcome)
}

fn refused(error: &RunError) -> Failure {
    let fix = match error {
        RunError::Nowhere(_) => "\n  fix: narrow the bounds, NAME=LOW..HIGH",
        RunError::Parameter(_) => "\n  fix: give bounds that hold what rig.toml states",
        RunError::State(_) => "",
    };
    Failure::input(format!("{error}{fix}"))
}

fn interrupted(state: &Path) -> Failure {
    let message = format!(
        "interrupted: the values are the best so far, without intervals; no settings were written\n  fix: \
         the same command with --resume goes on from {}",
        state.display()
    );
    Failure::new(Code::Failed, message)
}
