//! `cathforce check`: what a recording holds, what is missing and why, and whether it replays.

use cathforce_recording::{ReplayError, ReplayReport, Survey, replay, survey};
use serde_json::json;

use crate::args::CheckArguments;
use crate::difference::difference;
use crate::failure::{Code, Failure};
use crate::open::{is_complete, open_recording};
use crate::ui::{Ui, two_columns};

pub fn run(ui: &Ui, arguments: &CheckArguments) -> Result<(), Failure> {
    arguments.json_file.check()?;
    let recording = open_recording(ui, &arguments.recording)?;
    let survey = survey(&recording);
    let replayed = match arguments.no_replay {
        true => None,
        false => match replay(&recording) {
            Ok((report, _)) => Some(report),
            Err(ReplayError::FreeRunning) => None,
            Err(error) => return Err(error.into()),
        },
    };
    let json = json!({
        "path": arguments.recording,
        "complete": is_complete(&recording),
        "cut_at_byte": recording.cut.map(|cut| cut.byte),
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
    let verdict = match (&replayed, arguments.no_replay) {
        (_, true) => "not asked for".to_owned(),
        (None, false) => "not possible, because it was recorded without lock step".to_owned(),
        (Some(report), _) if report.identical() => {
            format!("bit by bit, {} frames", report.frames_compared)
        }
        (Some(_), _) => "no".to_owned(),
    };
    rows.push(("replays".to_owned(), verdict));
    arguments.json_file.write(ui, &json, two_columns(&rows))?;
    if let Some(report) = replayed.filter(|report| !report.identical()) {
        return Err(difference(&report, &recording.info));
    }
    let missing = survey.frames_missing().max(survey.ticks_missing);
    if missing > arguments.allow_missing {
        let message = format!(
            "{} frames and {} ticks are missing, more than the {} of --allow-missing",
            survey.frames_missing(),
            survey.ticks_missing,
            arguments.allow_missing
        );
        return Err(Failure::new(Code::Threshold, message));
    }
    Ok(())
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
