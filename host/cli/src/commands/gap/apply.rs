//! `cathforce gap apply`: diagnosed effects become settings, in a file, on a device, or both.
//!
//! Nothing is half applied: the device takes an image whole or not at all and is asked which one
//! it uses; the file takes its place in one step, after the device has answered.

use std::collections::BTreeSet;

use cathforce_bundle::{Bundle, ImageOptions, SolverDefaults, to_description};
use cathforce_bus::service::crc32;
use cathforce_config::ImageError;
use cathforce_effect_catalogue::Effect;
use cathforce_gap::Coverage;
use cathforce_gap::report::{Estimate, Verdict};
use cathforce_link::Client;
use cathforce_mechanics::{Description, ParameterInfo, parameters};
use serde::Serialize;

use super::band_text::half_width;
use super::diagnose::Search;
use super::explanation::{Explanation, Fitted, is_measurement};
use super::source::Source;
use crate::args::ApplyArguments;
use crate::failure::{Code, Failure};
use crate::session::{Pace, configure};
use crate::settings::band::StatedBand;
use crate::settings::{Setting, SettingsFile, replaceable};
use crate::ui::Ui;

/// What was done, or would be.
#[derive(Serialize)]
struct Applied {
    rig: String,
    dry_run: bool,
    changes: Vec<Change>,
    /// Null where the band stays what it is.
    band_change: Option<BandChange>,
    /// How far the device will say that its forces may be off, and how many of those that were held
    /// out lie within.
    band: Option<Coverage>,
    /// Path of the settings file.
    settings: Option<String>,
    device: Option<DeviceUse>,
    notes: Vec<String>,
}

/// One setting.
#[derive(Serialize)]
struct Change {
    key: &'static str,
    old: f32,
    new: f32,
    /// The new value with as many digits as its interval warrants.
    #[serde(skip)]
    new_text: String,
    unit: &'static str,
    origin: String,
}

/// The largest half widths of the settings' band; null where there is none.
#[derive(Serialize)]
struct BandChange {
    #[serde(rename = "old_widest_N")]
    old_n: Option<f64>,
    #[serde(rename = "new_widest_N")]
    new_n: Option<f64>,
}

impl BandChange {
    fn of(old: &SettingsFile, new: &SettingsFile) -> Option<Self> {
        let widest = |file: &SettingsFile| file.band.as_ref().and_then(StatedBand::widest_n);
        (old.band != new.band).then(|| Self { old_n: widest(old), new_n: widest(new) })
    }

    fn text(&self) -> String {
        let widest =
            |n: Option<f64>| n.map_or("none".to_owned(), |n| format!("up to ±{}", half_width(n)));
        let (old, new) = (widest(self.old_n), widest(self.new_n));
        let other = if old == new { "; its rows change, or its model" } else { "" };
        format!("band of the forces: {old} -> {new}{other}")
    }
}

/// What the device says that it uses.
#[derive(Serialize)]
struct DeviceUse {
    link: String,
    board: String,
    firmware: String,
    image_crc32: String,
}

pub fn run(ui: &Ui, arguments: &ApplyArguments) -> Result<(), Failure> {
    if arguments.settings.is_none() && arguments.link.is_none() && !arguments.dry_run {
        let message = "there is nothing to apply the settings to: give --settings FILE.toml, --link or --dry-run";
        return Err(Failure::new(Code::Usage, message));
    }
    if let Some(path) = arguments.settings.as_ref().filter(|_| !arguments.dry_run) {
        // Said now: a fit takes minutes.
        replaceable(path)?;
    }
    let effects = &arguments.source.effects;
    let effects = super::names::effects(effects.iter().map(String::as_str))?;
    let source = Source::open_all(ui, &arguments.bundle)?;
    let bundle = &source.bundle;
    let old = known(arguments, bundle)?;
    let explanation = match &arguments.source.diagnosis {
        Some(file) => {
            let explanation = Explanation::read(file)?;
            explanation.check_source(&source)?;
            explanation
        }
        None => {
            let again = Source::open_all(ui, &arguments.bundle)?;
            Explanation::of(
                &Search { effects: &effects, ..Search::default() }.answer(ui, again, None)?,
            )?
        }
    };
    let fitted =
        if arguments.band_only { only_band(&explanation)? } else { explanation.fitted()? };
    let band = stated_band(bundle, &explanation, &fitted)?;
    let new = SettingsFile { band, ..with(&old, &fitted) };
    let mut options = image_options(&new)?;
    let description = described(bundle, &new)?;
    options.band =
        new.band.as_ref().and_then(|band| band.for_model(ui, &description, &new.by_hand()));
    let changes = differences(bundle, &old, &new, &fitted)?;
    let mut applied = Applied {
        rig: bundle.rig.name.clone(),
        dry_run: arguments.dry_run,
        changes,
        band_change: BandChange::of(&old, &new),
        band: explanation.coverage().filter(|_| options.band.is_some()),
        settings: None,
        device: None,
        notes: notes(&explanation, &fitted),
    };
    if new.band.is_some() && options.band.is_none() {
        let note =
            "the device states no error band, because other settings make its model another one";
        applied.notes.push(note.to_owned());
    }
    if !arguments.dry_run {
        let staged = arguments.settings.as_ref().map(|path| new.write(path)).transpose()?;
        if let Some(link) = &arguments.link {
            let image = source.image(ui, &options, &description)?;
            applied.device = Some(push(ui, link, &image)?);
        }
        if let Some(staged) = staged {
            staged.commit()?;
        }
        applied.settings = arguments.settings.as_ref().map(|path| path.display().to_string());
    }
    ui.data(&applied, applied.text(ui))
}

/// No effect, where the verdict names none: else the band would be that of a model with effects.
fn only_band(explanation: &Explanation) -> Result<Vec<Fitted>, Failure> {
    if !explanation.is_nominal() {
        let message = "the error band belongs to the model with the effects that the diagnosis \
                       names: apply the effects too, without --band-only";
        return Err(Failure::new(Code::Usage, message));
    }
    if explanation.coverage().is_none() {
        let message = "the diagnosis has no error band: it had no measured forces to hold out";
        return Err(Failure::new(Code::Failed, message));
    }
    Ok(Vec::new())
}

/// What the diagnosis says of how far the forces may be off, and of which model: the rig as
/// rig.toml states it, with these effects.
pub fn stated_band(
    bundle: &Bundle,
    explanation: &Explanation,
    fitted: &[Fitted],
) -> Result<Option<StatedBand>, Failure> {
    let Some(band) = explanation.band()? else { return Ok(None) };
    let nothing = SettingsFile::default();
    let description = described(bundle, &with(&nothing, fitted))?;
    Ok(Some(StatedBand::new(band, &description)))
}

/// The settings that are there already.
fn known(arguments: &ApplyArguments, bundle: &Bundle) -> Result<SettingsFile, Failure> {
    match arguments.settings.as_ref().filter(|path| path.exists()) {
        Some(path) => {
            let file = SettingsFile::read(path)?;
            file.check_rig(path, &bundle.rig.name)?;
            Ok(file)
        }
        None => Ok(SettingsFile { rig: bundle.rig.name.clone(), ..SettingsFile::default() }),
    }
}

/// The settings with these effects. A diagnosis starts from rig.toml alone, so effects that an
/// earlier one had switched on are not added to.
fn with(old: &SettingsFile, fitted: &[Fitted]) -> SettingsFile {
    let mut new = old.clone();
    new.set.retain(|_, setting| matches!(setting, Setting::ByHand(_)));
    for own in fitted {
        let effect = own.effect.id.to_owned();
        new.set.insert(own.key.to_owned(), Setting::Diagnosed { value: own.value, effect });
    }
    new
}

fn image_options(settings: &SettingsFile) -> Result<ImageOptions, Failure> {
    let mut options = ImageOptions::default();
    crate::image::set_all(&mut options, settings).map_err(Failure::input)?;
    Ok(options)
}

/// The description that a device gets; refuses what has no catheter's trial.
pub fn described(bundle: &Bundle, settings: &SettingsFile) -> Result<Description<f32>, Failure> {
    let missing = || {
        let message = "no catheter's trial is in the bundle, so there is nothing to configure";
        Failure::input(format!("{}: {message}", bundle.path.display()))
    };
    let mut description =
        to_description::<f32>(bundle, &SolverDefaults::default()).ok_or_else(missing)?;
    for (key, value) in &image_options(settings)?.parameters {
        description.set_parameter(key, *value).map_err(Failure::input)?;
    }
    description.validate().map_err(|e| Failure::input(ImageError::Description(e)))?;
    Ok(description)
}

fn differences(
    bundle: &Bundle,
    old: &SettingsFile,
    new: &SettingsFile,
    fitted: &[Fitted],
) -> Result<Vec<Change>, Failure> {
    let (before, after) = (described(bundle, old)?, described(bundle, new)?);
    let change = |info: &'static ParameterInfo| {
        let (old, new) = (before.parameter(info.key)?, after.parameter(info.key)?);
        let (new_text, origin) = match fitted.iter().find(|own| own.key == info.key) {
            Some(Fitted { effect, value, low, high, .. }) => {
                let (value, low, high, unit) = (f64::from(*value), *low, *high, info.unit);
                let [value, low, high] = Estimate { value, low, high, unit, off: value }.digits();
                let what = if is_measurement(effect) { "; expected reading only" } else { "" };
                (value, format!("{}, 90 %: {low} to {high}{what}", effect.id))
            }
            None => {
                let origin = "rig.toml; an earlier diagnosis had switched it on";
                (new.to_string(), origin.to_owned())
            }
        };
        let unit = info.unit;
        (old != new).then_some(Change { key: info.key, old, new, new_text, unit, origin })
    };
    Ok(parameters().filter_map(change).collect())
}

/// What must be known before it is relied on.
fn notes(explanation: &Explanation, fitted: &[Fitted]) -> Vec<String> {
    let mut notes = Vec::new();
    if explanation.verdict == Verdict::Partial {
        notes.push("the verdict is `partial`: what is left of the gap is none of these".to_owned());
    }
    for set in &explanation.confusable {
        notes.push(format!("cannot be told apart on the diagnosed data: {}", set.join(", ")));
    }
    let read: BTreeSet<&str> =
        fitted.iter().map(|own| own.effect).filter(|e| is_measurement(e)).map(id).collect();
    for id in read {
        notes.push(format!(
            "{id} changes what the sensor is expected to read, not what the device renders; mend \
             the sensor"
        ));
    }
    notes
}

fn id(effect: &Effect) -> &str {
    effect.id
}

/// Gives the device the image and asks it which one it uses.
fn push(ui: &Ui, link: &str, image: &[u8]) -> Result<DeviceUse, Failure> {
    let mut client = Client::connect(cathforce_link::open(link)?)?;
    configure(ui, &mut client, image, Pace::LockStep)?;
    let device = client.device();
    Ok(DeviceUse {
        link: link.to_owned(),
        board: device.board.clone(),
        firmware: device.firmware.clone(),
        image_crc32: format!("{:08x}", crc32(image)),
    })
}

impl Applied {
    fn text(&self, ui: &Ui) -> String {
        let mut text = format!("{}\n", ui.bold(&self.rig));
        if self.changes.is_empty() && self.band_change.is_none() {
            text += "nothing changes: it is configured like that already\n";
        }
        for Change { key, old, new_text, unit, origin, .. } in &self.changes {
            let unit = if *unit == "1" { String::new() } else { format!(" {unit}") };
            text += &format!("  {key}: {old} -> {new_text}{unit}  ({origin})\n");
        }
        if let Some(change) = &self.band_change {
            text += &format!("  {}\n", change.text());
        }
        if let Some(coverage) = &self.band {
            let (within, stated) =
                (super::band_text::text(coverage), super::band_text::stated(coverage));
            text +=
                &format!("  the device says how far its forces may be off: {within}; {stated}\n");
        }
        for note in &self.notes {
            text += &format!("  note: {note}\n");
        }
        if self.dry_run {
            text += "dry run: nothing was changed\n";
        }
        if let Some(DeviceUse { link, board, image_crc32, .. }) = &self.device {
            text += &format!("device {board} ({link}): uses the image of CRC {image_crc32}\n");
        }
        if let Some(settings) = &self.settings {
            text += &format!("settings: {settings}\n");
        }
        text
    }
}
