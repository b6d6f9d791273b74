//! Reading the files of other tools, and writing the trial that is made of them.

use std::fs::File;
use std::io;
use std::path::Path;

use cathforce_recording::import::ImportedTrial;
use cathforce_recording::{write_drive, write_trial, write_whole};
use serde_json::Value;

use crate::failure::Failure;
use crate::ui::Ui;

/// Opens a file, which must not be a folder.
pub fn open(path: &Path) -> Result<File, Failure> {
    // Opening a folder succeeds, and reading it would blame its first line.
    let opened = match path.is_dir() {
        true => Err(io::ErrorKind::IsADirectory.into()),
        false => File::open(path),
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

/// Writes a trial and prints what it holds.
pub fn write(
    ui: &Ui,
    out: &Path,
    trial: &ImportedTrial,
    json: &Value,
    text: &str,
) -> Result<(), Failure> {
    write_whole(out, |file| match trial {
        ImportedTrial::Catheter(trial) => write_trial(trial, file),
        ImportedTrial::Drive(t_s, data) => write_drive(t_s, data, file),
    })
    .map_err(|e| Failure::write(out, e))?;
    ui.data(json, format_args!("{text}: {}\n", out.display()))
}
