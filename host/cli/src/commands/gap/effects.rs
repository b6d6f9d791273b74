//! `cathforce gap effects`.

use std::fmt::Write as _;

use cathforce_effects::{Channel, Effect, Parameter, Plant, Role, all};
use serde::Serialize;

use crate::failure::Failure;
use crate::ui::Ui;

#[derive(Serialize)]
struct Row {
    id: &'static str,
    plant: Plant,
    doc: &'static str,
    parameters: Vec<ParameterRow>,
    channels: &'static [Channel],
    excited_by: &'static str,
    confused_with: &'static [&'static str],
    starts: Vec<Vec<f64>>,
}

#[derive(Serialize)]
struct ParameterRow {
    name: &'static str,
    /// As `--set` takes it; not for a drive on its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    setting: Option<&'static str>,
    unit: &'static str,
    /// Null where rig.toml states it.
    off: Option<f64>,
    min: f64,
    max: f64,
    prior_scale: f64,
    role: Role,
    doc: &'static str,
}

pub fn list(ui: &Ui) -> Result<(), Failure> {
    let rows = all().map(row).collect::<Vec<_>>();
    let text = rows.iter().map(|row| describe(ui, row)).collect::<Vec<_>>().join("\n");
    ui.data(&rows, text)
}

fn row(effect: &'static Effect) -> Row {
    let Effect { id, plant, doc, parameters, channels, excited_by, confused_with, .. } = *effect;
    let starts = effect.starts();
    let parameters = parameters.iter().map(|parameter| parameter_row(plant, parameter)).collect();
    Row { id, plant, doc, parameters, channels, excited_by, confused_with, starts }
}

fn parameter_row(plant: Plant, parameter: &Parameter) -> ParameterRow {
    let info = parameter.info();
    ParameterRow {
        name: parameter.name,
        setting: (plant == Plant::Catheter).then_some(info.key),
        unit: info.unit,
        off: info.off,
        min: info.min,
        max: info.max,
        prior_scale: parameter.prior_scale,
        role: parameter.role,
        doc: info.doc,
    }
}

fn describe(ui: &Ui, row: &Row) -> String {
    let mut text = format!("{}\n  {}\n", ui.bold(row.id), row.doc);
    // Writing into a string cannot fail.
    let _ = writeln!(text, "  shows in trials with {}", row.excited_by);
    let _ = writeln!(text, "  easily mistaken for {}", row.confused_with.join(", "));
    for p in &row.parameters {
        let unit = if p.unit == "1" { String::new() } else { format!(" {}", p.unit) };
        let off = p.off.map_or("as in rig.toml".to_owned(), |off| format!("{off}{unit}"));
        let held = if p.role == Role::Held { "; held in a fit" } else { "" };
        let name = p.setting.unwrap_or(p.name);
        let _ = writeln!(
            text,
            "  {name}: off at {off}, from {} to {}{unit}, typically ±{}{unit}{held}\n    {}",
            p.min, p.max, p.prior_scale, p.doc
        );
    }
    text
}
