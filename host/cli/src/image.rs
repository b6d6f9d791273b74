//! Device images: a bundle with the changes of a settings file and the command line.

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

use cathforce_bundle::{
    Bundle, ImageBuildError, ImageOptions, ImageReport, check_rig, device_image, rig_description,
};
use cathforce_mechanics::Description;

use crate::args::Changes;
use crate::failure::{Code, Failure};
use crate::settings::SettingsFile;
use crate::settings::model::is_of_model;
use crate::ui::Ui;

/// Options with the settings of the file, and then those of the command line.
pub fn options(ui: &Ui, bundle: &Bundle, changes: &Changes) -> Result<ImageOptions, Failure> {
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
        options
            .set(name, *value)
            .map_err(|message| Failure::new(Code::Usage, format!("--set {message}")))?;
    }
    if let Some((file, stated)) = file.as_ref().and_then(|file| Some((file, file.band.as_ref()?))) {
        let description = described(bundle, &options)?;
        let by_hand = [file.by_hand(), by_hand(changes)].concat();
        options.band = stated.for_model(ui, &description, &by_hand);
    }
    Ok(options)
}

/// Names of the changes on the command line that change the model of a rig.
pub fn by_hand(changes: &Changes) -> Vec<String> {
    let names = changes.settings.iter().map(|(name, _)| name);
    let mut all: Vec<String> = names.filter(|name| is_of_model(name)).cloned().collect();
    all.extend(changes.tip.map(|_| "--tip".to_owned()));
    all.extend(changes.guidewire_tip.map(|_| "--guidewire-tip".to_owned()));
    all
}

/// Applies everything that a settings file holds except its band. `Err` names the setting and says
/// what is wrong.
pub fn set_all(options: &mut ImageOptions, file: &SettingsFile) -> Result<(), String> {
    options.master = file.master;
    file.set.iter().try_for_each(|(name, setting)| options.set(name, setting.value()))
}

/// The device image of a bundle with these changes.
pub fn image(
    ui: &Ui,
    bundle: &Bundle,
    changes: &Changes,
) -> Result<(Vec<u8>, ImageReport), Failure> {
    image_with(ui, bundle, &options(ui, bundle, changes)?)
}

/// The device image of a bundle with these options.
pub fn image_with(
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

/// Prints a warning unless it was printed before: a command may build several images of one vessel.
fn warn_once(ui: &Ui, message: String) {
    static SAID: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    let mut said = SAID.lock().unwrap_or_else(PoisonError::into_inner);
    if !said.contains(&message) {
        ui.warn(&message);
        said.insert(message);
    }
}

/// The model of a bundle's rig with these options.
pub fn described(bundle: &Bundle, options: &ImageOptions) -> Result<Description<f32>, Failure> {
    rig_description(bundle, options).map_err(|error| no_image(bundle, error))
}

/// Refuses a rig that no device could compute, before an image of it is wanted.
pub fn check_model(bundle: &Bundle) -> Result<(), Failure> {
    if bundle.catheter().is_none() {
        return Ok(());
    }
    let description = described(bundle, &ImageOptions::default())?;
    check_rig(bundle, &description).map_err(|error| no_image(bundle, error))
}

fn no_image(bundle: &Bundle, error: ImageBuildError) -> Failure {
    match error {
        // This error names its file itself.
        ImageBuildError::Bundle(error) => error.into(),
        ImageBuildError::Parameter { key, value, error } => {
            Failure::new(Code::Usage, format!("--set {key}={value}: {error}"))
        }
        error => Failure::input(format!("{}: {error}", bundle.path.display())),
    }
}
