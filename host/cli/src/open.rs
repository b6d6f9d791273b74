//! Opens what commands work on, and says what looks wrong with it.

use std::path::Path;

use cathforce_bundle::Bundle;
use cathforce_recording::{Damage, Recording, VESSEL_FILES};

use crate::failure::Failure;
use crate::ui::Ui;

/// Opens a bundle and prints its warnings.
pub fn open_bundle(ui: &Ui, path: &Path) -> Result<Bundle, Failure> {
    let bundle = Bundle::open(path)?;
    for warning in &bundle.warnings {
        ui.warn(warning);
    }
    Ok(bundle)
}

/// Opens a recording and warns where it breaks off.
pub fn open_recording(ui: &Ui, path: &Path) -> Result<Recording, Failure> {
    let recording = Recording::open(path)?;
    if let Some(cut) = recording.cut {
        ui.warn(format_args!(
            "{}: the recording breaks off at byte {} because the recorder was killed; the part before \
             it is used",
            path.display(),
            cut.byte
        ));
    }
    for Damage { byte, what } in &recording.damage {
        ui.warn(format_args!("{}: byte {byte}: {what}; the rest is used", path.display()));
    }
    Ok(recording)
}

/// Whether a recording and its run both came to their end.
pub fn is_complete(recording: &Recording) -> bool {
    recording.cut.is_none() && recording.damage.is_empty() && recording.result.is_some()
}

/// The files of a bundle that describe the vessel, by their names.
pub fn vessel_files(bundle: &Bundle) -> Result<Vec<(&'static str, Vec<u8>)>, Failure> {
    let present = VESSEL_FILES.into_iter().filter(|name| bundle.path.join(name).is_file());
    let read = |name: &'static str| {
        let path = bundle.path.join(name);
        let bytes = std::fs::read(&path).map_err(|e| cannot_read(&path, &e))?;
        Ok((name, bytes))
    };
    present.map(read).collect()
}

/// A file as a whole. What is no file is refused: a device may have no end, and a pipe no beginning.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, Failure> {
    let kind = path.metadata().map_err(|e| cannot_read(path, &e))?.file_type();
    if !kind.is_file() {
        let what = if kind.is_dir() { "a folder" } else { "a pipe or a device" };
        let path = path.display();
        return Err(Failure::input(format!(
            "cannot read {path}: it is {what}, not a file\n  fix: give a file; write what comes from a \
             pipe into one first"
        )));
    }
    std::fs::read(path).map_err(|e| cannot_read(path, &e))
}

/// A text file as a whole.
pub fn read_text(path: &Path) -> Result<String, Failure> {
    String::from_utf8(read_bytes(path)?).map_err(|e| {
        let line = 1 + e.as_bytes()[..e.utf8_error().valid_up_to()]
            .iter()
            .filter(|b| **b == b'\n')
            .count();
        Failure::input(format!(
            "{}:{line}: this is no UTF-8 text\n  fix: save it as UTF-8",
            path.display()
        ))
    })
}

fn cannot_read(path: &Path, error: &std::io::Error) -> Failure {
    Failure::input(format!("cannot read {}: {error}\n  fix: check the path", path.display()))
}
