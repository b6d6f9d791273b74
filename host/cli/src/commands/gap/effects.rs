//! `cathforce gap effects`: those of a catheter, and those of a drive on its own and of a transmission as
//! their diagnoses have them.

use std::fmt::Write as _;

use cathforce_effect_catalogue::{Channel, Effect, Parameter, Plant, Role, all};
use cathforce_gap::{drive, transmission};
use serde::Serialize;

use crate::args::JsonFile;
use crate::failure::Failure;
use crate::ui::Ui;

#[derive(Serialize)]
struct Row {
    id: &'static str,
    plant: Plant,
    doc: &'static str,
    parameters: Vec<ParameterRow>,
    channels: &'static [Channel],
    /// Null of an effect of a drive that a catheter has too.
    excited_by: Option<&'static str>,
    confused_with: &'static [&'static str],
    starts: Vec<Vec<f64>>,
}

#[derive(Serialize)]
struct ParameterRow {
    name: &'static str,
    /// As `--set` takes it; not for a drive on its own or a transmission.
    #[serde(skip_serializing_if = "Option::is_none")]
    setting: Option<&'static str>,
    unit: &'static str,
    /// Null where rig.toml states it.
    off: Option<f64>,
    min: f64,
    max: f64,
    prior_scale: f64,
    /// What off, min, max and prior_scale are multiples of: f the RMS of the command, v the largest
    /// speed, q the travel, t the length of a trial; of a transmission q the travel of the input, p the range
    /// of the output, l the RMS of the load. Null where they are in the unit.
    counted_in: Option<&'static str>,
    role: Role,
    doc: &'static str,
}

pub fn list(ui: &Ui, file: &JsonFile) -> Result<(), Failure> {
    file.check()?;
    let catheter = all().filter(|effect| effect.plant == Plant::Catheter).map(row);
    let of_drive = drive::listed().into_iter().map(|effect| {
        fitted(effect, Plant::Drive, Channel::DriveCommand, &|p| drive::counted_in(p.unit))
    });
    let of_transmission = transmission::listed().into_iter().map(|effect| {
        fitted(effect, Plant::Transmission, Channel::Output, &|p| transmission::counted_in(p.name))
    });
    let rows: Vec<Row> = catheter.chain(of_drive).chain(of_transmission).collect();
    let text = rows.iter().map(|row| describe(ui, row)).collect::<Vec<_>>().join("\n");
    let text = format!(
        "{text}\nOf a drive on its own, f is the RMS of the command, v the largest speed, q the \
         travel and t the length of a trial. Of a transmission, q is the travel of the input, p the range \
         of the output, l the RMS of the load and t the length of a trial; names end in _rad where they are \
         angles.\n"
    );
    file.write(ui, &rows, text)
}

fn row(effect: &'static Effect) -> Row {
    let Effect { id, plant, doc, parameters, channels, excited_by, confused_with, .. } = *effect;
    let starts = effect.starts();
    let parameters = parameters.iter().map(parameter_row).collect();
    let excited_by = Some(excited_by);
    Row { id, plant, doc, parameters, channels, excited_by, confused_with, starts }
}

/// An effect of a drive or a transmission, as its fit has it.
fn fitted(
    effect: cathforce_gap::plant::Effect,
    plant: Plant,
    channel: Channel,
    counted_in: &dyn Fn(&cathforce_gap::plant::Parameter) -> Option<&'static str>,
) -> Row {
    let entry = Effect::find(effect.id).filter(|entry| entry.plant == plant);
    let parameter = |p: &cathforce_gap::plant::Parameter| ParameterRow {
        name: p.name,
        setting: None,
        unit: p.unit,
        off: Some(p.off),
        min: p.low,
        max: p.high,
        prior_scale: p.scale,
        counted_in: counted_in(p),
        role: Role::Value,
        doc: "",
    };
    Row {
        id: effect.id,
        plant,
        doc: effect.what,
        parameters: effect.parameters.iter().map(parameter).collect(),
        channels: match channel {
            Channel::Output => &[Channel::Output],
            _ => &[Channel::DriveCommand],
        },
        excited_by: entry.map(|entry| entry.excited_by),
        confused_with: effect.confused_with,
        starts: effect.starts,
    }
}

fn parameter_row(parameter: &Parameter) -> ParameterRow {
    let info = parameter.info();
    ParameterRow {
        name: parameter.name,
        setting: Some(info.key),
        unit: info.unit,
        off: info.off,
        min: info.min,
        max: info.max,
        prior_scale: parameter.prior_scale,
        counted_in: None,
        role: parameter.role,
        doc: info.doc,
    }
}

/// What a channel measures, in words.
fn measured(channel: Channel) -> &'static str {
    match channel {
        Channel::Force => "force on the vessel",
        Channel::DriveForce => "drive force",
        Channel::Tip => "tip",
        Channel::Shape => "shape",
        Channel::DriveCommand => "command",
        Channel::Output => "output",
    }
}

fn describe(ui: &Ui, row: &Row) -> String {
    let of = match row.plant {
        Plant::Catheter => "",
        Plant::Drive => " of a drive on its own",
        Plant::Transmission => " of a transmission",
    };
    let mut text = format!("{}{of}\n  {}\n", ui.bold(row.id), row.doc);
    let measured: Vec<&str> = row.channels.iter().copied().map(measured).collect();
    // Writing into a string cannot fail.
    let _ = writeln!(text, "  changes the measured {}", measured.join(", "));
    if let Some(excited_by) = row.excited_by {
        let _ = writeln!(text, "  shows in trials with {excited_by}");
    }
    let _ = writeln!(text, "  easily mistaken for {}", row.confused_with.join(", "));
    for p in &row.parameters {
        let unit = p.counted_in.unwrap_or(if p.unit == "1" { "" } else { p.unit });
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        let off = p.off.map_or("as in rig.toml".to_owned(), |off| format!("{off}{unit}"));
        let held = if p.role == Role::Held { "; held in a fit" } else { "" };
        let name = p.setting.unwrap_or(p.name);
        let _ = writeln!(
            text,
            "  {name}: off at {off}, from {} to {}{unit}, typically ±{}{unit}{held}",
            p.min, p.max, p.prior_scale
        );
        if !p.doc.is_empty() {
            let _ = writeln!(text, "    {}", p.doc);
        }
    }
    text
}
