//! Reading the files of other tools, and writing the trial that is made of them.

use std::fs::File;
use std::io;
use std::path::Path;

use cathforce_bundle::bundle::LONGEST_GAP_S;
use cathforce_recording::import::ImportedTrial;
use cathforce_recording::{Trial, write_drive, write_transmission, write_trial, write_whole};
use serde_json::Value;

use crate::failure::Failure;
use crate::ui::Ui;

/// Opens a file, which must not be a folder, a pipe or a device: a device may have no end.
pub fn open(path: &Path) -> Result<File, Failure> {
    // Opening a folder succeeds, and reading it would blame its first line.
    let opened = match path.metadata().map(|found| (found.is_dir(), found.is_file())) {
        Ok((true, _)) => Err(io::ErrorKind::IsADirectory.into()),
        Ok((_, false)) => Err(io::Error::other("it is a pipe or a device")),
        _ => File::open(path),
    };
    opened.map_err(|e| {
        Failure::input(format!("cannot read {}: {e}\n  fix: give a file", path.display()))
    })
}

/// The failure of a file, with its line as compilers print it, so that editors find the place.
pub fn at(path: &Path, error: &dyn std::fmt::Display) -> Failure {
    let text = error.to_string();
    let text = match text.strip_prefix("line ") {
        Some(rest) => format!("{}:{rest}", path.display()),
        None => format!("{}: {text}", path.display()),
    };
    Failure::input(text.replacen("; fix: ", "\n  fix: ", 1))
}

pub fn warn_all(ui: &Ui, path: &Path, remarks: &[String]) {
    for remark in remarks {
        ui.warn(format_args!("{}: {remark}", path.display()));
    }
}

pub fn say_all(ui: &Ui, path: &Path, understood: &[String]) {
    for understood in understood {
        ui.say(format_args!("{}: {understood}", path.display()));
    }
}

/// Writes a trial, or nothing if there is no path for it, and prints what it holds.
pub fn write(
    ui: &Ui,
    out: Option<&Path>,
    trial: &ImportedTrial,
    json: &Value,
    text: &str,
) -> Result<(), Failure> {
    if let ImportedTrial::Catheter(trial) = trial {
        check_holes(trial)?;
    }
    let Some(out) = out else {
        return ui.data(json, format_args!("{text}: nothing is written\n"));
    };
    write_whole(out, |file| match trial {
        ImportedTrial::Catheter(trial) => write_trial(trial, file),
        ImportedTrial::Drive(t_s, data) => write_drive(t_s, data, file),
        ImportedTrial::Transmission(t_s, data) => write_transmission(t_s, data, file),
    })
    .map_err(|e| Failure::write(out, e))?;
    ui.data(json, format_args!("{text}: {}\n", out.display()))
}

/// Refuses a trial that a bundle would refuse: joined from a motion that is not known all the time.
fn check_holes(trial: &Trial) -> Result<(), Failure> {
    let mut pairs = trial.rows.windows(2).map(|pair| (pair[0].t_s, pair[1].t_s));
    match pairs.find(|(before, after)| after - before > LONGEST_GAP_S) {
        None => Ok(()),
        Some((before, after)) => Err(Failure::input(format!(
            "the motion has no row from {before} s to {after} s, and a trial needs one every {LONGEST_GAP_S} s\
             most\n  fix: cut the motion in two there, and import each part on its own"
        ))),
    }
}
