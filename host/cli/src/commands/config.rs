//! `cathforce config`.

mod device;
mod file;
#[cfg(feature = "hardware")]
mod import_dbc;
mod schema;
mod values;

use std::path::Path;

use cathforce_bundle::ImageReport;
use cathforce_config::{ImageHead, Key, keys};
use cathforce_link::Client;
use serde_json::{Value, json};

#[cfg(not(feature = "hardware"))]
use super::left_out::import_dbc;
use super::{image, open_bundle};
use crate::args::{
    Changes, ConfigAction, ConfigArguments, ConfigGetArguments, ConfigImageArguments,
    ConfigShowArguments, ConfigSource,
};
use crate::failure::{Code, Failure};
use crate::output::{Kind, check_again, write_again};
use crate::settings::parse::{misspelt, unit};
use crate::settings::{Setting, SettingsFile, parse_file};
use crate::ui::{Ui, two_columns};
use values::{head_of, head_on, values};

/// No setting changes while output is armed (P17): the device refuses it. So a recording has one
/// configuration from its first tick to its last, and replays bit by bit.
const WHILE_ARMED: bool = false;

pub fn run(ui: &Ui, arguments: &ConfigArguments) -> Result<(), Failure> {
    match &arguments.action {
        None => list(ui),
        Some(ConfigAction::Init(arguments)) => file::init(ui, arguments),
        Some(ConfigAction::Show(arguments)) => show(ui, arguments),
        Some(ConfigAction::Get(arguments)) => get(ui, arguments),
        Some(ConfigAction::Set(arguments)) => file::set(ui, arguments),
        Some(ConfigAction::Diff(arguments)) => file::diff(ui, arguments),
        Some(ConfigAction::Validate(arguments)) => file::validate(ui, arguments),
        Some(ConfigAction::Apply(arguments)) => device::apply(ui, arguments, false),
        Some(ConfigAction::Save(arguments)) => device::save(ui, arguments),
        Some(ConfigAction::Restore(arguments)) => device::apply(ui, arguments, true),
        Some(ConfigAction::ImportDbc(arguments)) => import_dbc::run(ui, arguments),
        Some(ConfigAction::Schema(arguments)) => match arguments.markdown {
            true => ui.data(&schema::markdown(), schema::markdown()),
            false => {
                let schema = schema::json();
                ui.data(&schema, format_args!("{schema:#}\n"))
            }
        },
        Some(ConfigAction::Image(arguments)) => write_image(ui, arguments),
    }
}

fn list(ui: &Ui) -> Result<(), Failure> {
    let described = keys().map(|key| {
        let [min, max] = key.range();
        json!({
            "name": key.name(), "unit": key.unit(), "min": min, "max": max,
            // Null for what rig.toml states.
            "default": key.default(), "whole": key.is_whole(),
            "while_armed": WHILE_ARMED, "doc": key.doc(),
        })
    });
    let json = described.collect::<Vec<_>>();
    let mut text = String::new();
    let mut of_rig = false;
    for key in keys() {
        if matches!(key, Key::Parameter(_)) && !of_rig {
            of_rig = true;
            text += "\nOf the rig and its effects (`cathforce gap effects` says more):\n\n";
        }
        let [min, max] = key.range();
        let unit = unit(key);
        let default = match key.default() {
            Some(default) => format!("{default}{unit}"),
            None => "as in rig.toml".to_owned(),
        };
        let name = ui.bold(key.name());
        text += &format!("{name}\n  {default}, from {min} to {max}{unit}\n  {}\n", key.doc());
    }
    text += "\nNone of them changes while output is armed: disarm, apply, arm again.\n";
    ui.data(&json, text)
}

/// The head of the image that a bundle gives or a device uses.
fn head(
    ui: &Ui,
    source: &ConfigSource,
    changes: &Changes,
) -> Result<(ImageHead, Option<(String, ImageReport)>), Failure> {
    if let Some(link) = &source.link {
        let mut client = Client::connect(cathforce_link::open(link)?)?;
        let missing = "the device has no configuration; `cathforce config apply` gives it one";
        let head = head_on(&mut client)?;
        return Ok((head.ok_or_else(|| Failure::new(Code::Device, missing))?, None));
    }
    // The argument parser asks for one of the two.
    let path = source.bundle.as_deref().unwrap_or(Path::new("."));
    let bundle = open_bundle(ui, path)?;
    let (bytes, report) = image(ui, &bundle, changes)?;
    Ok((head_of(&bytes)?, Some((bundle.rig.name, report))))
}

fn show(ui: &Ui, arguments: &ConfigShowArguments) -> Result<(), Failure> {
    let (head, built) = head(ui, &arguments.source, &arguments.changes)?;
    let values = values(&head);
    let origins = match arguments.origin {
        true => Some(origins(arguments)?),
        false => None,
    };
    let mut json = json!({
        "description": serde_json::to_value(&head.description).unwrap_or_default(),
        "settings": keys()
            .filter(|key| matches!(key, Key::Setting(_)))
            .filter_map(|key| Some((key.name().to_owned(), json!(values.get(key.name())?))))
            .collect::<serde_json::Map<String, Value>>(),
    });
    let mut rows = Vec::new();
    if let Some((rig, report)) = built {
        json["rig"] = json!(rig);
        json["image_bytes"] = json!(report.bytes);
        json["link_length_m"] = json!(report.link_length_m);
        json["reach_m"] = json!(report.reach_m);
        json["lumen_bytes"] = json!(report.lumen.bytes);
        json["lumen_cell_m"] = json!(report.lumen.cell_m);
        let (bytes, cell_mm) = (report.lumen.bytes, 1e3 * report.lumen.cell_m);
        let link_mm = 1e3 * report.link_length_m;
        rows.extend([
            ("rig".to_owned(), rig),
            ("image".to_owned(), format!("{} bytes", report.bytes)),
            ("link length".to_owned(), format!("{link_mm:.3} mm along the shaft")),
            ("reach".to_owned(), format!("{:.1} mm", 1e3 * report.reach_m)),
            ("lumen".to_owned(), format!("{bytes} bytes, grid of {cell_mm:.2} mm")),
        ]);
    }
    let mut said = serde_json::Map::new();
    for key in keys() {
        let Some(value) = values.get(key.name()) else { continue };
        let mut text = format!("{value}{}", unit(key));
        if let Some(origins) = &origins {
            let origin = origin(origins, key, *value);
            text += &format!("  ({origin})");
            said.insert(key.name().into(), json!(origin));
        }
        // What is off says nothing.
        let is_off = matches!(key, Key::Parameter(_)) && key.default() == Some(*value);
        if !is_off || origins.is_some() {
            rows.push((key.name().to_owned(), text));
        }
    }
    if origins.is_some() {
        json["origin"] = Value::Object(said);
    }
    ui.data(&json, two_columns(&rows))
}

/// Who has set what, in the order in which they did.
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

/// Who says so last; a value that nobody has set comes from the bundle or is the default.
fn origin(origins: &[(String, String)], key: Key, value: f32) -> String {
    let last = origins.iter().rev().find(|(name, _)| name == key.name());
    match (last, key.default()) {
        (Some((_, origin)), _) => origin.clone(),
        (None, Some(default)) if default == value => "default".into(),
        (None, _) => "bundle".into(),
    }
}

fn get(ui: &Ui, arguments: &ConfigGetArguments) -> Result<(), Failure> {
    let Some(key) = Key::find(&arguments.name) else {
        let names = keys().map(Key::name).collect::<Vec<_>>();
        let fix = match Path::new(&arguments.name).exists() {
            true => "the name of a setting comes first, then where to look".to_owned(),
            false => misspelt(&arguments.name, &names, "`cathforce config` lists the names"),
        };
        let message = format!("there is no setting `{}`: {fix}", arguments.name);
        return Err(Failure::new(Code::Usage, message));
    };
    let (bundle, link) = (arguments.bundle.clone(), arguments.link.clone());
    let value = match bundle {
        Some(file) if file.is_file() => {
            let file = SettingsFile::read(&file)?;
            file.set.get(key.name()).map(Setting::value).or(key.default())
        }
        bundle => {
            let (head, _) = head(ui, &ConfigSource { bundle, link }, &arguments.changes)?;
            key.value(&head.description, &head.settings)
        }
    };
    let text = value.map_or("as in rig.toml".to_owned(), |value| value.to_string());
    let json = json!({ "name": key.name(), "value": value, "unit": key.unit() });
    ui.data(&json, format_args!("{text}\n"))
}

fn write_image(ui: &Ui, arguments: &ConfigImageArguments) -> Result<(), Failure> {
    check_again(&arguments.out, Kind::DeviceImage)?;
    let bundle = open_bundle(ui, &arguments.bundle)?;
    let (bytes, report) = image(ui, &bundle, &arguments.changes)?;
    write_again(&arguments.out, Kind::DeviceImage, &bytes)?;
    let path = arguments.out.display().to_string();
    ui.data(
        &json!({ "path": path, "bytes": report.bytes }),
        format_args!("{path}: {} bytes\n", report.bytes),
    )
}
