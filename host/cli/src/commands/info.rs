//! `cathforce info`: what a recording, a bundle, a device image or a device is.

use std::path::Path;

use cathforce_bus::service::{SavedState, Status};
use cathforce_config::image::{self, Header, MAGIC};
use cathforce_control::{Fault, Mode};
use cathforce_link::{Client, CrashRecord, Identity, IdentityError, SavedImage, build_of};
use cathforce_recording::{Recording, bus_load};
use serde_json::{Map, Value, json};

use crate::args::InfoArguments;
use crate::failure::Failure;
use crate::image::check_model;
use crate::open::{is_complete, open_bundle};
use crate::output::is_settings;
use crate::ui::{Ui, two_columns};

pub fn run(ui: &Ui, arguments: &InfoArguments) -> Result<(), Failure> {
    arguments.json_file.check()?;
    let facts = match (&arguments.source.link, &arguments.source.path) {
        (Some(link), _) => device(link)?,
        (None, Some(path)) if path.is_dir() => bundle(ui, path)?,
        (None, Some(path)) => file(path)?,
        // The argument parser asks for one of the two.
        (None, None) => Facts::default(),
    };
    arguments.json_file.write(ui, &facts.json, two_columns(&facts.rows))
}

/// Facts for a reader and for a program.
#[derive(Default)]
struct Facts {
    json: Map<String, Value>,
    rows: Vec<(String, String)>,
}

impl Facts {
    fn of_kind(kind: &str) -> Self {
        let mut facts = Self::default();
        facts.add("kind", json!(kind));
        facts
    }

    /// A fact that reads the same in both forms.
    fn add(&mut self, name: &str, value: Value) {
        let text = match &value {
            Value::String(text) => text.clone(),
            // Six decimals are enough for a reader; JSON has them all.
            Value::Number(number) if number.is_f64() => {
                let six = format!("{:.6}", number.as_f64().unwrap_or_default());
                six.trim_end_matches('0').trim_end_matches('.').to_owned()
            }
            Value::Bool(true) => "yes".into(),
            Value::Bool(false) => "no".into(),
            Value::Null => "none".into(),
            other => other.to_string(),
        };
        self.add_with_text(name, value, text);
    }

    /// A fact with words of its own; words with spaces become a key with underscores.
    fn add_with_text(&mut self, name: &str, value: Value, text: String) {
        self.json.insert(name.replace(' ', "_"), value);
        self.rows.push((name.to_owned(), text));
    }
}

fn bundle(ui: &Ui, path: &Path) -> Result<Facts, Failure> {
    let bundle = open_bundle(ui, path)?;
    check_model(&bundle)?;
    let mut facts = Facts::of_kind("trial bundle");
    facts.add("name", json!(bundle.rig.name));
    facts.add("note", json!(bundle.rig.note));
    facts.add("mesh triangles", json!(bundle.mesh.as_ref().map(|m| m.mesh.len())));
    facts.add("centreline branches", json!(bundle.centreline.len()));
    let trials = bundle
        .trials
        .iter()
        .map(|t| json!({ "number": t.number, "duration_s": t.duration_s(), "rows": t.len() }));
    let lines = bundle
        .trials
        .iter()
        .map(|t| format!("{:03}: {:.3} s, {} rows", t.number, t.duration_s(), t.len()));
    let lines = lines.collect::<Vec<_>>().join("\n");
    facts.add_with_text("trials", trials.collect(), lines);
    facts.add("largest insertion m", json!(bundle.largest_insertion_m()));
    facts.add("warnings", json!(bundle.warnings.len()));
    if let Some(wire) = bundle.catheter().and_then(|rig| rig.guidewire.as_ref()) {
        facts.add("guidewire diameter m", json!(wire.outer_diameter_m));
    }
    Ok(facts)
}

fn file(path: &Path) -> Result<Facts, Failure> {
    let bytes = std::fs::read(path).map_err(|e| {
        Failure::input(format!("cannot read {}: {e}\n  fix: check the path", path.display()))
    })?;
    if bytes.starts_with(&MAGIC) {
        return device_image(path, &bytes);
    }
    if bytes.starts_with(b"\x7fELF") {
        return firmware(path, &bytes);
    }
    if std::str::from_utf8(&bytes).is_ok_and(is_settings) {
        let path = path.display();
        return Err(Failure::input(format!(
            "{path}: this is a settings file, not a recording, a bundle or a device image\n  fix: \
             `cathforce config validate {path}` checks it, and `cathforce config diff {path}` shows \
             what it sets"
        )));
    }
    recording(path)
}

/// A firmware file. One that was not made to be installed has a build and no more.
fn firmware(path: &Path, bytes: &[u8]) -> Result<Facts, Failure> {
    let refuse = |error: IdentityError| {
        let path = path.display();
        Failure::input(format!(
            "{path}: {error}\n  fix: name the firmware of a board; `cargo xtask dist` makes it"
        ))
    };
    let mut facts = Facts::of_kind("firmware");
    match Identity::of_bytes(bytes) {
        Ok(identity) => {
            facts.add("board", json!(identity.board));
            facts.add("version", json!(identity.version));
            facts.add("build", json!(identity.build));
            facts.add("protocol", json!(format!("{:016x}", identity.protocol_hash)));
            facts.add("image schema", json!(format!("{:08x}", identity.image_schema_hash)));
        }
        Err(IdentityError::Anonymous) => {
            let build = build_of(path).ok_or_else(|| refuse(IdentityError::NotElf))?;
            facts.add("build", json!(build));
        }
        Err(error) => return Err(refuse(error)),
    }
    Ok(facts)
}

fn device_image(path: &Path, bytes: &[u8]) -> Result<Facts, Failure> {
    let refuse = |error| {
        let fix = "make the image again with `cathforce config image`";
        let path = path.display();
        Failure::input(format!("{path}: refused as a device image: {error}\n  fix: {fix}"))
    };
    let header = Header::read(bytes).map_err(refuse)?;
    let config = image::decode(bytes).map_err(refuse)?;
    let (description, lumen) = (config.model.description(), config.lumen.header());
    let mut facts = Facts::of_kind("device image");
    facts.add("bytes", json!(bytes.len()));
    facts.add("schema", json!(format!("{:08x}", header.schema)));
    facts.add("crc", json!(format!("{:08x}", header.crc)));
    facts.add("link length m", json!(description.solver.link_length_m));
    facts.add("lumen cell m", json!(lumen.cell_m));
    facts.add("lumen bricks", json!(lumen.stored));
    if let Some(wire) = &description.guidewire {
        facts.add("guidewire radius m", json!(wire.outer_radius_m));
    }
    Ok(facts)
}

fn recording(path: &Path) -> Result<Facts, Failure> {
    let recording = Recording::open(path)?;
    let info = &recording.info;
    let (first, last) = (recording.frames.first(), recording.frames.last());
    let seconds = first.zip(last).map(|(a, b)| b.at_ns.saturating_sub(a.at_ns) as f64 * 1e-9);
    let load = bus_load(&recording.frames);
    let mut facts = Facts::of_kind("recording");
    facts.add("rig", json!(info.rig));
    facts.add("trial", json!(info.trial));
    facts.add("provenance", json!(info.provenance));
    facts.add("link", json!(info.link));
    facts.add("board", json!(info.board));
    facts.add("firmware", json!(info.firmware_version));
    facts.add("protocol", json!(info.protocol));
    facts.add("host version", json!(info.host_version));
    facts.add("lock step", json!(info.lock_step));
    facts.add("frames", json!(recording.frames.len()));
    let share = load.map_or("not known".into(), |load| format!("{:.1} % of 1 Mbit/s", 1e2 * load));
    facts.add_with_text("bus load", json!(load), share);
    facts.add("seconds", json!(seconds));
    facts.add("measured rows", json!(recording.trial.rows.len()));
    facts.add("image bytes", json!(recording.image.len()));
    let complete = json!(is_complete(&recording));
    facts.add_with_text("complete", complete, recording.completeness());
    Ok(facts)
}

fn device(link: &str) -> Result<Facts, Failure> {
    let mut client = Client::connect(cathforce_link::open(link)?)?;
    let device = client.device().clone();
    let Status { mode, fault, lock_step, tick, load, counters, .. } = client.status()?;
    let counted = counters.iter().filter(|&(_, n)| n > 0).collect::<Vec<_>>();
    let mode = Mode::from_codes(mode, fault).map_or("not configured", Mode::name);
    let mut facts = Facts::of_kind("device");
    facts.add("link", json!(link));
    facts.add("board", json!(device.board));
    facts.add("firmware", json!(device.firmware));
    facts.add("protocol", json!(format!("{:016x}", device.protocol_hash)));
    facts.add("image schema", json!(format!("{:08x}", device.image_schema_hash)));
    facts.add("largest image bytes", json!(device.max_image_len));
    facts.add("can lock step", json!(device.can_lock_step));
    facts.add("mode", json!(mode));
    facts.add("lock step", json!(lock_step));
    facts.add("ticks", json!(tick));
    facts.add("missed ticks", json!(load.missed_ticks));
    facts.add("overruns", json!(load.overruns));
    facts.add("latest start ns", json!(load.latest_start_ns));
    facts.add("worst instructions", json!(load.worst_instructions));
    if let Some(saved) = client.saved()? {
        add_saved(&mut facts, &saved);
    }
    if let Some(crash) = client.crash()? {
        add_crash(&mut facts, &crash);
    }
    let text = counted.iter().map(|(counter, n)| format!("{} {n}", counter.name()));
    let text = text.collect::<Vec<_>>().join(", ");
    let json = counted.iter().map(|(counter, n)| (counter.name().to_owned(), json!(n)));
    facts.add_with_text("frames", Value::Object(json.collect()), text);
    Ok(facts)
}

/// What the device boots with.
fn add_saved(facts: &mut Facts, saved: &SavedImage) {
    let SavedImage { state, image_crc32, on_trial, refused } = saved;
    let mut text = match state {
        SavedState::Empty => "nothing".to_owned(),
        SavedState::Good => format!("CRC {image_crc32:08x}"),
        SavedState::Fallback => {
            format!("CRC {image_crc32:08x}, because the newest one cannot be used")
        }
        SavedState::Lost => "none of those that were saved can be used".to_owned(),
    };
    if *on_trial {
        text += ", on trial until the device has run with it for a second";
    }
    if !refused.is_empty() {
        text += &format!("; one is refused: {refused}");
    }
    let json = json!({
        "state": format!("{state:?}").to_lowercase(),
        "image_crc32": format!("{image_crc32:08x}"),
        "on_trial": on_trial,
        "refused": refused,
    });
    facts.add_with_text("saved image", json, text);
}

/// What the device wrote down before it reset itself.
fn add_crash(facts: &mut Facts, crash: &CrashRecord) {
    let fault = crash.fault.map_or("unknown", Fault::name);
    let CrashRecord { resets, tick, time_us, program_counter, link_register, .. } = *crash;
    let CrashRecord { status, address, .. } = *crash;
    let json = json!({
        "fault": fault,
        "resets": resets,
        "tick": tick,
        "time_us": time_us,
        "program_counter": program_counter,
        "link_register": link_register,
        "status": status,
        "address": address,
        "text": crash.text,
    });
    let text = format!(
        "{fault}, reset {resets} since it was switched on: {}\nin tick {tick}, {:.3} s after its \
         boot; at {program_counter:08x}, called from {link_register:08x}; status {status:08x}, \
         address {address:08x}",
        crash.text,
        f64::from(time_us) * 1e-6
    );
    facts.add_with_text("last crash", json, text);
}
