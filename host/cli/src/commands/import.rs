//! `cathforce import`.

use std::fs::File;
use std::io::{self, BufReader};
use std::path::Path;

use cathforce_bus::Id;
use cathforce_control::TICK_S;
use cathforce_record::import::{AtiOptions, ImportError, join, read_ati, read_csv};
use cathforce_record::{
    Attachments, Gap, Measured, NoLockStep, Recorder, Recording, SecondRun, Trial, WriteError,
    put_whole, read_candump, write_trial, write_whole,
};
use serde_json::json;

use super::run::{info, read_text, vessel_files};
use super::{image, open_bundle, open_recording};
use crate::args::{ImportAtiArguments, ImportCandumpArguments, ImportCsvArguments, ImportSource};
use crate::failure::Failure;
use crate::output::check_new;
use crate::session::DBC;
use crate::settings::master_of;
use crate::ui::Ui;

pub fn run(ui: &Ui, from: &ImportSource) -> Result<(), Failure> {
    match from {
        ImportSource::Candump(arguments) => candump(ui, arguments),
        ImportSource::Ati(arguments) => ati(ui, arguments),
        ImportSource::Csv(arguments) => csv(ui, arguments),
    }
}

fn candump(ui: &Ui, arguments: &ImportCandumpArguments) -> Result<(), Failure> {
    let (path, out) = (&arguments.log, &arguments.out);
    check_new(out)?;
    let master = master_of(arguments.changes.file.as_deref())?;
    let mut log = read_candump(BufReader::new(open(path)?), &master).map_err(|e| at(path, &e))?;
    if log.frames.is_empty() {
        let message = format!(
            "{}: {} frames, none of them with an identifier of cathforce.dbc\n  fix: log the bus \
             of the device, `candump -l can0`",
            path.display(),
            log.foreign
        );
        return Err(Failure::input(message));
    }
    if let Some(second) = &log.second_run {
        return Err(two_runs(path, second));
    }
    let bundle = open_bundle(ui, &arguments.bundle)?;
    let (image, _) = image(ui, &bundle, &arguments.changes)?;
    let sync = |id| Id::from_raw(id) == Some(Id::Sync);
    let has_sync = log.frames.iter().any(|frame| sync(frame.frame.id()));
    let lock_step = match has_sync.then(|| log.in_lock_step()) {
        None => false,
        Some(Ok(frames)) => {
            log.frames = frames;
            true
        }
        Some(Err(why)) => {
            ui.warn(no_lock_step(path, why));
            false
        }
    };
    let mut info = info("candump", &bundle, "");
    info.started_unix_ns = log.started_ns;
    info.tick_s = f64::from(TICK_S);
    info.lock_step = lock_step;
    let rig_toml = read_text(&bundle.path.join("rig.toml"))?;
    let files = vessel_files(&bundle)?;
    let vessel = files.iter().map(|(name, bytes)| (*name, &bytes[..])).collect::<Vec<_>>();
    let attachments = Attachments { image: &image, rig_toml: &rig_toml, dbc: DBC, vessel: &vessel };
    let record = |unfinished: &Path| -> Result<(), WriteError> {
        let mut recorder = Recorder::create(unfinished, &info, attachments)?;
        for frame in &log.frames {
            recorder.frame(frame, frame.at_ns)?;
        }
        recorder.finish(None)
    };
    let put = put_whole(out, |unfinished| Ok::<_, io::Error>(record(unfinished)?));
    put.map_err(|e| Failure::write(out, e))?;
    let (frames, foreign) = (log.frames.len(), log.foreign);
    ui.data(
        &json!({ "path": out, "frames": frames, "foreign": foreign, "lock_step": lock_step }),
        format_args!("{frames} frames, {foreign} of others left out: {}\n", out.display()),
    )
}

/// A recording has one image, and ticks that are counted from one beginning.
fn two_runs(log: &Path, second: &SecondRun) -> Failure {
    let &SecondRun { line, last_before, ticks: (before, after) } = second;
    let log = log.display();
    Failure::input(format!(
        "{log}:{line}: the device begins over: after tick {before} comes tick {after}, of another \
         run\n  fix: take the runs apart: `head -n {last_before} {log} > first.log`, \
         `tail -n +{} {log} > second.log`",
        last_before + 1
    ))
}

/// A replay needs every frame from the first tick on.
fn no_lock_step(log: &Path, why: NoLockStep) -> String {
    let log = log.display();
    let (what, fix) = match why {
        NoLockStep::Begins(first) => {
            let begins = match first {
                Some(tick) => format!("the first tick that it names is {tick}"),
                None => "it names no tick of a configured device".into(),
            };
            let what = format!(
                "{log}: of a device in lock step, but not from its configuration on, {begins}"
            );
            (what, "start `candump -l` before `cathforce run`".to_owned())
        }
        NoLockStep::Lacks(Gap { line, line_before, ticks: (before, after), seen }) => {
            let what = format!(
                "{log}:{line}: of a device in lock step, but after tick {before} comes tick {after} \
                 with frames of {seen} ticks: others were lost, or the log of another run was joined \
                 here without its beginning, which frames in lock step do not tell apart"
            );
            let fix = format!(
                "if two logs were joined, take them apart: `head -n {line_before} {log} > first.log`; \
                 if frames were lost, log with a larger buffer, `candump -r 1000000 -l can0`"
            );
            (what, fix)
        }
    };
    format!("{what}: taken as running free, it cannot be replayed\n  fix: {fix}")
}

fn ati(ui: &Ui, arguments: &ImportAtiArguments) -> Result<(), Failure> {
    let (path, out) = (&arguments.log, &arguments.out);
    check_new(out)?;
    let options = AtiOptions {
        counts_per_n: arguments.counts_per_n,
        axes: arguments.axes,
        tare_s: arguments.tare.unwrap_or(0.0),
        rate_hz: arguments.rate,
    };
    if !options.axes.is_rotation() {
        ui.warn("--axes mirrors: that is right only for a sensor that reports the reaction");
    }
    let forces = read_ati(open(path)?, &options).map_err(|e| at(path, &e))?;
    let motion = motion(ui, &arguments.motion)?;
    let (rows, left_out) = join(&motion, &forces, arguments.offset);
    if rows.is_empty() {
        let message = format!(
            "{}: none of its {} rows is within the time of {}\n  fix: say with --offset at which \
             time of the motion the log begins",
            path.display(),
            forces.len(),
            arguments.motion.display()
        );
        return Err(Failure::input(message));
    }
    write_rows(ui, out, rows, left_out)
}

fn csv(ui: &Ui, arguments: &ImportCsvArguments) -> Result<(), Failure> {
    check_new(&arguments.out)?;
    let rows = table(&arguments.table, |file| read_csv(file, &arguments.columns))?;
    write_rows(ui, &arguments.out, rows, 0)
}

/// Where the drive was.
fn motion(ui: &Ui, path: &Path) -> Result<Vec<Measured>, Failure> {
    if path.extension().is_some_and(|ending| ending == "mcap") {
        let recording: Recording = open_recording(ui, path)?;
        if recording.trial.rows.is_empty() {
            let message = format!(
                "{}: no trial was played in it\n  fix: give a recording of `cathforce run`",
                path.display()
            );
            return Err(Failure::input(message));
        }
        return Ok(recording.trial.rows);
    }
    table(path, |file| read_csv(file, &[]))
}

fn table<T>(
    path: &Path,
    read: impl FnOnce(BufReader<File>) -> Result<T, ImportError>,
) -> Result<T, Failure> {
    read(BufReader::new(open(path)?)).map_err(|e| at(path, &e))
}

fn write_rows(ui: &Ui, out: &Path, rows: Vec<Measured>, left_out: usize) -> Result<(), Failure> {
    let count = rows.len();
    let trial = Trial { rows, ..Trial::default() };
    write_whole(out, |file| write_trial(&trial, file)).map_err(|e| Failure::write(out, e))?;
    let outside = match left_out {
        0 => String::new(),
        n => format!(", {n} outside the motion left out"),
    };
    ui.data(
        &json!({ "path": out, "rows": count, "left_out": left_out }),
        format_args!("{count} rows{outside}: {}\n", out.display()),
    )
}

fn open(path: &Path) -> Result<File, Failure> {
    // A folder can be opened, and would be a wrong first line.
    let opened = match path.is_dir() {
        true => Err(io::ErrorKind::IsADirectory.into()),
        false => File::open(path),
    };
    opened.map_err(|e| Failure::input(format!("cannot read {}: {e}; give a file", path.display())))
}

fn at(path: &Path, error: &dyn std::fmt::Display) -> Failure {
    let text = error.to_string();
    // As compilers write it, so that editors find the place.
    let text = match text.strip_prefix("line ") {
        Some(rest) => format!("{}:{rest}", path.display()),
        None => format!("{}: {text}", path.display()),
    };
    Failure::input(text.replacen("; fix: ", "\n  fix: ", 1))
}
