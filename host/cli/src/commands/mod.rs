//! One file a command.

pub mod config;
pub mod export;
pub mod gap;
pub mod info;
pub mod replay;
pub mod report;
pub mod run;
pub mod tips;

use std::path::Path;

use cathforce_mechanics::parameters;
use cathforce_record::Recording;
use cathforce_rig::{Bundle, ImageBuildError, ImageOptions, ImageReport, device_image};

use crate::args::Changes;
use crate::failure::{Code, Failure};
use crate::ui::Ui;

/// Opens a bundle and says what looks wrong with it.
fn open_bundle(ui: &Ui, path: &Path) -> Result<Bundle, Failure> {
    let bundle = Bundle::open(path)?;
    for warning in &bundle.warnings {
        ui.warn(warning);
    }
    Ok(bundle)
}

/// Opens a recording and says where it breaks off, if it does.
fn open_recording(ui: &Ui, path: &Path) -> Result<Recording, Failure> {
    let recording = Recording::open(path)?;
    if let Some(cut) = recording.cut {
        ui.warn(format_args!(
            "{}: breaks off at byte {}: the recorder was killed; using what there is",
            path.display(),
            cut.byte
        ));
    }
    Ok(recording)
}

/// Whether a recording has its end, and the run had.
pub fn completeness(recording: &Recording) -> String {
    match recording.cut {
        Some(cut) => format!("breaks off at byte {}", cut.byte),
        None if recording.result.is_none() => "no: the run broke off".into(),
        None => "yes".into(),
    }
}

/// Says now, rather than after a run, that a file cannot be written; leaves what is there.
fn check_writable(path: &Path) -> Result<(), Failure> {
    let is_new = !path.exists();
    let open = std::fs::OpenOptions::new().append(true).create(true).open(path);
    open.map_err(|e| Failure::write(path, e))?;
    if is_new {
        std::fs::remove_file(path).map_err(|e| Failure::write(path, e))?;
    }
    Ok(())
}

/// Changes settings by name, and parameters of the description by key.
fn options(changes: &Changes) -> Result<ImageOptions, Failure> {
    let mut options = ImageOptions { tip: changes.tip, ..ImageOptions::default() };
    for (name, value) in &changes.settings {
        if parameters().any(|info| info.key == name) {
            options.parameters.push((name.clone(), *value));
            continue;
        }
        options.settings.set(name, *value).map_err(|error| {
            let message =
                format!("--set {name}={value}: {error}; `cathforce config` lists names and ranges");
            Failure::new(Code::Usage, message)
        })?;
    }
    Ok(options)
}

/// The device image of a bundle.
fn image(ui: &Ui, bundle: &Bundle, changes: &Changes) -> Result<(Vec<u8>, ImageReport), Failure> {
    let options = options(changes)?;
    ui.say(format_args!("building the device image of {}", bundle.path.display()));
    device_image(bundle, &options).map_err(|error| match error {
        ImageBuildError::Parameter { key, value, error } => {
            Failure::new(Code::Usage, format!("--set {key}={value}: {error}"))
        }
        error => Failure::input(format!("{}: {error}", bundle.path.display())),
    })
}
