//! One file a command.

pub mod check;
pub mod config;
pub mod doctor;
pub mod export;
pub mod fault;
pub mod gap;
pub mod import;
pub mod info;
pub mod latency;
pub mod link;
pub mod lumen;
pub mod monitor;
pub mod play;
pub mod replay;
pub mod report;
pub mod run;
pub mod shell;
pub mod tips;

use std::path::Path;

use cathforce_config::Key;
use cathforce_record::Recording;
use cathforce_rig::{Bundle, ImageBuildError, ImageOptions, ImageReport, device_image};

use crate::args::Changes;
use crate::failure::{Code, Failure};
use crate::settings::parse::{Entry, Problem, problem};
use crate::settings::{Setting, SettingsFile};
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

/// Changes settings by name, and parameters of the description by key: first those of the file.
fn options(bundle: &Bundle, changes: &Changes) -> Result<ImageOptions, Failure> {
    let mut options = ImageOptions {
        tip: changes.tip,
        guidewire_tip: changes.guidewire_tip,
        ..ImageOptions::default()
    };
    if let Some(cell_mm) = changes.cell {
        options.cell_m = 1e-3 * cell_mm;
    }
    if let Some(path) = &changes.file {
        let file = SettingsFile::read(path)?;
        file.check_rig(path, &bundle.rig.name)?;
        set_all(&mut options, &file)
            .map_err(|message| Failure::input(format!("{}: {message}", path.display())))?;
    }
    for (name, value) in &changes.settings {
        set(&mut options, name, *value)
            .map_err(|message| Failure::new(Code::Usage, format!("--set {message}")))?;
    }
    Ok(options)
}

/// Changes everything that a settings file names; `Err` says which line is wrong and why.
fn set_all(options: &mut ImageOptions, file: &SettingsFile) -> Result<(), String> {
    (options.master, options.band) = (file.master, file.band);
    file.set.iter().try_for_each(|(name, setting)| set(options, name, setting.value()))
}

fn set(options: &mut ImageOptions, name: &str, value: f32) -> Result<(), String> {
    let entry = Entry { name: name.into(), line: 0, setting: Setting::ByHand(value) };
    if let Some(Problem { message, fix, .. }) = problem(&entry) {
        return Err(format!("{message}: {fix}; `cathforce config` lists names and ranges"));
    }
    match Key::find(name) {
        Some(Key::Parameter(_)) => options.parameters.push((name.to_owned(), value)),
        _ => {
            options.settings.set(name, value).map_err(|error| format!("{name}={value}: {error}"))?
        }
    }
    Ok(())
}

/// The device image of a bundle.
fn image(ui: &Ui, bundle: &Bundle, changes: &Changes) -> Result<(Vec<u8>, ImageReport), Failure> {
    image_with(ui, bundle, &options(bundle, changes)?)
}

fn image_with(
    ui: &Ui,
    bundle: &Bundle,
    options: &ImageOptions,
) -> Result<(Vec<u8>, ImageReport), Failure> {
    ui.say(format_args!("building the device image of {}", bundle.path.display()));
    device_image(bundle, options).map_err(|error| match error {
        ImageBuildError::Parameter { key, value, error } => {
            Failure::new(Code::Usage, format!("--set {key}={value}: {error}"))
        }
        error => Failure::input(format!("{}: {error}", bundle.path.display())),
    })
}
