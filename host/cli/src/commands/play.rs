//! `cathforce play`: the frames of a recording on a bus, at their time.

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use cathforce_bus::{Direction, Id};
use cathforce_recording::{BusFrame, BusLog, is_recording, read_log};
use serde_json::json;

use super::import::candump::{check_own, say_log};
use super::import::trial::at;
use crate::args::SendArguments;
use crate::failure::{Code, Failure};
use crate::open::{open_recording, read_bytes};
use crate::session::interrupt_flag;
use crate::settings::master_of;
use crate::ui::{Ui, two_columns};

/// Time before a frame during which the program does not sleep: a sleep may last that much longer.
const SPIN: Duration = Duration::from_micros(200);

pub fn run(ui: &Ui, arguments: &SendArguments) -> Result<(), Failure> {
    let path = &arguments.file;
    let frames = frames(ui, arguments)?;
    let mut played = frames.iter().filter(|frame| wanted(frame, arguments)).collect::<Vec<_>>();
    // In lock step, frames to the device are recorded before the answers of earlier ticks.
    played.sort_by_key(|frame| frame.at_ns);
    if played.is_empty() {
        let message = format!(
            "{}: none of its {} frames would be played\n  fix: --all plays the device's frames as well",
            path.display(),
            frames.len()
        );
        return Err(Failure::input(message));
    }
    let started = Instant::now();
    let (sent, latest) = play(ui, &played, arguments)?;
    let seconds = started.elapsed().as_secs_f64();
    let rows = [
        ("frames", sent.to_string()),
        ("seconds", format!("{seconds:.3}")),
        ("latest frame", format!("{:.3} ms after its time", 1e3 * latest.as_secs_f64())),
    ];
    let json = json!({ "frames": sent, "seconds": seconds, "latest_s": latest.as_secs_f64() });
    ui.data(&json, two_columns(&rows.map(|(label, value)| (label.to_owned(), value))))?;
    match sent == played.len() {
        true => Ok(()),
        false => Err(Failure::new(Code::Failed, "interrupted before the last frame was played")),
    }
}

/// Sends each frame at its time. Returns how many were sent and the largest delay of one.
fn play(
    ui: &Ui,
    frames: &[&BusFrame],
    arguments: &SendArguments,
) -> Result<(usize, Duration), Failure> {
    let interrupted = interrupt_flag()?;
    let mut link = cathforce_link::open(&arguments.link)?;
    let mut progress = ui.progress("playing", frames.len() as u64, "frames");
    let first_ns = frames.first().map_or(0, |frame| frame.at_ns);
    let (started, mut latest) = (Instant::now(), Duration::ZERO);
    for (sent, frame) in frames.iter().enumerate() {
        if interrupted.load(Ordering::Relaxed) {
            return Ok((sent, latest));
        }
        let seconds = (frame.at_ns - first_ns) as f64 * 1e-9 / arguments.speed;
        let due = Duration::try_from_secs_f64(seconds).ok();
        let due = due.and_then(|wait| started.checked_add(wait)).ok_or_else(|| {
            let message = format!(
                "--speed {} is too slow: the end is out of the clock's range",
                arguments.speed
            );
            Failure::new(Code::Usage, message)
        })?;
        // The answers are dropped, but they must be read: a full buffer would stop the carrier.
        while let Some(left) = due.checked_duration_since(Instant::now()) {
            match left.checked_sub(SPIN) {
                Some(wait) => drop(link.receive(wait)?),
                None => std::hint::spin_loop(),
            }
        }
        latest = latest.max(due.elapsed());
        link.send(&frame.frame)?;
        link.flush()?;
        progress.set(sent as u64 + 1);
    }
    Ok((frames.len(), latest))
}

/// The frames of a recording or a log. The settings describe the master of a log; a recording knows its
/// own.
fn frames(ui: &Ui, arguments: &SendArguments) -> Result<Vec<BusFrame>, Failure> {
    let (path, settings) = (&arguments.file, arguments.settings.as_deref());
    if !is_recording(path) {
        let bytes = read_bytes(path)?;
        if BusLog::is_one(&bytes) {
            let (channel, placement) =
                (arguments.channel.as_deref(), arguments.id_base.unwrap_or_default());
            let log = read_log(&bytes, &master_of(settings)?, channel, placement);
            let log = log.map_err(|e| at(path, &e))?;
            say_log(ui, path, &log);
            check_own(path, &log, arguments.foreign)?;
            return Ok(log.frames);
        }
    }
    if settings.is_some() {
        ui.warn("--settings is not used: a recording knows the frames of its master");
    }
    Ok(open_recording(ui, path)?.frames)
}

/// Whether a frame is played. Service transfers belong to one device, and SYNC would run the ticks of
/// another. Unknown identifiers belong to the master or to other nodes of the bus.
fn wanted(frame: &BusFrame, arguments: &SendArguments) -> bool {
    match Id::from_raw(frame.frame.id()) {
        Some(Id::Sync | Id::ServiceRequest | Id::ServiceResponse) => false,
        Some(Id::Command) => arguments.commands,
        Some(_) | None => arguments.all || frame.direction == Direction::ToDevice,
    }
}
