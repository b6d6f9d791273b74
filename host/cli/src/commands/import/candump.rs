//! `cathforce import candump`.

use std::io::{self, BufReader};
use std::path::Path;

use cathforce_bus::Id;
use cathforce_control::TICK_S;
use cathforce_recording::{
    Attachments, CandumpLog, Gap, NoLockStep, Recorder, SecondRun, WriteError, put_whole,
    read_candump,
};
use serde_json::json;

use super::trial::{at, open};
use crate::args::ImportCandumpArguments;
use crate::failure::Failure;
use crate::image::image;
use crate::open::{open_bundle, read_text, vessel_files};
use crate::output::check_new;
use crate::run_info::{CANDUMP, info};
use crate::session::DBC;
use crate::settings::master_of;
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &ImportCandumpArguments) -> Result<(), Failure> {
    let (path, out) = (&arguments.log, &arguments.out);
    check_new(out)?;
    let mut log = read(path, arguments.changes.file.as_deref())?;
    let bundle = open_bundle(ui, &arguments.bundle)?;
    let (image, _) = image(ui, &bundle, &arguments.changes)?;
    let mut info = info(CANDUMP, &bundle, "");
    info.started_unix_ns = log.started_ns;
    info.tick_s = f64::from(TICK_S);
    info.lock_step = put_in_lock_step(ui, path, &mut log);
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
        &json!({
            "path": out, "frames": frames, "foreign": foreign, "lock_step": info.lock_step,
        }),
        format_args!("{}: {frames} frames; {foreign} foreign frames left out\n", out.display()),
    )
}

/// Reads a log, which must hold frames of one run. `settings` describe its master.
fn read(path: &Path, settings: Option<&Path>) -> Result<CandumpLog, Failure> {
    let master = master_of(settings)?;
    let log = read_candump(BufReader::new(open(path)?), &master).map_err(|e| at(path, &e))?;
    if log.frames.is_empty() {
        let message = format!(
            "{}: none of the {} frames has an identifier of cathforce.dbc\n  fix: log the bus of the \
             device with `candump -l can0`",
            path.display(),
            log.foreign
        );
        return Err(Failure::input(message));
    }
    match &log.second_run {
        Some(second) => Err(two_runs(path, second)),
        None => Ok(log),
    }
}

/// Sorts the frames of a device in lock step into the order of a replay. Returns whether that was
/// possible.
fn put_in_lock_step(ui: &Ui, path: &Path, log: &mut CandumpLog) -> bool {
    if !log.frames.iter().any(|frame| Id::from_raw(frame.frame.id()) == Some(Id::Sync)) {
        return false;
    }
    match log.in_lock_step() {
        Ok(frames) => {
            log.frames = frames;
            true
        }
        Err(why) => {
            ui.warn(no_lock_step(path, why));
            false
        }
    }
}

/// Refuses a log of two runs: a recording has one image, and counts its ticks from one start.
fn two_runs(log: &Path, second: &SecondRun) -> Failure {
    let &SecondRun { line, last_before, ticks: (before, after) } = second;
    let log = log.display();
    Failure::input(format!(
        "{log}:{line}: the device starts again: tick {before} is followed by tick {after} of another \
         run\n  fix: take the runs apart: `head -n {last_before} {log} > first.log`, \
         `tail -n +{} {log} > second.log`",
        last_before + 1
    ))
}

/// Why a log of a device in lock step cannot be replayed: a replay needs every frame from the first
/// tick on.
fn no_lock_step(log: &Path, why: NoLockStep) -> String {
    let log = log.display();
    let (what, fix) = match why {
        NoLockStep::Begins(first) => {
            let begins = match first {
                Some(tick) => format!("its first tick is {tick}"),
                None => "it has no tick of a configured device".into(),
            };
            let what = format!(
                "{log}: the device was in lock step, but the log begins after its configuration: {begins}"
            );
            (what, "start `candump -l` before `cathforce run`".to_owned())
        }
        NoLockStep::Lacks(Gap { line, line_before, ticks: (before, after), seen }) => {
            let what = format!(
                "{log}:{line}: the device was in lock step, but tick {before} is followed by tick {after} \
                 after frames of {seen} ticks: frames were lost, or the log of another run was joined \
                 here without its beginning"
            );
            let fix = format!(
                "if two logs were joined, take them apart with `head -n {line_before} {log} > first.log`; \
                 if frames were lost, log with a larger buffer: `candump -r 1000000 -l can0`"
            );
            (what, fix)
        }
    };
    format!("{what}; it is imported as free running and cannot be replayed\n  fix: {fix}")
}
