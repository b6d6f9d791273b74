//! The master's own frames, in a settings file: `[master.catheter]`, `[master.guidewire]`.

use cathforce_config::master::{Drive, Master, Place, Signal};
use serde::Deserialize;

use super::parse::{Problem, line, line_of, misspelt};

/// The part of a file that is read here; the rest is read key by key.
#[derive(Deserialize)]
struct Whole {
    #[serde(default)]
    master: MasterTable,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct MasterTable {
    catheter: Option<DriveTable>,
    guidewire: Option<DriveTable>,
    grip: Option<PlaceTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DriveTable {
    /// Of the quantities that say nothing else.
    id: Option<u32>,
    insertion: PlaceTable,
    rotation: PlaceTable,
    held: Option<PlaceTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlaceTable {
    id: Option<u32>,
    start_bit: u8,
    bits: u8,
    #[serde(default)]
    byte_order: ByteOrder,
    #[serde(default)]
    signed: bool,
    #[serde(default = "one")]
    scale: f32,
    #[serde(default)]
    offset: f32,
}

#[derive(Clone, Copy, Default, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
enum ByteOrder {
    #[default]
    Little,
    Big,
}

fn one() -> f32 {
    1.0
}

/// A quantity whose frame is not named, and the drive that it is of.
struct NoId {
    drive: Option<&'static str>,
    quantity: &'static str,
}

impl PlaceTable {
    fn place(
        self,
        quantity: &'static str,
        drive: Option<&'static str>,
        of_drive: Option<u32>,
    ) -> Result<Place, NoId> {
        let Self { id, start_bit, bits, byte_order, signed, scale, offset } = self;
        let id = id.or(of_drive).ok_or(NoId { drive, quantity })?;
        // One that is too large is refused with those of 29 bits.
        let id = u16::try_from(id).unwrap_or(u16::MAX);
        let big_endian = byte_order == ByteOrder::Big;
        Ok(Place { id, signal: Signal { start_bit, bits, big_endian, signed, scale, offset } })
    }
}

impl DriveTable {
    fn drive(self, name: &'static str) -> Result<Drive, NoId> {
        let Self { id, insertion, rotation, held } = self;
        Ok(Drive {
            insertion: insertion.place("insertion", Some(name), id)?,
            rotation: rotation.place("rotation", Some(name), id)?,
            held: held.map(|held| held.place("held", Some(name), id)).transpose()?,
        })
    }
}

impl MasterTable {
    fn master(self) -> Result<Master, NoId> {
        Ok(Master {
            catheter: self.catheter.map(|drive| drive.drive("catheter")).transpose()?,
            guidewire: self.guidewire.map(|drive| drive.drive("guidewire")).transpose()?,
            grip: self.grip.map(|grip| grip.place("grip", None, None)).transpose()?,
        })
    }
}

const FORM: &str = "write `insertion = { start_bit = 0, bits = 24, byte_order = \"little\", signed = \
                    false, scale = 1e-7, offset = 0 }` and the like; docs/config.md has an example";
/// Every name that the tables have.
const FIELDS: [&str; 13] = [
    "catheter",
    "guidewire",
    "grip",
    "id",
    "insertion",
    "rotation",
    "held",
    "start_bit",
    "bits",
    "byte_order",
    "signed",
    "scale",
    "offset",
];

/// The frames that a file describes; without a description the drives use ours.
pub fn parse(text: &str) -> Result<Master, Problem> {
    let whole = toml::from_str::<Whole>(text).map_err(|error| Problem {
        line: line(text, error.span().map_or(0, |span| span.start)),
        message: error.message().into(),
        fix: match error.message().strip_prefix("unknown field `").and_then(|m| m.split_once('`')) {
            Some((name, _)) => misspelt(name, &FIELDS, FORM),
            None => FORM.into(),
        },
    })?;
    let at = |path: &[&str]| line_of(text, &[&["master"], path].concat());
    let master = whole.master.master().map_err(|NoId { drive, quantity }| Problem {
        line: at(&drive.into_iter().chain([quantity]).collect::<Vec<_>>()),
        message: format!("`{quantity}` does not say in which frame it is"),
        fix: "give it an `id`, or its drive one for all that have none".into(),
    })?;
    // One by one, so that what is wrong has a name.
    let Master { catheter, guidewire, grip } = master;
    let parts = [
        ("catheter", Master { catheter, ..Master::default() }),
        ("guidewire", Master { guidewire, ..Master::default() }),
        ("grip", Master { grip, ..master }),
    ];
    for (name, part) in parts {
        let Err(error) = part.validate() else { continue };
        return Err(Problem {
            line: at(&[name]),
            message: format!("master.{name}: {}", error.text()),
            fix: "bits are counted as in a DBC; `cathforce config import-dbc` writes them".into(),
        });
    }
    Ok(master)
}

/// As it is written in a file.
pub fn text(master: &Master) -> String {
    let mut text = String::new();
    if let Some(grip) = master.grip {
        text += &format!("\n[master]\n{}", place("grip", grip, None));
    }
    for (name, drive) in [("catheter", master.catheter), ("guidewire", master.guidewire)] {
        let Some(Drive { insertion, rotation, held }) = drive else { continue };
        let id = insertion.id;
        text += &format!("\n[master.{name}]\nid = {id:#05x}\n");
        text += &place("insertion", insertion, Some(id));
        text += &place("rotation", rotation, Some(id));
        text += &held.map_or(String::new(), |held| place("held", held, Some(id)));
    }
    text
}

/// A quantity with its frame, if that is not its drive's.
fn place(name: &str, place: Place, of_drive: Option<u16>) -> String {
    let Place { id, signal } = place;
    let Signal { start_bit, bits, big_endian, signed, scale, offset } = signal;
    let id = if of_drive == Some(id) { String::new() } else { format!("id = {id:#05x}, ") };
    let order = if big_endian { "big" } else { "little" };
    format!(
        "{name} = {{ {id}start_bit = {start_bit}, bits = {bits}, byte_order = \"{order}\", signed \
         = {signed}, scale = {scale:?}, offset = {offset:?} }}\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_come_back_as_they_were_written() {
        let signal = |start_bit, big_endian| Signal {
            start_bit,
            bits: 16,
            big_endian,
            signed: true,
            scale: 1.234_567_9e-5,
            offset: -0.1,
        };
        let place = |id, signal| Place { id, signal };
        let button = Signal { bits: 1, scale: 1.0, ..signal(63, false) };
        let drive = Drive {
            insertion: place(0x2A, signal(0, false)),
            rotation: place(0x2C, signal(23, true)),
            held: Some(place(0x2A, button)),
        };
        let rotation = place(0x2B, signal(23, true));
        let master = Master {
            catheter: Some(drive),
            guidewire: Some(Drive { rotation, held: None, ..drive }),
            grip: Some(place(0x2D, button)),
        };
        assert_eq!(parse(&text(&master)), Ok(master));
        assert_eq!(parse(&text(&Master::default())), Ok(Master::default()));
    }

    #[test]
    fn what_is_wrong_has_its_line() {
        let signal = "{ start_bit = 0, bits = 8 }";
        for (text, line, word) in [
            (format!("\n[master.catheter]\nid = 1\ninsertion = {signal}\n"), 2, "rotation"),
            (
                format!("[master.catheter]\nid = 0x180\ninsertion = {signal}\nrotation = {signal}"),
                1,
                "own",
            ),
            ("[master.catheter]\nid = 1\ninsertion = { start_bit = 300, bits = 8 }".into(), 3, ""),
            ("\n[master.handle]\nid = 1\n".into(), 2, "handle"),
            (
                format!("[master.catheter]\ninsertion = {signal}\nrotation = {signal}"),
                2,
                "in which frame",
            ),
            (
                format!(
                    "# insertion\nrig = \"grip\"\n[set]\nmax_insertion_m = 0.1\n[master.catheter]\n\
                     id = 1\ninsertion = {signal}\nrotation = {signal}\n[master.guidewire]\n\
                     insertion = {signal}\nrotation = {signal}"
                ),
                10,
                "in which frame",
            ),
            (format!("[master]\ngrip = {signal}"), 2, "in which frame"),
            ("[master]\n\ngrip = { id = 5, start_bit = 0, bits = 1 }".into(), 3, "none"),
            (
                format!(
                    "[master.catheter]\nid = 0x12345678\ninsertion = {signal}\nrotation = {signal}"
                ),
                1,
                "more than 11 bits",
            ),
        ] {
            let problem = parse(&text).unwrap_err();
            assert_eq!(problem.line, line, "{text}: {problem:?}");
            assert!(problem.message.contains(word), "{text}: {problem:?}");
            assert!(!problem.fix.is_empty());
        }
        let slip = "[master.catheter]\nid = 1\ninsertoin = { start_bit = 0, bits = 8 }\n";
        assert_eq!(parse(slip).unwrap_err().fix, "write `insertion`, if that is meant");
    }
}
