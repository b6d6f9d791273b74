//! `cathforce config import-dbc`: reads from a lab's DBC where its frames hold the drives' positions.

use std::path::Path;

use can_dbc::{
    ByteOrder, Dbc, Message, MessageId, MultiplexIndicator, Signal as DbcSignal,
    SignalExtendedValueType, ValueType,
};
use cathforce_config::master::{Drive, Master, MasterError, Place, Signal};
use serde_json::json;
use toml_edit::DocumentMut;

use crate::args::ConfigImportDbcArguments;
use crate::failure::Failure;
use crate::settings::entry::misspelt;
use crate::settings::{SettingsFile, Staged, master};
use crate::ui::Ui;

/// Units of a DBC and their size in metres.
const LENGTHS: &[(&str, f64)] =
    &[("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("um", 1e-6), ("µm", 1e-6), ("nm", 1e-9)];
/// Units of a DBC and their size in radians.
const ANGLES: &[(&str, f64)] = &[
    ("rad", 1.0),
    ("mrad", 1e-3),
    ("urad", 1e-6),
    ("µrad", 1e-6),
    ("deg", std::f64::consts::PI / 180.0),
    ("°", std::f64::consts::PI / 180.0),
    ("rev", 2.0 * std::f64::consts::PI),
];

/// Units of a button or a grip and their size; it is held from one half on.
const BUTTONS: &[(&str, f64)] = &[("", 1.0), ("1", 1.0), ("%", 0.01)];

pub fn run(ui: &Ui, arguments: &ConfigImportDbcArguments) -> Result<(), Failure> {
    let path = &arguments.dbc;
    let bytes = std::fs::read(path)
        .map_err(|e| Failure::input(format!("cannot read {}: {e}", path.display())))?;
    let dbc = read(&bytes).map_err(|problem| {
        let fix = "give the DBC of the master's bus";
        Failure::input(format!("{}: {problem}\n  fix: {fix}", path.display()))
    })?;
    let (Some(settings), false) = (&arguments.settings, arguments.list) else {
        return list(ui, &dbc);
    };
    let master = frames(&dbc, path, arguments)?;
    write(settings, &master)?;
    let text = master::text(&master);
    ui.data(&json!({ "path": settings.display().to_string(), "master": text }), text)
}

/// Reads a DBC, which must describe at least one signal.
fn read(bytes: &[u8]) -> Result<Dbc, String> {
    // Tools write Latin-1 as often as UTF-8; the two differ in comments and in `µ` and `°`.
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&byte| char::from(byte)).collect(),
    };
    // The error names the line and what stands there.
    let dbc = Dbc::try_from(text.as_str()).map_err(|e| format!("this is not a DBC: {e}"))?;
    match dbc.messages.iter().any(|message| !message.signals.is_empty()) {
        true => Ok(dbc),
        false => Err("this DBC has no signal".into()),
    }
}

/// The frames with the signals of the command line.
fn frames(dbc: &Dbc, path: &Path, arguments: &ConfigImportDbcArguments) -> Result<Master, Failure> {
    let place = |name: &Option<String>, units| {
        let Some(name) = name else { return Ok(None) };
        let found = find(dbc, path, name)?;
        place(dbc, found, units).map(Some).map_err(|Unfit { what, fix }| {
            Failure::input(format!("{}: {name} {what}\n  fix: {fix}", path.display()))
        })
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
    // Each signal was checked on its own; this checks them together.
    master.validate().map_err(|e| Failure::input(format!("{}: {}", path.display(), e.text())))?;
    Ok(master)
}

/// A signal and the message that it is in.
type Found<'a> = (&'a Message, &'a DbcSignal);

fn find<'a>(dbc: &'a Dbc, path: &Path, name: &str) -> Result<Found<'a>, Failure> {
    let all = || dbc.messages.iter().flat_map(|m| m.signals.iter().map(move |s| (m, s)));
    let full = |(message, signal): Found<'_>| format!("{}.{}", message.name, signal.name);
    all().find(|&found| full(found) == name).ok_or_else(|| {
        let names = all().map(full).collect::<Vec<_>>();
        let names = names.iter().map(String::as_str).collect::<Vec<_>>();
        let path = path.display();
        let list = format!("`cathforce config import-dbc {path} --list` lists them");
        let fix = misspelt(name, &names, &list);
        Failure::input(format!("{path}: there is no signal `{name}`\n  fix: {fix}"))
    })
}

/// Why the device cannot read a signal, and how to change that.
#[derive(Debug, PartialEq)]
struct Unfit {
    what: String,
    fix: String,
}

impl Unfit {
    fn new(what: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { what: what.into(), fix: fix.into() }
    }
}

/// Where a signal stands, scaled to metres, radians or 1; `units` are those that it may have.
fn place(dbc: &Dbc, (message, signal): Found<'_>, units: &[(&str, f64)]) -> Result<Place, Unfit> {
    let MessageId::Standard(id) = message.id else {
        return Err(Unfit::new(
            "is in a frame with a 29-bit identifier",
            "let the master send it in a frame with an 11-bit identifier; the device reads no other",
        ));
    };
    let Some((_, one)) = units.iter().find(|(unit, _)| *unit == signal.unit.trim()) else {
        let known = units.iter().map(|(unit, _)| format!("\"{unit}\"")).collect::<Vec<_>>();
        let what = format!("has the unit \"{}\"", signal.unit);
        return Err(Unfit::new(what, format!("write one of {} into the DBC", known.join(", "))));
    };
    if signal.multiplexer_indicator != MultiplexIndicator::Plain {
        return Err(Unfit::new(
            "is multiplexed",
            "take a signal that is in every frame, so that it is fresh every tick",
        ));
    }
    // The bits of a floating-point number, read as an integer, would be a position far off.
    let extended = dbc.extended_value_type_for_signal(message.id, &signal.name);
    if !matches!(extended, None | Some(SignalExtendedValueType::SignedOrUnsignedInteger)) {
        return Err(Unfit::new(
            "is a floating-point number",
            "let the master send it as an integer with a factor; the device reads no other",
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
    let place = Place { id, signal };
    place.validate().map_err(|error| {
        let fix = match error {
            MasterError::Id => "let the master send it under a free identifier",
            _ => "correct the signal in the DBC, or take another signal",
        };
        Unfit::new(format!("cannot be read: {}", error.text()), fix)
    })?;
    Ok(place)
}

/// Replaces the frames of the file; everything else stays.
fn write(path: &Path, frames: &Master) -> Result<(), Failure> {
    // A file that is wrong already is refused with its lines.
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
            let unit = signal.unit.trim();
            let (id, bits) = (id_text(message.id), signal.size);
            text += format!("{name}  {id}, {bits} bits  {unit}").trim_end();
            text.push('\n');
            let raw = match message.id {
                MessageId::Standard(id) => u32::from(id),
                MessageId::Extended(id) => id,
            };
            let is_extended = matches!(message.id, MessageId::Extended(_));
            names.push(json!({
                "signal": name, "id": raw, "extended": is_extended, "bits": bits, "unit": unit,
            }));
        }
    }
    ui.data(&names, text)
}

fn id_text(id: MessageId) -> String {
    match id {
        MessageId::Standard(id) => format!("{id:#05x}"),
        MessageId::Extended(id) => format!("{id:#010x} (29 bits)"),
    }
}

#[cfg(test)]
#[path = "../../../../recording/tests/support/damage.rs"]
mod damage;

#[cfg(test)]
mod tests {
    use rand::{SeedableRng, rngs::StdRng};

    use super::*;

    const LAB: &[u8] = b"VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: Master Slave\n\n\
        BO_ 929 Handle: 8 Master\n \
        SG_ Feed : 7|16@0+ (0.01,0) [0|600] \"mm\" Slave\n \
        SG_ Turn : 23|16@0- (0.1,0) [-3000|3000] \"deg\" Slave\n\n\
        BO_ 930 Mode: 8 Master\n \
        SG_ Which M : 0|8@1+ (1,0) [0|255] \"\" Slave\n \
        SG_ Sometimes m0 : 8|16@1+ (0.01,0) [0|600] \"mm\" Slave\n\n\
        BO_ 2566844926 Far: 8 Master\n \
        SG_ Feed : 0|16@1+ (0.01,0) [0|600] \"mm\" Slave\n\n\
        BO_ 931 Real: 8 Master\n \
        SG_ Feed : 0|32@1- (1,0) [0|1] \"m\" Slave\n \
        SG_ Double : 0|64@1- (1,0) [0|1] \"m\" Slave\n\n\
        BO_ 932 Wide: 8 Master\n \
        SG_ Feed : 0|40@1- (1E-9,0) [0|1] \"m\" Slave\n \
        SG_ Over : 56|16@1- (1E-9,0) [0|1] \"m\" Slave\n \
        SG_ Still : 0|16@1- (0,0) [0|1] \"m\" Slave\n \
        SG_ Yards : 0|16@1- (1,0) [0|1] \"yd\" Slave\n\n\
        BO_ 384 Taken: 8 Master\n \
        SG_ Feed : 0|16@1- (1,0) [0|1] \"m\" Slave\n\n\
        SIG_VALTYPE_ 931 Feed : 1;\nSIG_VALTYPE_ 931 Double : 2;\n";

    fn placed(dbc: &Dbc, name: &str) -> Result<Place, Unfit> {
        let found = find(dbc, Path::new("lab.dbc"), name).unwrap();
        place(dbc, found, LENGTHS)
    }

    /// A signal that the device would read as another number than the master meant is refused.
    #[test]
    fn a_signal_that_the_device_cannot_read_is_refused_with_its_reason() {
        let dbc = read(LAB).unwrap();
        assert_eq!(placed(&dbc, "Handle.Feed").unwrap().signal.scale, 1e-5);
        for (name, why) in [
            ("Mode.Which", "the unit \"\""),
            ("Mode.Sometimes", "is multiplexed"),
            ("Far.Feed", "29-bit identifier"),
            ("Real.Feed", "floating-point"),
            ("Real.Double", "floating-point"),
            ("Wide.Feed", "1 to 32 bits"),
            ("Wide.Over", "within 8 bytes"),
            ("Wide.Still", "must be finite and not 0"),
            ("Wide.Yards", "the unit \"yd\""),
            ("Taken.Feed", "one of cathforce's own"),
        ] {
            let Unfit { what, fix } = placed(&dbc, name).unwrap_err();
            assert!(what.contains(why) && !fix.is_empty(), "{name} {what}: {fix}");
        }
    }

    #[test]
    fn a_damaged_dbc_is_taken_or_refused_and_never_panics() {
        let mut random = StdRng::seed_from_u64(4);
        let mut refused = 0;
        for _ in 0..2000 {
            let Ok(dbc) = read(&damage::damage(LAB, &mut random)) else {
                refused += 1;
                continue;
            };
            let all = dbc.messages.iter().flat_map(|m| m.signals.iter().map(move |s| (m, s)));
            for found in all {
                // The device accepts every signal that is accepted here.
                let taken = place(&dbc, found, LENGTHS);
                assert!(taken.is_err() || taken.is_ok_and(|place| place.validate().is_ok()));
            }
        }
        assert!((200..2000).contains(&refused), "{refused}");
        let empty = read(b"").unwrap_err();
        assert!(empty.contains("no signal"), "{empty}");
    }
}
