//! The master's own frames in a settings file: `[master.catheter]`, `[master.guidewire]` and `grip`.

use std::ops::Range;

use cathforce_bus::{EXTENDED, MAX_EXTENDED_ID, MAX_ID};
use cathforce_config::master::{Drive, Master, Place, Selector, Signal};
use toml::de::DeTable;

use super::table::{Reader, Value};

const FORM: &str = "write `insertion = { start_bit = 0, bits = 24, byte_order = \"little\", signed = \
                    false, scale = 1e-7, offset = 0 }`; docs/reference/settings.md has an example";
const MASTER: [&str; 3] = ["catheter", "guidewire", "grip"];
const DRIVE: [&str; 5] = ["id", "extended", "insertion", "rotation", "held"];
const SELECTOR: [&str; 4] = ["start_bit", "bits", "byte_order", "value"];
const PLACE: [&str; 10] = [
    "id",
    "extended",
    "start_bit",
    "bits",
    "byte_order",
    "signed",
    "float",
    "scale",
    "offset",
    "selector",
];

/// The frames that a file describes; without a description the drives use cathforce's own.
///
/// The result holds what could be read; it is complete if no problem was reported.
pub fn read(reader: &mut Reader<'_>, table: &DeTable<'_>) -> Master {
    reader.check_keys("master", table, &MASTER, FORM);
    let mut master = Master::default();
    let mut spans = Vec::new();
    for (key, value) in table {
        let name = key.get_ref().as_ref();
        let path = format!("master.{name}");
        match name {
            "catheter" => master.catheter = drive(reader, &path, &key.span(), value),
            "guidewire" => master.guidewire = drive(reader, &path, &key.span(), value),
            "grip" => master.grip = place(reader, &path, &key.span(), value, None),
            _ => continue,
        }
        spans.push((name, key.span()));
    }
    // Each part on its own first, so that an error names its part.
    let Master { catheter, guidewire, grip } = master;
    for (name, part) in [
        ("catheter", Master { catheter, ..Master::default() }),
        ("guidewire", Master { guidewire, ..Master::default() }),
        ("grip", Master { catheter, guidewire, grip }),
    ] {
        if name == "grip" && reader.has_problems() {
            break;
        }
        if let Err(error) = part.validate() {
            let span = spans.iter().find(|(own, _)| *own == name).map(|(_, span)| span.clone());
            let fix = "bits are counted as in a DBC; `cathforce config import-dbc` writes them";
            let message = format!("master.{name}: {}", error.text());
            reader.report(&span.unwrap_or_default(), message, fix);
        }
    }
    master
}

/// A drive. Its `id` is that of all its quantities that have none of their own.
fn drive(
    reader: &mut Reader<'_>,
    path: &str,
    span: &Range<usize>,
    value: &Value<'_>,
) -> Option<Drive> {
    let table = reader.table(path, value, FORM)?;
    reader.check_keys(path, table, &DRIVE, FORM);
    let id = identifier(reader, path, table);
    // One that is wrong is reported once, and not again for each quantity.
    let id = table.contains_key("id").then_some(id);
    let mut quantity = |name: &str, is_required: bool| {
        let Some((key, value)) = table.get_key_value(name) else {
            if is_required {
                reader.report(span, format!("`{path}` has no `{name}`"), FORM);
            }
            return None;
        };
        place(reader, &format!("{path}.{name}"), &key.span(), value, id)
    };
    let (insertion, rotation) = (quantity("insertion", true), quantity("rotation", true));
    let held = quantity("held", false);
    Some(Drive { insertion: insertion?, rotation: rotation?, held })
}

/// Where a quantity stands: its frame, and its bits there.
fn place(
    reader: &mut Reader<'_>,
    path: &str,
    span: &Range<usize>,
    value: &Value<'_>,
    id_of_drive: Option<Option<u32>>,
) -> Option<Place> {
    let table = reader.table(path, value, FORM)?;
    reader.check_keys(path, table, &PLACE, FORM);
    let at = |name: &str| format!("{path}.{name}");
    let start_bit = reader.required(path, table, "start_bit", span, FORM);
    let start_bit = start_bit.and_then(|bit| reader.whole(&at("start_bit"), bit, 63, FORM));
    let bits = reader.required(path, table, "bits", span, FORM);
    let bits = bits.and_then(|bits| reader.whole(&at("bits"), bits, 64, FORM));
    let id = match table.contains_key("id") {
        true => identifier(reader, path, table),
        false => id_of_drive.flatten(),
    };
    if id_of_drive.is_none() && !table.contains_key("id") {
        let fix = "give it an `id`, or give its drive an `id` for all that have none";
        reader.report(span, format!("`{path}` does not say in which frame it is"), fix);
    }
    let order = table.get("byte_order");
    let order =
        order.and_then(|order| reader.word(&at("byte_order"), order, &["little", "big"], FORM));
    let signed = table.get("signed").and_then(|signed| reader.flag(&at("signed"), signed, FORM));
    let selector = match table.get("selector") {
        Some(value) => Some(selector(reader, &at("selector"), value)?),
        None => None,
    };
    let float = table.get("float").and_then(|float| reader.flag(&at("float"), float, FORM));
    let mut number = |name: &str, default: f64| match table.get(name) {
        Some(value) => reader.number(&at(name), value, FORM).unwrap_or(default),
        None => default,
    };
    let signal = Signal {
        start_bit: u8::try_from(start_bit?).ok()?,
        bits: u8::try_from(bits?).ok()?,
        big_endian: order == Some("big"),
        signed: signed.unwrap_or(false),
        float: float.unwrap_or(false),
        scale: number("scale", 1.0) as f32,
        offset: number("offset", 0.0) as f32,
    };
    Some(Place { id: id?, signal, selector })
}

/// The identifier of a table, which has 29 bits if `extended` says so.
fn identifier(reader: &mut Reader<'_>, path: &str, table: &DeTable<'_>) -> Option<u32> {
    const FORM: &str = "write an identifier of 11 bits as `id = 0x321`, one of 29 bits as `id = 0x18ff50e5, \
                        extended = true`";
    let extended = table.get("extended");
    let is_extended =
        extended.and_then(|flag| reader.flag(&format!("{path}.extended"), flag, FORM));
    let is_extended = is_extended.unwrap_or(false);
    let Some(id) = table.get("id") else {
        if let Some(flag) = extended {
            let message = format!("`{path}.extended` is said of an `id`, and there is none");
            reader.report(&flag.span(), message, FORM);
        }
        return None;
    };
    let most = if is_extended { MAX_EXTENDED_ID } else { MAX_ID };
    let id = reader.whole(&format!("{path}.id"), id, most, FORM)?;
    Some(if is_extended { id | EXTENDED } else { id })
}

/// Which frames of an identifier hold a quantity.
fn selector(reader: &mut Reader<'_>, path: &str, value: &Value<'_>) -> Option<Selector> {
    const FORM: &str = "write `selector = { start_bit = 0, bits = 8, value = 1 }`";
    let table = reader.table(path, value, FORM)?;
    reader.check_keys(path, table, &SELECTOR, FORM);
    let mut whole = |name: &str, most: u32| {
        let found = table.get(name);
        let found =
            found.and_then(|value| reader.whole(&format!("{path}.{name}"), value, most, FORM));
        if found.is_none() && !table.contains_key(name) {
            reader.report(&value.span(), format!("`{path}` has no `{name}`"), FORM);
        }
        found
    };
    let (start_bit, bits, value) =
        (whole("start_bit", 63), whole("bits", 64), whole("value", u32::MAX));
    let order = table.get("byte_order");
    let order = order.and_then(|order| {
        reader.word(&format!("{path}.byte_order"), order, &["little", "big"], FORM)
    });
    Some(Selector {
        start_bit: u8::try_from(start_bit?).ok()?,
        bits: u8::try_from(bits?).ok()?,
        big_endian: order == Some("big"),
        value: value?,
    })
}

/// The frames as they are written in a file.
pub fn text(master: &Master) -> String {
    let mut text = String::new();
    if let Some(grip) = master.grip {
        text += &format!("\n[master]\n{}", place_text("grip", grip, None));
    }
    for (name, drive) in [("catheter", master.catheter), ("guidewire", master.guidewire)] {
        let Some(Drive { insertion, rotation, held }) = drive else { continue };
        let id = insertion.id;
        text += &format!("\n[master.{name}]\n{}", id_text(id, "\n"));
        text += &place_text("insertion", insertion, Some(id));
        text += &place_text("rotation", rotation, Some(id));
        text += &held.map_or(String::new(), |held| place_text("held", held, Some(id)));
    }
    text
}

/// An identifier as it is written in a file, each key with `end` behind it.
fn id_text(id: u32, end: &str) -> String {
    match id & EXTENDED {
        0 => format!("id = {id:#05x}{end}"),
        _ => format!("id = {:#010x}{end}extended = true{end}", id & MAX_EXTENDED_ID),
    }
}

/// A quantity with its frame, unless that is its drive's.
fn place_text(name: &str, place: Place, of_drive: Option<u32>) -> String {
    let Place { id, signal, selector } = place;
    let Signal { start_bit, bits, big_endian, signed, float, scale, offset } = signal;
    let id = if of_drive == Some(id) { String::new() } else { id_text(id, ", ") };
    let order = if big_endian { "big" } else { "little" };
    let selector = selector.map_or(String::new(), |Selector { start_bit, bits, big_endian, value }| {
        let order = if big_endian { "big" } else { "little" };
        format!(
            ", selector = {{ start_bit = {start_bit}, bits = {bits}, byte_order = \"{order}\", value = {value} }}"
        )
    });
    let kind = if float { "float = true".to_owned() } else { format!("signed = {signed}") };
    format!(
        "{name} = {{ {id}start_bit = {start_bit}, bits = {bits}, byte_order = \"{order}\", {kind}, \
         scale = {scale:?}, offset = {offset:?}{selector} }}\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::problem::Problem;

    /// The frames in a text whose other keys may be anything.
    fn parse(text: &str) -> Result<Master, Vec<Problem>> {
        let table = DeTable::parse(text).unwrap();
        let mut reader = Reader::new(text);
        let master = table.get_ref().get("master");
        let master = master.and_then(|master| master.get_ref().as_table());
        let master = master.map_or(Master::default(), |table| read(&mut reader, table));
        let problems = reader.into_problems();
        if problems.is_empty() { Ok(master) } else { Err(problems) }
    }

    #[test]
    fn frames_come_back_as_they_were_written() {
        let signal = |start_bit, big_endian| Signal {
            start_bit,
            bits: 16,
            big_endian,
            signed: true,
            float: false,
            scale: 1.234_567_9e-5,
            offset: -0.1,
        };
        let place = |id, signal| Place { id, signal, selector: None };
        let button = Signal { bits: 1, scale: 1.0, ..signal(63, false) };
        let drive = Drive {
            insertion: place(0x2A, signal(0, false)),
            rotation: place(0x2C, signal(23, true)),
            held: Some(place(0x2A, button)),
        };
        let float = Signal { bits: 32, float: true, signed: false, ..signal(39, true) };
        let selector = Selector { start_bit: 7, bits: 6, big_endian: true, value: 41 };
        let rotation = Place { selector: Some(selector), ..place(0x2B, float) };
        let master = Master {
            catheter: Some(drive),
            guidewire: Some(Drive {
                insertion: place(EXTENDED | 0x18FF_50E5, signal(0, false)),
                rotation,
                held: None,
            }),
            grip: Some(place(EXTENDED | 0x2D, button)),
        };
        assert_eq!(parse(&text(&master)), Ok(master));
        assert_eq!(parse(&text(&Master::default())), Ok(Master::default()));
    }

    #[test]
    fn what_is_wrong_has_its_line() {
        let signal = "{ start_bit = 0, bits = 8 }";
        let both = format!("insertion = {signal}\nrotation = {signal}");
        let no_frame = "does not say in which frame it is";
        let own = "or is one of cathforce's own";
        let cases: [(String, &[(usize, &str)]); 11] = [
            (
                format!("\n[master.catheter]\nid = 1\ninsertion = {signal}\n"),
                &[(2, "has no `rotation`")],
            ),
            (format!("[master.catheter]\nid = 0x180\n{both}"), &[(1, own)]),
            (
                "[master.catheter]\nid = 1\ninsertion = { start_bit = 300, bits = 8 }".into(),
                &[(1, "has no `rotation`"), (3, "not `300`")],
            ),
            ("\n[master.handle]\nid = 1\n".into(), &[(2, "no key `handle`")]),
            (format!("[master.catheter]\n{both}"), &[(2, no_frame), (3, no_frame)]),
            (
                format!(
                    "# insertion\nrig = \"grip\"\n[set]\nmax_insertion_m = 0.1\n[master.catheter]\n\
                     id = 1\n{both}\n[master.guidewire]\n{both}"
                ),
                &[(10, no_frame), (11, no_frame)],
            ),
            (format!("[master]\ngrip = {signal}"), &[(2, no_frame)]),
            (
                "[master]\n\ngrip = { id = 5, start_bit = 0, bits = 1 }".into(),
                &[(3, "and there is none")],
            ),
            (
                format!("[master.catheter]\nid = 0x12345678\n{both}"),
                &[(2, "a whole number from 0 to 2047")],
            ),
            (
                format!("[master.catheter]\nid = 0x32345678\nextended = true\n{both}"),
                &[(2, "a whole number from 0 to 536870911")],
            ),
            (
                format!("[master.catheter]\nextended = true\n{both}"),
                &[(2, "is said of an `id`"), (3, no_frame), (4, no_frame)],
            ),
        ];
        for (text, expected) in cases {
            let problems = parse(&text).unwrap_err();
            let lines: Vec<usize> = problems.iter().map(|problem| problem.line).collect();
            let wanted: Vec<usize> = expected.iter().map(|(line, _)| *line).collect();
            assert_eq!(lines, wanted, "{text}: {problems:?}");
            for (problem, (_, words)) in problems.iter().zip(expected) {
                assert!(problem.message.contains(words), "{text}: {problem:?}");
                assert!(!problem.fix.is_empty(), "{text}: {problem:?}");
            }
        }
        let slip = "[master.catheter]\nid = 1\ninsertoin = { start_bit = 0, bits = 8 }\n";
        let problems = parse(slip).unwrap_err();
        let fixes = problems.iter().map(|problem| problem.fix.as_str()).collect::<Vec<_>>();
        assert!(fixes.contains(&"write `insertion` if you meant that"), "{problems:?}");
    }

    #[test]
    fn everything_that_is_wrong_is_said_at_once() {
        let text = "[master.catheter]\ninsertion = { start_bit = 0, bits = 8, byte_order = \"bigg\" }\n\
                    rotation = { id = 1, start_bit = \"x\", bits = 8, singed = true }\n\
                    [master.guidewire]\nid = 3\ninsertion = 5\n";
        let problems = parse(text).unwrap_err();
        let said = problems.iter().map(|p| format!("{}: {} ({})\n", p.line, p.message, p.fix));
        let said = said.collect::<String>();
        for part in [
            "2: `master.catheter.insertion` does not say in which frame it is",
            "2: `master.catheter.insertion.byte_order` must be \"little\" or \"big\", not `\"bigg\"`",
            "write `big` if you meant that",
            "3: there is no key `singed` in `master.catheter.rotation` (write `signed`",
            "3: `master.catheter.rotation.start_bit` must be a whole number from 0 to 63",
            "4: `master.guidewire` has no `rotation`",
            "6: `master.guidewire.insertion` must be a table, not `5`",
        ] {
            assert!(said.contains(part), "{part} in:\n{said}");
        }
        assert_eq!(problems.len(), 6, "{said}");
    }
}
