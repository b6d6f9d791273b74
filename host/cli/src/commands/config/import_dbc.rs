//! `cathforce config import-dbc`: reads from a lab's DBC where its frames hold the drives' positions.

use std::f64::consts::TAU;
use std::path::Path;

use can_dbc::{ByteOrder, MultiplexIndicator, SignalExtendedValueType, ValueType};
use cathforce_bus::{EXTENDED, Id};
use cathforce_config::master::{Drive, Master, MasterError, Place, Selector, Signal};
use serde_json::json;
use toml_edit::DocumentMut;

use super::lab_dbc::{Found, Identifier, LabDbc, is_within_frame};
use crate::args::ConfigImportDbcArguments;
use crate::canopen;
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
    ("rev", TAU),
    ("turn", TAU),
    ("turns", TAU),
];

/// Bytes of a classic frame; the device reads no others.
const FRAME_BYTES: u64 = 8;

/// Units of a button or a grip and their size; it is held from one half on.
const BUTTONS: &[(&str, f64)] = &[("", 1.0), ("1", 1.0), ("%", 0.01)];

pub fn run(ui: &Ui, arguments: &ConfigImportDbcArguments) -> Result<(), Failure> {
    let path = &arguments.dbc;
    let bytes = std::fs::read(path)
        .map_err(|e| Failure::input(format!("cannot read {}: {e}", path.display())))?;
    let dbc = LabDbc::read(&bytes).map_err(|problem| {
        let fix = "give the DBC of the master's bus";
        Failure::input(format!("{}: {problem}\n  fix: {fix}", path.display()))
    })?;
    let (Some(settings), false) = (&arguments.settings, arguments.list) else {
        return list(ui, path, &dbc);
    };
    let master = frames(&dbc, path, arguments)?;
    write(settings, &master)?;
    let text = master::text(&master);
    ui.data(&json!({ "path": settings.display().to_string(), "master": text }), text)
}

/// The frames with the signals of the command line.
fn frames(
    dbc: &LabDbc,
    path: &Path,
    arguments: &ConfigImportDbcArguments,
) -> Result<Master, Failure> {
    let place = |name: &Option<String>, units| {
        let Some(name) = name else { return Ok(None) };
        let found = find(dbc, path, name)?;
        check_collision(dbc, path, found)?;
        place(dbc, found, units).map(Some).map_err(|Unfit { what, fix }| {
            Failure::input(format!("{}: {name} {what}\n  fix: {fix}", path.display()))
        })
    };
    // A drive that counts turns feeds by its lead.
    let lead_m = arguments.lead.map(|mm| 1e-3 * mm);
    let with_lead = lead_m.map(|lead_m| {
        let turns = ANGLES.iter().map(|(unit, rad)| (*unit, rad / TAU * lead_m));
        LENGTHS.iter().copied().chain(turns).collect::<Vec<_>>()
    });
    let lengths = with_lead.as_deref().unwrap_or(LENGTHS);
    let drive = |[insertion, rotation, button]: [&Option<String>; 3]| {
        let [insertion, rotation] = [place(insertion, lengths)?, place(rotation, ANGLES)?];
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
    if !arguments.id_moved {
        check_canopen(dbc, path, &master)?;
    }
    // Each signal was checked on its own; this checks them together.
    master.validate().map_err(|e| Failure::input(format!("{}: {}", path.display(), e.text())))?;
    Ok(master)
}

/// The one signal of a name.
fn find<'a>(dbc: &'a LabDbc, path: &Path, name: &str) -> Result<Found<'a>, Failure> {
    let path = path.display();
    match dbc.named(name)[..] {
        [found] => Ok(found),
        [] => {
            let names = dbc.signals().map(|found| dbc.full_name(found)).collect::<Vec<_>>();
            let names = names.iter().map(String::as_str).collect::<Vec<_>>();
            let list = format!("`cathforce config import-dbc {path} --list` lists them");
            let fix = misspelt(name, &names, &list);
            Err(Failure::input(format!("{path}: there is no signal `{name}`\n  fix: {fix}")))
        }
        ref several => {
            let ids = several.iter().map(|found| dbc.identifier(found.message).text());
            let ids = ids.collect::<Vec<_>>();
            let signal = name.rsplit_once('.').map_or(name, |(_, signal)| signal);
            Err(Failure::input(format!(
                "{path}: there are {} signals `{name}`, in the frames {}\n  fix: name the one that is \
                 meant by its identifier, like {}.{signal}, or rename it in the DBC",
                several.len(),
                ids.join(", "),
                ids[0].split(' ').next().unwrap_or_default()
            )))
        }
    }
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
fn place(dbc: &LabDbc, found: Found<'_>, units: &[(&str, f64)]) -> Result<Place, Unfit> {
    let Found { message, signal } = found;
    let id = identifier(dbc, found)?;
    if message.size > FRAME_BYTES {
        return Err(Unfit::new(
            format!("is in a frame of {} bytes", message.size),
            "let the master send it in a frame of 8 bytes at most; the device reads no other",
        ));
    }
    if !is_within_frame(found) {
        let (bits, bytes) = (signal.size, message.size);
        let what = format!(
            "begins at bit {} with {bits} bits and is not within the {bytes} bytes of its frame {}",
            signal.start_bit, message.name
        );
        return Err(Unfit::new(
            what,
            "correct the frame's length or the signal's place in the DBC",
        ));
    }
    let Some((_, one)) = units.iter().find(|(unit, _)| *unit == signal.unit.trim()) else {
        let known = units.iter().map(|(unit, _)| format!("\"{unit}\"")).collect::<Vec<_>>();
        let what = format!("has the unit \"{}\"", signal.unit);
        return Err(Unfit::new(what, format!("write one of {} into the DBC", known.join(", "))));
    };
    let selector = selector(found)?;
    // The bits of a floating-point number, read as an integer, would be a position far off.
    let float = match dbc.dbc().extended_value_type_for_signal(message.id, &signal.name) {
        None | Some(SignalExtendedValueType::SignedOrUnsignedInteger) => false,
        Some(SignalExtendedValueType::IEEEfloat32Bit) if signal.size == 32 => true,
        Some(_) => {
            return Err(Unfit::new(
                format!("is a floating-point number of {} bits", signal.size),
                "let the master send it as one of 32 bits, or as an integer with a factor; the device reads no \
                 other",
            ));
        }
    };
    let signal = Signal {
        start_bit: u8::try_from(signal.start_bit).unwrap_or(u8::MAX),
        bits: u8::try_from(signal.size).unwrap_or(u8::MAX),
        big_endian: signal.byte_order == ByteOrder::BigEndian,
        signed: signal.value_type == ValueType::Signed && !float,
        float,
        scale: (signal.factor * one) as f32,
        offset: (signal.offset * one) as f32,
    };
    let place = Place { id, signal, selector };
    place.validate().map_err(|error| {
        let fix = match error {
            MasterError::Id => "let the master send it under a free identifier",
            _ => "correct the signal in the DBC, or take another signal",
        };
        Unfit::new(format!("cannot be read: {}", error.text()), fix)
    })?;
    Ok(place)
}

/// The multiplexor of a signal that is not in every frame, and its value there.
fn selector(Found { message, signal }: Found<'_>) -> Result<Option<Selector>, Unfit> {
    let value = match signal.multiplexer_indicator {
        MultiplexIndicator::Plain | MultiplexIndicator::Multiplexor => return Ok(None),
        MultiplexIndicator::MultiplexedSignal(value) => Some(value),
        MultiplexIndicator::MultiplexorAndMultiplexedSignal(_) => None,
    };
    let is_multiplexor =
        |one: &&can_dbc::Signal| one.multiplexer_indicator == MultiplexIndicator::Multiplexor;
    let multiplexors = message.signals.iter().filter(is_multiplexor).collect::<Vec<_>>();
    let (Some(value), [multiplexor]) = (value, &multiplexors[..]) else {
        return Err(Unfit::new(
            "is multiplexed by more than one signal",
            "take a signal that one multiplexor selects, or one that is in every frame",
        ));
    };
    let selector = Selector {
        start_bit: u8::try_from(multiplexor.start_bit).unwrap_or(u8::MAX),
        bits: u8::try_from(multiplexor.size).unwrap_or(u8::MAX),
        big_endian: multiplexor.byte_order == ByteOrder::BigEndian,
        value: u32::try_from(value).unwrap_or(u32::MAX),
    };
    match selector.validate().is_ok() && u64::from(selector.value) == value {
        true => Ok(Some(selector)),
        false => Err(Unfit::new(
            format!("is selected by {} = {value}, which does not fit", multiplexor.name),
            "correct the multiplexor in the DBC",
        )),
    }
}

/// The identifier of a signal's frame, as the device has it.
fn identifier(dbc: &LabDbc, found: Found<'_>) -> Result<u32, Unfit> {
    let name = &found.message.name;
    Err(match dbc.identifier(found.message) {
        Identifier::Base(id) => return Ok(id),
        Identifier::Extended(id) => return Ok(id | EXTENDED),
        Identifier::Neither(raw) => Unfit::new(
            format!(
                "is in the frame {name}, whose identifier {raw} ({raw:#x}) has more than 11 bits \
                     without the mark of an extended one"
            ),
            "correct the line `BO_`: an identifier of 29 bits is written with 2147483648 added, one of 11 \
             bits is at most 2047",
        ),
        Identifier::NoFrame => {
            Unfit::new("is in no frame", "take a signal of a frame, or put it into one in the DBC")
        }
    })
}

/// Refuses a signal of a frame whose identifier is ours, with both names.
fn check_collision(dbc: &LabDbc, path: &Path, found: Found<'_>) -> Result<(), Failure> {
    // Ours have 11 bits.
    let Identifier::Base(id) = dbc.identifier(found.message) else { return Ok(()) };
    let ours = Id::from_raw(id).filter(|ours| !matches!(ours, Id::Encoder | Id::Guidewire));
    let Some(ours) = ours else { return Ok(()) };
    let theirs = &found.message.name;
    let object = canopen::object(id).map_or(String::new(), |(object, node)| {
        format!(" ({object} of node {node}, if it is a drive of CANopen)")
    });
    Err(Failure::input(format!(
        "{}: {theirs}{object} has the identifier {id:#05x}, which is one of cathforce's own: {ours:?}\n  fix: \
         let the master send it under a free identifier",
        path.display()
    )))
}

/// Refuses frames of a CANopen drive, whose other identifiers are ours.
fn check_canopen(dbc: &LabDbc, path: &Path, master: &Master) -> Result<(), Failure> {
    let drives = [master.catheter, master.guidewire].into_iter().flatten();
    let ids = drives.flat_map(|drive| [drive.insertion.id, drive.rotation.id]);
    for id in ids {
        let Some((object, node)) = canopen::object(id) else { continue };
        let of_id = dbc
            .signals()
            .map(|found| found.message)
            .find(|message| dbc.identifier(message) == Identifier::Base(id));
        let collisions = canopen::collisions(node);
        let name = of_id.map_or("", |message| &message.name);
        let says_so = ["PDO", "CANOPEN"].iter().any(|word| name.to_uppercase().contains(word));
        if says_so && !collisions.is_empty() {
            return Err(Failure::input(format!(
                "{}: {name} is {object} of CANopen node {node}, whose identifiers on the same bus are also \
                 ours: {}\n  fix: move ours to 29 bits (`cargo xtask firmware --id-base`, then --id-moved here), \
                 give the drive's PDOs other identifiers (objects 0x1400 to 0x1A00), or put it on a bus of its \
                 own behind a gateway",
                path.display(),
                collisions.join("; ")
            )));
        }
    }
    Ok(())
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

fn list(ui: &Ui, path: &Path, dbc: &LabDbc) -> Result<(), Failure> {
    let mut text = String::new();
    let mut names = Vec::new();
    for found in dbc.signals() {
        let id = dbc.identifier(found.message);
        let (name, bits) = (dbc.full_name(found), found.signal.size);
        let unit = found.signal.unit.trim();
        if !is_within_frame(found) {
            ui.warn(format_args!(
                "{}: {name} is not within the {} bytes of its frame: the frame's length or the signal's place \
                 is wrong",
                path.display(),
                found.message.size
            ));
        }
        text += format!("{name}  {}, {bits} bits  {unit}", id.text()).trim_end();
        text.push('\n');
        let raw = match id {
            Identifier::Base(id) | Identifier::Extended(id) => u64::from(id),
            Identifier::Neither(id) => id,
            Identifier::NoFrame => u64::from(found.message.id.raw()),
        };
        let is_extended = matches!(id, Identifier::Extended(_));
        names.push(json!({
            "signal": name, "id": raw, "extended": is_extended, "bits": bits, "unit": unit,
        }));
    }
    ui.data(&names, text)
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
        BO_ 274923521 Broad: 8 Master\n \
        SG_ Feed : 0|16@1- (1,0) [0|1] \"m\" Slave\n\n\
        BO_ 933 Short: 4 Master\n \
        SG_ Feed : 24|16@1- (1,0) [0|1] \"m\" Slave\n\n\
        BO_ 934 Long: 12 Master\n \
        SG_ Feed : 0|16@1- (1,0) [0|1] \"m\" Slave\n\n\
        BO_ 384 Taken: 8 Master\n \
        SG_ Feed : 0|16@1- (1,0) [0|1] \"m\" Slave\n\n\
        SIG_VALTYPE_ 931 Feed : 1;\nSIG_VALTYPE_ 931 Double : 2;\n";

    fn placed(dbc: &LabDbc, name: &str) -> Result<Place, Unfit> {
        let found = find(dbc, Path::new("lab.dbc"), name).unwrap();
        place(dbc, found, LENGTHS)
    }

    /// A signal that the device would read as another number than the master meant is refused.
    #[test]
    fn a_signal_that_the_device_cannot_read_is_refused_with_its_reason() {
        let dbc = LabDbc::read(LAB).unwrap();
        assert_eq!(placed(&dbc, "Handle.Feed").unwrap().signal.scale, 1e-5);
        let sometimes = placed(&dbc, "Mode.Sometimes").unwrap().selector;
        let expected = Selector { start_bit: 0, bits: 8, big_endian: false, value: 0 };
        assert_eq!(sometimes, Some(expected));
        let real = placed(&dbc, "Real.Feed").unwrap().signal;
        assert!(real.float && !real.signed && real.bits == 32);
        assert_eq!(placed(&dbc, "Far.Feed").unwrap().id, EXTENDED | 0x18FE_F1FE);
        for (name, why) in [
            ("Mode.Which", "the unit \"\""),
            ("Real.Double", "floating-point number of 64 bits"),
            ("Wide.Feed", "1 to 32 bits"),
            ("Wide.Over", "not within the 8 bytes of its frame Wide"),
            ("Short.Feed", "not within the 4 bytes"),
            ("Long.Feed", "a frame of 12 bytes"),
            ("Broad.Feed", "274923521 (0x10630001) has more than 11 bits"),
            ("Wide.Still", "must be finite and not 0"),
            ("Wide.Yards", "the unit \"yd\""),
            ("Taken.Feed", "one of cathforce's own"),
        ] {
            let Unfit { what, fix } = placed(&dbc, name).unwrap_err();
            assert!(what.contains(why) && !fix.is_empty(), "{name} {what}: {fix}");
        }
    }

    /// An ODrive or a VESC counts revolutions of its motor.
    #[test]
    fn revolutions_become_feed_by_the_lead() {
        let text = String::from_utf8_lossy(LAB).replacen(
            "(0.01,0) [0|600] \"mm\"",
            "(0.01,0) [0|600] \"rev\"",
            1,
        );
        let dbc = LabDbc::read(text.as_bytes()).unwrap();
        let found = find(&dbc, Path::new("lab.dbc"), "Handle.Feed").unwrap();
        let Err(Unfit { what, .. }) = place(&dbc, found, LENGTHS) else {
            panic!("a turn is no length")
        };
        assert!(what.contains("\"rev\""), "{what}");
        let by_lead = [("rev", 5e-3)];
        let scale = place(&dbc, found, &by_lead).unwrap().signal.scale;
        assert!((scale - 5e-5).abs() < 1e-10, "{scale}");
    }

    #[test]
    fn a_drive_of_canopen_is_refused_with_both_names() {
        let text = "VERSION \"\"\n\nBU_: D\n\nBO_ 385 TPDO1_NODE1: 8 D\n \
            SG_ FEED : 0|32@1- (0.0001,0) [0|0] \"mm\" D\n SG_ TURN : 32|32@1- (0.0001,0) [0|0] \"rad\" D\n\n\
            BO_ 641 TPDO2_NODE1: 8 D\n SG_ FEED : 0|32@1- (0.0001,0) [0|0] \"mm\" D\n";
        let dbc = LabDbc::read(text.as_bytes()).unwrap();
        let path = Path::new("drive.dbc");
        let at = |name| {
            place(&dbc, find(&dbc, path, name).unwrap(), &[LENGTHS, ANGLES].concat()).unwrap()
        };
        let drive = Drive {
            insertion: at("TPDO1_NODE1.FEED"),
            rotation: at("TPDO1_NODE1.TURN"),
            held: None,
        };
        let master = Master { catheter: Some(drive), ..Master::default() };
        let error = check_canopen(&dbc, path, &master).unwrap_err().message;
        for says in [
            "TPDO1_NODE1 is TPDO1 of CANopen node 1",
            "RPDO1 and our Shape(1)",
            "command the drive",
        ] {
            assert!(error.contains(says), "{says}: {error}");
        }
        let taken = find(&dbc, path, "TPDO2_NODE1.FEED").unwrap();
        let error = check_collision(&dbc, path, taken).unwrap_err().message;
        assert!(
            error.contains("TPDO2_NODE1 (TPDO2 of node 1") && error.contains("Force(1)"),
            "{error}"
        );
    }

    #[test]
    fn of_two_signals_with_one_name_none_is_taken_silently() {
        let text = String::from_utf8_lossy(LAB).replace("BO_ 930 Mode", "BO_ 930 Handle");
        let text = text.replace("SG_ Which M ", "SG_ Feed ");
        let dbc = LabDbc::read(text.as_bytes()).unwrap();
        let error = find(&dbc, Path::new("lab.dbc"), "Handle.Feed").err().unwrap().message;
        assert!(error.contains("2 signals") && error.contains("0x3a1, 0x3a2"), "{error}");
        assert!(error.contains("like 0x3a1.Feed"), "{error}");
        assert!(find(&dbc, Path::new("lab.dbc"), "0x3a1.Feed").is_ok());
    }

    #[test]
    fn a_damaged_dbc_is_taken_or_refused_and_never_panics() {
        let mut random = StdRng::seed_from_u64(4);
        let mut refused = 0;
        for _ in 0..2000 {
            let Ok(dbc) = LabDbc::read(&damage::damage(LAB, &mut random)) else {
                refused += 1;
                continue;
            };
            for found in dbc.signals() {
                // The device accepts every signal that is accepted here.
                let taken = place(&dbc, found, LENGTHS);
                assert!(taken.is_err() || taken.is_ok_and(|place| place.validate().is_ok()));
            }
        }
        assert!((200..2000).contains(&refused), "{refused}");
        let empty = LabDbc::read(b"").err().unwrap();
        assert!(empty.contains("no signal"), "{empty}");
    }
}
