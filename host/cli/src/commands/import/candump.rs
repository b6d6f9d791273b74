//! `cathforce import can`.

use std::io;
use std::path::Path;

use cathforce_bus::Id;
use cathforce_control::TICK_S;
use cathforce_recording::{
    Attachments, CandumpLog, Gap, NoLockStep, Recorder, SecondRun, WriteError, put_whole, read_log,
};
use serde_json::json;

use super::trial::{at, say_all, warn_all};
use crate::args::ImportCandumpArguments;
use crate::failure::Failure;
use crate::image::image;
use crate::open::{open_bundle, read_bytes, read_text, vessel_files};
use crate::output::{check_new, shown};
use crate::run_info::{CANDUMP, info};
use crate::session::DBC;
use crate::settings::master_of;
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &ImportCandumpArguments) -> Result<(), Failure> {
    let (path, out) = (&arguments.log, &arguments.out);
    check_new(out)?;
    let mut log = read(ui, arguments)?;
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
    if arguments.dry_run {
        return report(ui, out, &log, info.lock_step, true);
    }
    let put = put_whole(out, |unfinished| Ok::<_, io::Error>(record(unfinished)?));
    put.map_err(|e| Failure::write(out, e))?;
    report(ui, out, &log, info.lock_step, false)
}

fn report(
    ui: &Ui,
    out: &Path,
    log: &CandumpLog,
    lock_step: bool,
    dry_run: bool,
) -> Result<(), Failure> {
    let (frames, foreign) = (log.frames.len(), log.foreign);
    let to = if dry_run { "nothing is written".into() } else { out.display().to_string() };
    ui.data(
        &json!({
            "path": shown(out), "frames": frames, "foreign": foreign, "lock_step": lock_step,
            "format": log.format.map(|format| format.to_string()), "channel": log.channel,
            "intact": log.intact, "broken": log.broken, "remarks": log.remarks,
        }),
        format_args!("{to}: {frames} frames; {foreign} foreign frames left out\n"),
    )
}

/// Reads a log, which must hold frames of one run of ours.
fn read(ui: &Ui, arguments: &ImportCandumpArguments) -> Result<CandumpLog, Failure> {
    let path = &arguments.log;
    let master = master_of(arguments.changes.file.as_deref())?;
    let placement = arguments.id_base.unwrap_or_default();
    let log = read_log(&read_bytes(path)?, &master, arguments.channel.as_deref(), placement);
    let log = log.map_err(|e| at(path, &e))?;
    say_log(ui, path, &log);
    if log.frames.is_empty() {
        let message = format!(
            "{}: none of the {} frames has an identifier of cathforce.dbc\n  fix: log the bus of the \
             device with `candump -l can0`; identifiers that were moved to 29 bits need --id-base",
            path.display(),
            log.foreign
        );
        return Err(Failure::input(message));
    }
    check_own(path, &log, arguments.foreign)?;
    match &log.second_run {
        Some(second) => Err(two_runs(path, second)),
        None => Ok(log),
    }
}

/// Says what was understood of a log, and what was left out.
pub fn say_log(ui: &Ui, path: &Path, log: &CandumpLog) {
    let format = log.format.map_or(String::new(), |format| format.to_string());
    let channel = log.channel.as_ref().map_or(String::new(), |name| format!(", channel {name}"));
    let seconds = log.frames.last().map_or(0.0, |last| last.at_ns as f64 * 1e-9);
    let understood = format!(
        "{format}{channel}: {} frames over {seconds:.3} s, {} with our checksum, {} without it",
        log.frames.len(),
        log.intact,
        log.broken
    );
    say_all(ui, path, &[understood]);
    warn_all(ui, path, &log.remarks);
}

/// Refuses the log of another bus, unless it is asked for.
pub fn check_own(path: &Path, log: &CandumpLog, is_asked_for: bool) -> Result<(), Failure> {
    if is_asked_for || !log.is_foreign() {
        return Ok(());
    }
    let CandumpLog { intact, broken, .. } = log;
    Err(Failure::input(format!(
        "{}: this is the log of another bus: {broken} of its {} frames with identifiers of ours do not \
         have our checksum\n  fix: log the bus of the device; --foreign takes the log nevertheless",
        path.display(),
        intact + broken
    )))
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
