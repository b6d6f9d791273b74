//! `cathforce config`.

use std::collections::BTreeMap;

use cathforce_config::{SETTINGS, SettingInfo, image::decode};
use cathforce_mechanics::{ParameterInfo, parameters};
use serde_json::json;

use super::{image, open_bundle};
use crate::args::{ConfigAction, ConfigArguments, ConfigImageArguments, ConfigShowArguments};
use crate::failure::Failure;
use crate::ui::{Ui, two_columns};

pub fn run(ui: &Ui, arguments: &ConfigArguments) -> Result<(), Failure> {
    match &arguments.action {
        None => list(ui),
        Some(ConfigAction::Show(arguments)) => show(ui, arguments),
        Some(ConfigAction::Image(arguments)) => write_image(ui, arguments),
    }
}

fn list(ui: &Ui) -> Result<(), Failure> {
    let settings = SETTINGS.iter().map(|s| {
        json!({
            "name": s.name, "unit": s.unit, "min": s.min, "max": s.max, "default": s.default,
            "whole": s.whole, "while_armed": s.while_armed, "doc": s.doc,
        })
    });
    // What a rig is told, not its operator: `default` is the value that changes nothing, null
    // for what rig.toml states.
    let described = parameters().map(|p| {
        json!({
            "name": p.key, "unit": p.unit, "min": p.min, "max": p.max, "default": p.off,
            "whole": false, "while_armed": false, "doc": p.doc,
        })
    });
    let json = settings.chain(described).collect::<Vec<_>>();
    let mut text = String::new();
    for s in SETTINGS {
        let armed = if s.while_armed { "" } else { " Not while armed." };
        text += &format!("{}\n  {}\n  {}{armed}\n", ui.bold(s.name), range(s), s.doc);
    }
    text +=
        "\nOf the rig and its effects (`cathforce gap effects` says more); not while armed:\n\n";
    for p in parameters() {
        text += &format!("{}\n  {}\n  {}\n", ui.bold(p.key), parameter_range(p), p.doc);
    }
    ui.data(&json, text)
}

fn parameter_range(p: &ParameterInfo) -> String {
    let unit = if p.unit == "1" { String::new() } else { format!(" {}", p.unit) };
    let off = p.off.map_or("as in rig.toml".to_owned(), |off| format!("{off}{unit}"));
    format!("{off}, from {} to {}{unit}", p.min, p.max)
}

fn range(s: &SettingInfo) -> String {
    let unit = if s.unit == "1" { String::new() } else { format!(" {}", s.unit) };
    format!("{}{unit}, from {} to {}", s.default, s.min, s.max)
}

fn show(ui: &Ui, arguments: &ConfigShowArguments) -> Result<(), Failure> {
    let bundle = open_bundle(ui, &arguments.bundle)?;
    let (bytes, report) = image(ui, &bundle, &arguments.changes)?;
    let config = decode(&bytes).map_err(Failure::input)?;
    let settings: BTreeMap<_, _> =
        config.settings.iter().map(|(info, value)| (info.name, value)).collect();
    let json = json!({
        "rig": bundle.rig.name,
        "image_bytes": report.bytes,
        "link_length_m": report.link_length_m,
        "reach_m": report.reach_m,
        "lumen_bytes": report.lumen.bytes,
        "lumen_cell_m": report.lumen.cell_m,
        "description": serde_json::to_value(config.model.description()).unwrap_or_default(),
        "settings": settings,
    });
    let mut rows = vec![
        ("rig".to_owned(), bundle.rig.name.clone()),
        ("image".to_owned(), format!("{} bytes", report.bytes)),
        ("link length".to_owned(), format!("{:.3} mm", 1e3 * report.link_length_m)),
        ("reach".to_owned(), format!("{:.1} mm", 1e3 * report.reach_m)),
        (
            "lumen".to_owned(),
            format!("{} bytes, grid of {:.2} mm", report.lumen.bytes, 1e3 * report.lumen.cell_m),
        ),
    ];
    for (info, value) in config.settings.iter() {
        let unit = if info.unit == "1" { "" } else { info.unit };
        rows.push((info.name.to_owned(), format!("{value} {unit}").trim_end().to_owned()));
    }
    ui.data(&json, two_columns(&rows))
}

fn write_image(ui: &Ui, arguments: &ConfigImageArguments) -> Result<(), Failure> {
    let bundle = open_bundle(ui, &arguments.bundle)?;
    let (bytes, report) = image(ui, &bundle, &arguments.changes)?;
    std::fs::write(&arguments.out, &bytes).map_err(|e| Failure::write(&arguments.out, e))?;
    let path = arguments.out.display().to_string();
    ui.data(
        &json!({ "path": path, "bytes": report.bytes }),
        format_args!("{path}: {} bytes\n", report.bytes),
    )
}
