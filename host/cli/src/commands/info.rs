//! `cathforce info`.

use std::path::Path;

use cathforce_bus::service::Status;
use cathforce_config::image::{self, Header, MAGIC};
use cathforce_control::Mode;
use cathforce_link::Client;
use cathforce_recording::{Recording, bus_load};
use serde_json::{Value, json};

use super::{check_model, open_bundle};
use crate::args::InfoArguments;
use crate::failure::Failure;
use crate::settings::parse::is_settings;
use crate::ui::{Ui, two_columns};

pub fn run(ui: &Ui, arguments: &InfoArguments) -> Result<(), Failure> {
    let rows = match (&arguments.link, &arguments.path) {
        (Some(link), _) => device(link)?,
        (None, Some(path)) if path.is_dir() => bundle(ui, path)?,
        (None, Some(path)) => file(path)?,
        // The argument parser asks for one of the two.
        (None, None) => Vec::new(),
    };
    let json: serde_json::Map<String, Value> =
        rows.iter().map(|(key, value)| (key.replace(' ', "_"), value.clone())).collect();
    let text = rows
        .into_iter()
        .map(|(key, value)| {
            let text = match value {
                Value::String(text) => text,
                // Where nobody has to read it back, six decimals are enough.
                Value::Number(number) if number.is_f64() => {
                    let six = format!("{:.6}", number.as_f64().unwrap_or_default());
                    six.trim_end_matches('0').trim_end_matches('.').to_owned()
                }
                other => other.to_string(),
            };
            (key.to_owned(), text)
        })
        .collect::<Vec<_>>();
    ui.data(&json, two_columns(&text))
}

type Rows = Vec<(&'static str, Value)>;

fn bundle(ui: &Ui, path: &Path) -> Result<Rows, Failure> {
    let bundle = open_bundle(ui, path)?;
    check_model(&bundle)?;
    let trials = bundle
        .trials
        .iter()
        .map(|t| format!("{:03}: {:.3} s, {} rows", t.number, t.duration_s(), t.len()))
        .collect::<Vec<_>>();
    let wire = bundle.catheter().and_then(|rig| rig.guidewire.as_ref());
    let mesh = bundle.mesh.as_ref().map(|m| format!("{} triangles", m.mesh.len()));
    let mut rows = vec![
        ("kind", json!("trial bundle")),
        ("name", json!(bundle.rig.name)),
        ("note", json!(bundle.rig.note)),
        ("vessel mesh", json!(mesh)),
        ("centreline branches", json!(bundle.centreline.len())),
        ("trials", json!(trials.join("\n"))),
        ("largest insertion m", json!(bundle.largest_insertion_m())),
        ("warnings", json!(bundle.warnings.len())),
    ];
    rows.extend(wire.map(|wire| ("guidewire diameter m", json!(wire.outer_diameter_m))));
    Ok(rows)
}

fn file(path: &Path) -> Result<Rows, Failure> {
    let bytes = std::fs::read(path).map_err(|e| {
        Failure::input(format!("cannot read {}: {e}; check the path", path.display()))
    })?;
    if bytes.starts_with(&MAGIC) {
        return device_image(path, &bytes);
    }
    if std::str::from_utf8(&bytes).is_ok_and(is_settings) {
        let path = path.display();
        return Err(Failure::input(format!(
            "{path}: this is a file of settings, not a recording, a bundle or an image\n  fix: \
             `cathforce config validate {path}` checks it, `cathforce config diff {path}` says what \
             it sets"
        )));
    }
    recording(path)
}

fn device_image(path: &Path, bytes: &[u8]) -> Result<Rows, Failure> {
    let refuse = |error| {
        let fix = "make it again with `cathforce config image`";
        Failure::input(format!("{}: refused as a device image: {error}; {fix}", path.display()))
    };
    let header = Header::read(bytes).map_err(refuse)?;
    let config = image::decode(bytes).map_err(refuse)?;
    let (description, lumen) = (config.model.description(), config.lumen.header());
    let mut rows = vec![
        ("kind", json!("device image")),
        ("bytes", json!(bytes.len())),
        ("schema", json!(format!("{:08x}", header.schema))),
        ("crc", json!(format!("{:08x}", header.crc))),
        ("link length m", json!(description.solver.link_length_m)),
        ("lumen cell m", json!(lumen.cell_m)),
        ("lumen bricks", json!(lumen.stored)),
    ];
    let wire = description.guidewire.as_ref();
    rows.extend(wire.map(|wire| ("guidewire radius m", json!(wire.outer_radius_m))));
    Ok(rows)
}

fn recording(path: &Path) -> Result<Rows, Failure> {
    let recording = Recording::open(path)?;
    let info = &recording.info;
    let (first, last) = (recording.frames.first(), recording.frames.last());
    let seconds = first.zip(last).map(|(a, b)| b.at_ns.saturating_sub(a.at_ns) as f64 * 1e-9);
    Ok(vec![
        ("kind", json!("recording")),
        ("rig", json!(info.rig)),
        ("trial", json!(info.trial)),
        ("provenance", json!(info.provenance)),
        ("link", json!(info.link)),
        ("board", json!(info.board)),
        ("firmware", json!(info.firmware_version)),
        ("protocol", json!(info.protocol)),
        ("host version", json!(info.host_version)),
        ("lock step", json!(info.lock_step)),
        ("frames", json!(recording.frames.len())),
        ("bus load of 1 Mbit/s", json!(bus_load(&recording.frames))),
        ("seconds", json!(seconds)),
        ("measured rows", json!(recording.trial.rows.len())),
        ("image bytes", json!(recording.image.len())),
        ("complete", json!(recording.completeness())),
    ])
}

fn device(link: &str) -> Result<Rows, Failure> {
    let mut client = Client::connect(cathforce_link::open(link)?)?;
    let device = client.device().clone();
    let Status { mode, fault, lock_step, tick, load, counters, .. } = client.status()?;
    let counted = counters
        .iter()
        .filter(|&(_, n)| n > 0)
        .map(|(counter, n)| format!("{} {n}", counter.name()))
        .collect::<Vec<_>>();
    let mode = Mode::from_codes(mode, fault).map_or("not configured", Mode::name);
    Ok(vec![
        ("kind", json!("device")),
        ("link", json!(link)),
        ("board", json!(device.board)),
        ("firmware", json!(device.firmware)),
        ("protocol", json!(format!("{:016x}", device.protocol_hash))),
        ("image schema", json!(format!("{:08x}", device.image_schema_hash))),
        ("largest image bytes", json!(device.max_image_len)),
        ("can lock step", json!(device.can_lock_step)),
        ("mode", json!(mode)),
        ("lock step", json!(lock_step)),
        ("ticks", json!(tick)),
        ("missed ticks", json!(load.missed_ticks)),
        ("worst instructions", json!(load.worst_instructions)),
        ("frames", json!(counted.join(", "))),
    ])
}
