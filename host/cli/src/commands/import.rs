//! `cathforce import`.

use std::fs::File;
use std::io::{self, BufReader};
use std::path::Path;

use cathforce_bundle::bundle::LONGEST_GAP_S;
use cathforce_bus::Id;
use cathforce_control::TICK_S;
use cathforce_recording::import::{
    AtiOptions, ImportedTable, ImportedTrial, Joined, join, read_ati, read_csv, read_motion,
};
use cathforce_recording::{
    Attachments, Gap, NoLockStep, Recorder, Recording, SecondRun, Trial, WriteError, is_recording,
    put_whole, read_candump, write_drive, write_trial, write_whole,
};
use serde_json::json;

use crate::args::{ImportAtiArguments, ImportCandumpArguments, ImportCsvArguments, ImportSource};
use crate::failure::Failure;
use crate::image::image;
use crate::open::{open_bundle, open_recording, read_text, vessel_files};
use crate::output::check_new;
use crate::run_info::{CANDUMP, info};
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
    let mut info = info(CANDUMP, &bundle, "");
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
    let log = read_ati(open(path)?, &options).map_err(|e| at(path, &e))?;
    let shown = path.display();
    if let Some(rate) = arguments.rate.filter(|_| log.has_time) {
        ui.warn(format_args!("--rate {rate} is not used: {shown} has a column of time"));
    }
    let motion = motion(ui, &arguments.motion)?;
    let of_motion = arguments.motion.display();
    let joined = join(&motion, &log.samples, arguments.offset);
    let Joined { forces, outside, in_gaps, .. } = joined;
    let all = log.samples.len();
    if forces == 0 {
        let message = format!(
            "{shown}: none of its {all} rows is within the time of {of_motion}\n  fix: say with \
             --offset at which time of the motion the log begins"
        );
        return Err(Failure::input(message));
    }
    if outside as f64 > MOST_OUTSIDE * all as f64 {
        ui.warn(format_args!(
            "{shown}: {outside} of its {all} rows are outside the time of {of_motion}: is --offset \
             right, and the time in seconds?"
        ));
    }
    if in_gaps > 0 {
        ui.warn(format_args!(
            "{of_motion}: says nothing of the drive for more than {LONGEST_GAP_S} s at a time, where \
             {in_gaps} rows of {shown} are left out"
        ));
    }
    if joined.had_force {
        ui.warn(format_args!(
            "{of_motion}: has a force of its own, which is left out: the one of {shown} takes its place"
        ));
    }
    let count = |n: usize, what: &str| match n {
        0 => String::new(),
        n => format!(", {n} {what}"),
    };
    let text = format!(
        "{forces} rows{}{}{}",
        count(outside, "outside the motion left out"),
        count(in_gaps, "in its gaps left out"),
        count(joined.others, "others of what else the motion has")
    );
    let json = json!({
        "path": out, "rows": forces, "left_out": outside + in_gaps, "others": joined.others,
    });
    write(ui, out, &ImportedTrial::Catheter(joined.trial), &json, &text)
}

/// So many of a log's rows may come before the motion or after it, as they do when both are started
/// by hand.
const MOST_OUTSIDE: f64 = 0.1;

fn csv(ui: &Ui, arguments: &ImportCsvArguments) -> Result<(), Failure> {
    let (path, out) = (&arguments.table, &arguments.out);
    check_new(out)?;
    let ImportedTable { trial, remarks } =
        read_csv(open(path)?, &arguments.columns).map_err(|e| at(path, &e))?;
    warn_all(ui, path, &remarks);
    let rows = match &trial {
        ImportedTrial::Catheter(trial) => trial.rows.len(),
        ImportedTrial::Drive(t_s, _) => t_s.len(),
    };
    let json = json!({ "path": out, "rows": rows, "left_out": 0 });
    write(ui, out, &trial, &json, &format!("{rows} rows"))
}

fn warn_all(ui: &Ui, path: &Path, remarks: &[String]) {
    for remark in remarks {
        ui.warn(format_args!("{}: {remark}", path.display()));
    }
}

/// Where the drive was.
fn motion(ui: &Ui, path: &Path) -> Result<Trial, Failure> {
    if is_recording(path) || path.extension().is_some_and(|ending| ending == "mcap") {
        let recording: Recording = open_recording(ui, path)?;
        if recording.trial.rows.is_empty() {
            let message = format!(
                "{}: no trial was played in it\n  fix: give a recording of `cathforce run`",
                path.display()
            );
            return Err(Failure::input(message));
        }
        return Ok(recording.trial);
    }
    let (trial, remarks) = read_motion(open(path)?).map_err(|e| at(path, &e))?;
    warn_all(ui, path, &remarks);
    Ok(trial)
}

fn write(
    ui: &Ui,
    out: &Path,
    trial: &ImportedTrial,
    json: &serde_json::Value,
    text: &str,
) -> Result<(), Failure> {
    write_whole(out, |file| match trial {
        ImportedTrial::Catheter(trial) => write_trial(trial, file),
        ImportedTrial::Drive(t_s, data) => write_drive(t_s, data, file),
    })
    .map_err(|e| Failure::write(out, e))?;
    ui.data(json, format_args!("{text}: {}\n", out.display()))
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
