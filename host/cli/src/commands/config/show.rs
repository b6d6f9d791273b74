//! `cathforce config show` and `cathforce config get`.

use std::path::{Path, PathBuf};

use cathforce_bundle::ImageReport;
use cathforce_config::{ImageHead, Key, keys};
use cathforce_link::Client;
use serde_json::{Map, Value, json};

use super::values::{head_of, head_on, values};
use crate::args::{Changes, ConfigGetArguments, ConfigShowArguments};
use crate::failure::{Code, Failure};
use crate::image::image;
use crate::open::open_bundle;
use crate::settings::entry::misspelt;
use crate::settings::units::unit;
use crate::settings::{Setting, SettingsFile, parse_file};
use crate::ui::{Ui, two_columns};

/// Why a device has no values to show, and what to do.
pub const NOT_CONFIGURED: &str = "the device has no configuration\n  fix: `cathforce config apply BUNDLE FILE.toml --link LINK` \
     gives it one";

/// The head of an image: of a device's, or of the one that is built from a bundle.
struct Source {
    head: ImageHead,
    /// Name of the rig, and what was built.
    built: Option<(String, ImageReport)>,
}

impl Source {
    fn device(link: &str) -> Result<Self, Failure> {
        let mut client = Client::connect(cathforce_link::open(link)?)?;
        let head = head_on(&mut client)?;
        let head = head.ok_or_else(|| Failure::new(Code::Device, NOT_CONFIGURED))?;
        Ok(Self { head, built: None })
    }

    fn bundle(ui: &Ui, path: &Path, changes: &Changes) -> Result<Self, Failure> {
        let bundle = open_bundle(ui, path)?;
        let (bytes, report) = image(ui, &bundle, changes)?;
        Ok(Self { head: head_of(&bytes)?, built: Some((bundle.rig.name, report)) })
    }

    /// The argument parser asks for one of the two.
    fn open(
        ui: &Ui,
        bundle: Option<&PathBuf>,
        link: Option<&String>,
        changes: &Changes,
    ) -> Result<Self, Failure> {
        match link {
            Some(link) => Self::device(link),
            None => Self::bundle(ui, bundle.map_or(Path::new("."), PathBuf::as_path), changes),
        }
    }

    /// The numbers of the image that was built.
    fn report(&self) -> (Map<String, Value>, Vec<(String, String)>) {
        let Some((rig, report)) = &self.built else { return Default::default() };
        let (bytes, cell_mm) = (report.lumen.bytes, 1e3 * report.lumen.cell_m);
        let link_mm = 1e3 * report.link_length_m;
        let rows = [
            ("rig", rig.clone()),
            ("image", format!("{} bytes", report.bytes)),
            ("link length", format!("{link_mm:.3} mm along the shaft")),
            ("reach", format!("{:.1} mm", 1e3 * report.reach_m)),
            ("lumen", format!("{bytes} bytes, grid of {cell_mm:.2} mm")),
        ];
        let json = [
            ("rig", json!(rig)),
            ("image_bytes", json!(report.bytes)),
            ("link_length_m", json!(report.link_length_m)),
            ("reach_m", json!(report.reach_m)),
            ("lumen_bytes", json!(report.lumen.bytes)),
            ("lumen_cell_m", json!(report.lumen.cell_m)),
        ];
        let json = json.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        (json, rows.into_iter().map(|(label, text)| (label.to_owned(), text)).collect())
    }
}

pub fn show(ui: &Ui, arguments: &ConfigShowArguments) -> Result<(), Failure> {
    arguments.json_file.check()?;
    let (bundle, link) = (arguments.source.bundle.as_ref(), arguments.source.link.as_ref());
    let source = Source::open(ui, bundle, link, &arguments.changes)?;
    let values = values(&source.head);
    let origins = arguments.origin.then(|| origins(arguments)).transpose()?;
    let (mut json, mut rows) = source.report();
    json.insert(
        "description".into(),
        serde_json::to_value(&source.head.description).unwrap_or_default(),
    );
    let (mut settings, mut said) = (Map::new(), Map::new());
    for key in keys() {
        let Some(value) = values.get(key.name()) else { continue };
        if matches!(key, Key::Setting(_)) {
            settings.insert(key.name().into(), json!(value));
        }
        let mut text = format!("{value}{}", unit(key));
        if let Some(origins) = &origins {
            let origin = origin(origins, key, *value);
            text += &format!("  ({origin})");
            said.insert(key.name().into(), json!(origin));
        }
        // An effect that is off would only be noise.
        let is_off = matches!(key, Key::Parameter(_)) && key.default() == Some(*value);
        if !is_off || origins.is_some() {
            rows.push((key.name().to_owned(), text));
        }
    }
    json.insert("settings".into(), Value::Object(settings));
    if origins.is_some() {
        json.insert("origin".into(), Value::Object(said));
    }
    arguments.json_file.write(ui, &json, two_columns(&rows))
}

/// The names that were set with the place where they were set, in this order.
fn origins(arguments: &ConfigShowArguments) -> Result<Vec<(String, String)>, Failure> {
    let mut origins = Vec::new();
    if let Some(link) = &arguments.source.link {
        origins.extend(keys().map(|key| (key.name().to_owned(), format!("device {link}"))));
    }
    if let Some(path) = &arguments.changes.file {
        for entry in parse_file(path)?.entries {
            let effect = match &entry.setting {
                Setting::Diagnosed { effect, .. } => format!(", {effect}"),
                Setting::ByHand(_) => String::new(),
            };
            origins.push((entry.name, format!("{}:{}{effect}", path.display(), entry.line)));
        }
    }
    let given = arguments.changes.settings.iter();
    origins.extend(given.map(|(name, _)| (name.clone(), "--set".to_owned())));
    Ok(origins)
}

/// The last place where a value was set; a value that was set nowhere comes from the bundle or is
/// the default.
fn origin(origins: &[(String, String)], key: Key, value: f32) -> String {
    let last = origins.iter().rev().find(|(name, _)| name == key.name());
    match (last, key.default()) {
        (Some((_, origin)), _) => origin.clone(),
        (None, Some(default)) if default == value => "default".into(),
        (None, _) => "bundle".into(),
    }
}

pub fn get(ui: &Ui, arguments: &ConfigGetArguments) -> Result<(), Failure> {
    let (source, name) = arguments.source_and_name();
    let Some(key) = Key::find(&name) else {
        let names = keys().map(Key::name).collect::<Vec<_>>();
        let fix = misspelt(&name, &names, "`cathforce config list` lists the names");
        let message = format!("there is no setting `{name}`\n  fix: {fix}");
        return Err(Failure::new(Code::Usage, message));
    };
    let value = match &source {
        Some(file) if file.is_file() => {
            let file = SettingsFile::read(file)?;
            file.set.get(key.name()).map(Setting::value).or(key.default())
        }
        bundle => {
            let link = arguments.link.as_ref();
            let Source { head, .. } = Source::open(ui, bundle.as_ref(), link, &arguments.changes)?;
            key.value(&head.description, &head.settings)
        }
    };
    let text = value.map_or("from rig.toml".to_owned(), |value| value.to_string());
    let json = json!({ "name": key.name(), "value": value, "unit": key.unit() });
    ui.data(&json, format_args!("{text}\n"))
}
