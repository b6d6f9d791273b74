//! The motion of the drive that another instrument's measurements are joined with.

use std::path::Path;

use cathforce_recording::import::read_motion;
use cathforce_recording::{Trial, is_recording};

use super::trial::{at, open, warn_all};
use crate::failure::Failure;
use crate::open::open_recording;
use crate::ui::Ui;

/// Reads a motion from a recording or a trial.
pub fn motion(ui: &Ui, path: &Path) -> Result<Trial, Failure> {
    if !is_recording(path) && path.extension().is_none_or(|ending| ending != "mcap") {
        let (trial, remarks) = read_motion(open(path)?).map_err(|e| at(path, &e))?;
        warn_all(ui, path, &remarks);
        return Ok(trial);
    }
    let recording = open_recording(ui, path)?;
    if recording.trial.rows.is_empty() {
        let message = format!(
            "{}: no trial was played in this recording\n  fix: give a recording of `cathforce run`",
            path.display()
        );
        return Err(Failure::input(message));
    }
    Ok(recording.trial)
}
