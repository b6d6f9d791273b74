//! `cathforce config`.

use std::collections::BTreeMap;

use cathforce_config::{SETTINGS, SettingInfo, image::decode};
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
    let json = SETTINGS
        .iter()
        .map(|s| {
            json!({
                "name": s.name, "unit": s.unit, "min": s.min, "max": s.max, "default": s.default,
                "whole": s.whole, "while_armed": s.while_armed, "doc": s.doc,
            })
        })
        .collect::<Vec<_>>();
    let text: String = SETTINGS
        .iter()
        .map(|s| {
            let armed = if s.while_armed { "" } else { " Not while armed." };
            format!("{}\n  {}\n  {}{armed}\n", ui.bold(s.name), range(s), s.doc)
        })
        .collect();
    ui.data(&json, text)
}

fn range(s: &SettingInfo) -> String {
    let unit = if s.unit == "1" { String::new() } else { format!(" {}", s.unit) };
    format!("{}{unit}, from {} to {}", s.default, s.min, s.max)
}

fn show(ui: &Ui, arguments: &ConfigShowArguments) -> Result<(), Failure> {
    let bundle = open_bundle(ui, &arguments.bundle)?;
    let (bytes, report) = image(ui, &bundle, &arguments.settings)?;
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
    let (bytes, report) = image(ui, &bundle, &arguments.settings)?;
    std::fs::write(&arguments.out, &bytes).map_err(|e| Failure::write(&arguments.out, e))?;
    let path = arguments.out.display().to_string();
    ui.data(
        &json!({ "path": path, "bytes": report.bytes }),
        format_args!("{path}: {} bytes\n", report.bytes),
    )
}
