//! From a lab's DBC to the frames in which its drives' positions come.

use std::path::Path;

use can_dbc::{
    ByteOrder, Dbc, Message, MessageId, MultiplexIndicator, Signal as DbcSignal, ValueType,
};
use cathforce_config::master::{Drive, Master, Place, Signal};
use serde_json::json;
use toml_edit::DocumentMut;

use crate::args::ConfigImportDbcArguments;
use crate::failure::Failure;
use crate::settings::{SettingsFile, Staged, master};
use crate::ui::Ui;

/// Units that a DBC may give, and what one of them is in metres, radians or 1.
const LENGTHS: &[(&str, f64)] =
    &[("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("um", 1e-6), ("µm", 1e-6), ("nm", 1e-9)];
const ANGLES: &[(&str, f64)] = &[
    ("rad", 1.0),
    ("mrad", 1e-3),
    ("urad", 1e-6),
    ("µrad", 1e-6),
    ("deg", std::f64::consts::PI / 180.0),
    ("°", std::f64::consts::PI / 180.0),
    ("rev", 2.0 * std::f64::consts::PI),
];

/// A button is held from one half on.
const BUTTONS: &[(&str, f64)] = &[("", 1.0), ("1", 1.0), ("%", 0.01)];

pub fn run(ui: &Ui, arguments: &ConfigImportDbcArguments) -> Result<(), Failure> {
    let path = &arguments.dbc;
    let bytes = std::fs::read(path)
        .map_err(|e| Failure::input(format!("cannot read {}: {e}", path.display())))?;
    // Tools write Latin-1 as often as UTF-8; only comments and a unit's `µ` or `°` differ.
    let text = String::from_utf8(bytes)
        .unwrap_or_else(|e| e.into_bytes().iter().map(|&byte| char::from(byte)).collect());
    let dbc = Dbc::try_from(text.as_str()).map_err(|e| {
        // With the line and what stands there.
        let path = path.display();
        Failure::input(format!("{path}: is no DBC: {e}\n  fix: give the DBC of the master's bus"))
    })?;
    let (Some(settings), false) = (&arguments.settings, arguments.list) else {
        return list(ui, &dbc);
    };
    let find =
        |name: &Option<String>| name.as_deref().map(|name| find(&dbc, path, name)).transpose();
    let place = |name: &Option<String>, units| {
        find(name)?.map(|found| place(path, found, units)).transpose()
    };
    let drive = |[insertion, rotation, button]: [&Option<String>; 3]| {
        let [insertion, rotation] = [place(insertion, LENGTHS)?, place(rotation, ANGLES)?];
        let held = place(button, BUTTONS)?;
        let drive = |(insertion, rotation)| Drive { insertion, rotation, held };
        Ok::<_, Failure>(insertion.zip(rotation).map(drive))
    };
    let ConfigImportDbcArguments { insertion, rotation, button, grip, .. } = arguments;
    let ConfigImportDbcArguments { guidewire_insertion, guidewire_rotation, .. } = arguments;
    let master = Master {
        catheter: drive([insertion, rotation, button])?,
        guidewire: drive([guidewire_insertion, guidewire_rotation, &arguments.guidewire_button])?,
        grip: place(grip, BUTTONS)?,
    };
    master.validate().map_err(|e| Failure::input(format!("{}: {}", path.display(), e.text())))?;
    write(settings, &master)?;
    let text = master::text(&master);
    ui.data(&json!({ "path": settings.display().to_string(), "master": text }), text)
}

/// A signal and the message that it is in.
type Found<'a> = (&'a Message, &'a DbcSignal);

fn find<'a>(dbc: &'a Dbc, path: &Path, name: &str) -> Result<Found<'a>, Failure> {
    let all = || dbc.messages.iter().flat_map(|m| m.signals.iter().map(move |s| (m, s)));
    let full = |(message, signal): Found<'_>| format!("{}.{}", message.name, signal.name);
    all().find(|&found| full(found) == name).ok_or_else(|| {
        let names = all().map(full).collect::<Vec<_>>();
        let names = names.iter().map(String::as_str).collect::<Vec<_>>();
        let nearest = cathforce_rig::nearest(name, &names);
        let hint = nearest.map_or(String::new(), |name| format!(", the nearest is {name}"));
        let path = path.display();
        Failure::input(format!(
            "{path}: there is no signal {name}{hint}\n  fix: `cathforce config import-dbc --list \
             {path}` lists them"
        ))
    })
}

fn place(
    path: &Path,
    (message, signal): Found<'_>,
    units: &[(&str, f64)],
) -> Result<Place, Failure> {
    let name = format!("{}.{}", message.name, signal.name);
    let refuse = |what: &str, fix: &str| {
        Failure::input(format!("{}: {name} {what}\n  fix: {fix}", path.display()))
    };
    let MessageId::Standard(id) = message.id else {
        let fix = "the bus of this device has 11-bit identifiers only";
        return Err(refuse("is in a frame with a 29-bit identifier", fix));
    };
    let Some((_, one)) = units.iter().find(|(unit, _)| *unit == signal.unit.trim()) else {
        let known = units.iter().map(|(unit, _)| format!("\"{unit}\"")).collect::<Vec<_>>();
        let what = format!("has the unit \"{}\"", signal.unit);
        return Err(refuse(&what, &format!("write one of {} into the DBC", known.join(", "))));
    };
    if signal.multiplexer_indicator != MultiplexIndicator::Plain {
        return Err(refuse(
            "is multiplexed",
            "only a signal that is in every frame is fresh every tick",
        ));
    }
    let signal = Signal {
        start_bit: u8::try_from(signal.start_bit).unwrap_or(u8::MAX),
        bits: u8::try_from(signal.size).unwrap_or(u8::MAX),
        big_endian: signal.byte_order == ByteOrder::BigEndian,
        signed: signal.value_type == ValueType::Signed,
        scale: (signal.factor * one) as f32,
        offset: (signal.offset * one) as f32,
    };
    Ok(Place { id, signal })
}

/// Puts the frames into the file in the place of those that it has; everything else stays.
fn write(path: &Path, frames: &Master) -> Result<(), Failure> {
    // What is wrong already is said with its line first.
    SettingsFile::read(path)?;
    let text = std::fs::read_to_string(path).map_err(Failure::input)?;
    let mut document = text.parse::<DocumentMut>().map_err(Failure::input)?;
    let new = master::text(frames).parse::<DocumentMut>().map_err(Failure::input)?;
    document.remove("master");
    let text = format!("{}\n{}", document.to_string().trim_end(), new);
    Staged::new(path, &text)?.commit()?;
    SettingsFile::read(path).map(drop)
}

fn list(ui: &Ui, dbc: &Dbc) -> Result<(), Failure> {
    let mut text = String::new();
    let mut names = Vec::new();
    for message in &dbc.messages {
        for signal in &message.signals {
            let name = format!("{}.{}", message.name, signal.name);
            text += &format!("{name}  {}\n", signal.unit);
            names.push(json!({ "signal": name, "unit": signal.unit }));
        }
    }
    ui.data(&names, text)
}
