//! `cathforce check`: what a recording holds, what is missing and why, and whether it replays.

use std::path::Path;

use cathforce_recording::{Damage, Recording, ReplayError, ReplayReport, Survey, replay, survey};
use serde_json::json;

use crate::args::CheckArguments;
use crate::difference::difference;
use crate::failure::{Code, Failure};
use crate::open::{is_complete, open_recording};
use crate::output::shown;
use crate::ui::{Ui, two_columns};

pub fn run(ui: &Ui, arguments: &CheckArguments) -> Result<(), Failure> {
    arguments.json_file.check()?;
    let recording = open_recording(ui, &arguments.recording)?;
    let survey = survey(&recording);
    let replayed = replayed(&recording, arguments.no_replay)?;
    let json = json!({
        "path": shown(&arguments.recording),
        "complete": is_complete(&recording),
        "cut_at_byte": recording.cut.map(|cut| cut.byte),
        "damage": recording.damage.iter().map(|part| json!({ "byte": part.byte, "what": part.what }))
            .collect::<Vec<_>>(),
        "firmware": recording.info.firmware_version,
        "survey": survey,
        "replay": replayed,
        "replays": replayed.as_ref().map(ReplayReport::identical),
    });
    let mut rows = vec![
        ("complete".to_owned(), recording.completeness()),
        ("firmware".to_owned(), recording.info.firmware_version.clone()),
    ];
    rows.extend(survey_rows(&survey));
    let free_running = !recording.info.lock_step;
    rows.push((
        "replays".to_owned(),
        verdict(replayed.as_ref(), arguments.no_replay, free_running),
    ));
    arguments.json_file.write(ui, &json, two_columns(&rows))?;
    if let Some(report) = replayed.filter(|report| !report.identical()) {
        return Err(difference(&report, &recording.info));
    }
    check_damage(&arguments.recording, &recording.damage)?;
    check_missing(&survey, arguments.allow_missing)
}

/// A file that does not match its checksums fails, whatever may be missing.
fn check_damage(path: &Path, damage: &[Damage]) -> Result<(), Failure> {
    if damage.is_empty() {
        return Ok(());
    }
    let parts = damage
        .iter()
        .map(|Damage { byte, what }| format!("{}: byte {byte}: {what}", path.display()));
    let fix = "copy the file again from where it was recorded, or use what is left of it";
    Err(Failure::input(format!("{}\n  fix: {fix}", parts.collect::<Vec<_>>().join("\n"))))
}

/// The replay; `None` where it is not wanted, or not possible: without lock step or without every frame.
fn replayed(recording: &Recording, no_replay: bool) -> Result<Option<ReplayReport>, Failure> {
    if no_replay {
        return Ok(None);
    }
    match replay(recording) {
        Ok((report, _)) => Ok(Some(report)),
        Err(ReplayError::FreeRunning | ReplayError::Damaged { .. }) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

fn verdict(replayed: Option<&ReplayReport>, no_replay: bool, free_running: bool) -> String {
    match replayed {
        None if no_replay => "not asked for".to_owned(),
        None if free_running => {
            "not possible, because it was recorded without lock step".to_owned()
        }
        None => "not possible, because frames were in a damaged part of the file".to_owned(),
        Some(report) if report.identical() => {
            format!("bit by bit, {} frames", report.frames_compared)
        }
        Some(_) => "no".to_owned(),
    }
}

fn check_missing(survey: &Survey, allowed: u64) -> Result<(), Failure> {
    let (frames, ticks) = (survey.frames_missing(), survey.ticks_missing);
    if frames.max(ticks) <= allowed {
        return Ok(());
    }
    let message = format!(
        "{frames} frames and {ticks} ticks are missing, more than the {allowed} of --allow-missing"
    );
    Err(Failure::new(Code::Threshold, message))
}

fn survey_rows(survey: &Survey) -> Vec<(String, String)> {
    let mut rows = vec![
        ("seconds", format!("{:.3}", survey.seconds)),
        ("ticks", format!("{}, {} missing", survey.ticks, survey.ticks_missing)),
        ("frames", format!("{}, {} missing", survey.frames, survey.frames_missing())),
        ("measured rows", survey.measured_rows.to_string()),
    ];
    let load = survey.bus_load.map(|load| format!("{:.1} % of 1 Mbit/s", 100.0 * load));
    rows.extend(load.map(|load| ("bus load", load)));
    let gap = survey.longest_tick_gap_s;
    rows.extend(gap.map(|s| ("longest tick", format!("{:.3} ms", 1e3 * s))));
    let mut rows: Vec<_> = rows.into_iter().map(|(label, text)| (label.to_owned(), text)).collect();
    for id in &survey.ids {
        let rate = id.rate_hz.map_or(String::new(), |hz| format!(", {hz:.1} Hz"));
        rows.push((format!("  {}", id.name), format!("{}{rate}", id.frames)));
    }
    for dropout in &survey.dropouts {
        let text = format!(
            "{} frames, {} times from {:.3} to {:.3} s: {}",
            dropout.frames, dropout.times, dropout.first_s, dropout.last_s, dropout.meaning
        );
        rows.push((dropout.cause.to_string(), text));
    }
    rows
}
