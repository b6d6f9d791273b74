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
#[cfg(feature = "monitor")]
pub mod monitor;
pub mod play;
pub mod replay;
pub mod report;
pub mod run;
pub mod shell;
pub mod tips;

mod left_out;
#[cfg(not(feature = "monitor"))]
pub use left_out::monitor;

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use cathforce_bundle::{
    Bundle, ImageBuildError, ImageOptions, ImageReport, check_rig, device_image, rig_description,
};
use cathforce_config::Key;
use cathforce_mechanics::Description;
use cathforce_recording::Recording;

use crate::args::Changes;
use crate::failure::{Code, Failure};
use crate::settings::model::is_of_model;
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
fn options(ui: &Ui, bundle: &Bundle, changes: &Changes) -> Result<ImageOptions, Failure> {
    let mut options = ImageOptions {
        tip: changes.tip,
        guidewire_tip: changes.guidewire_tip,
        ..ImageOptions::default()
    };
    if let Some(cell_mm) = changes.cell {
        options.cell_m = 1e-3 * cell_mm;
    }
    let file = changes.file.as_deref().map(SettingsFile::read).transpose()?;
    if let Some((path, file)) = changes.file.as_ref().zip(file.as_ref()) {
        file.check_rig(path, &bundle.rig.name)?;
        set_all(&mut options, file)
            .map_err(|message| Failure::input(format!("{}: {message}", path.display())))?;
    }
    for (name, value) in &changes.settings {
        set(&mut options, name, *value)
            .map_err(|message| Failure::new(Code::Usage, format!("--set {message}")))?;
    }
    if let Some((file, stated)) = file.as_ref().and_then(|file| Some((file, file.band.as_ref()?))) {
        let description = described(bundle, &options)?;
        let besides = [file.by_hand(), by_hand(changes)].concat();
        options.band = stated.for_model(ui, &description, &besides);
    }
    Ok(options)
}

/// What of the command line makes another model of a rig.
fn by_hand(changes: &Changes) -> Vec<String> {
    let names = changes.settings.iter().map(|(name, _)| name);
    let mut all: Vec<String> = names.filter(|name| is_of_model(name)).cloned().collect();
    all.extend(changes.tip.map(|_| "--tip".to_owned()));
    all.extend(changes.guidewire_tip.map(|_| "--guidewire-tip".to_owned()));
    all
}

/// Changes everything but the band that a settings file names; `Err` says which line is wrong and why.
fn set_all(options: &mut ImageOptions, file: &SettingsFile) -> Result<(), String> {
    options.master = file.master;
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
    image_with(ui, bundle, &options(ui, bundle, changes)?)
}

fn image_with(
    ui: &Ui,
    bundle: &Bundle,
    options: &ImageOptions,
) -> Result<(Vec<u8>, ImageReport), Failure> {
    ui.say(format_args!("building the device image of {}", bundle.path.display()));
    let (image, report) = device_image(bundle, options).map_err(|error| no_image(bundle, error))?;
    for doubt in report.lumen.doubts() {
        warn_once(ui, format!("{}: the vessel: {doubt}", bundle.path.display()));
    }
    Ok((image, report))
}

/// Warns of what was not warned of before: a command may build several images of one vessel.
fn warn_once(ui: &Ui, message: String) {
    static SAID: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    let mut said = SAID.lock().unwrap_or_else(PoisonError::into_inner);
    if !said.contains(&message) {
        ui.warn(&message);
        said.insert(message);
    }
}

/// What a bundle's rig is with these options.
fn described(bundle: &Bundle, options: &ImageOptions) -> Result<Description<f32>, Failure> {
    rig_description(bundle, options).map_err(|error| no_image(bundle, error))
}

/// Says of a rig that no device could have it, before one is to be made of it.
fn check_model(bundle: &Bundle) -> Result<(), Failure> {
    if bundle.catheter().is_none() {
        return Ok(());
    }
    let description = described(bundle, &ImageOptions::default())?;
    check_rig(bundle, &description).map_err(|error| no_image(bundle, error))
}

fn no_image(bundle: &Bundle, error: ImageBuildError) -> Failure {
    match error {
        // Names its file itself.
        ImageBuildError::Bundle(error) => error.into(),
        ImageBuildError::Parameter { key, value, error } => {
            Failure::new(Code::Usage, format!("--set {key}={value}: {error}"))
        }
        error => Failure::input(format!("{}: {error}", bundle.path.display())),
    }
}
