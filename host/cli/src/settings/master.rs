//! The master's own frames, in a settings file: `[master.catheter]`, `[master.guidewire]`.

use std::fmt::Write as _;

use cathforce_config::master::{DriveFrame, Master, Signal};
use serde::Deserialize;

use super::parse::Problem;

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
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DriveTable {
    id: u16,
    insertion: SignalTable,
    rotation: SignalTable,
    held: Option<SignalTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SignalTable {
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

impl From<SignalTable> for Signal {
    fn from(table: SignalTable) -> Self {
        let SignalTable { start_bit, bits, byte_order, signed, scale, offset } = table;
        Self { start_bit, bits, big_endian: byte_order == ByteOrder::Big, signed, scale, offset }
    }
}

impl From<DriveTable> for DriveFrame {
    fn from(table: DriveTable) -> Self {
        Self {
            id: table.id,
            insertion: table.insertion.into(),
            rotation: table.rotation.into(),
            held: table.held.map(Signal::from),
        }
    }
}

/// The frames that a file describes; without a description the drives use ours.
pub fn parse(text: &str) -> Result<Master, Problem> {
    let line = |at: usize| 1 + text.get(..at).unwrap_or(text).matches('\n').count();
    let whole = toml::from_str::<Whole>(text).map_err(|error| Problem {
        line: line(error.span().map_or(0, |span| span.start)),
        message: error.message().into(),
        fix: "write `insertion = { start_bit = 0, bits = 24, byte_order = \"little\", signed = \
              false, scale = 1e-7, offset = 0 }` and the like; docs/config.md has an example"
            .into(),
    })?;
    let MasterTable { catheter, guidewire } = whole.master;
    let master = Master {
        catheter: catheter.map(DriveFrame::from),
        guidewire: guidewire.map(DriveFrame::from),
    };
    for (name, drive) in [("catheter", master.catheter), ("guidewire", master.guidewire)] {
        let Some(Err(error)) = drive.map(|drive| drive.validate()) else { continue };
        let name = format!("master.{name}");
        return Err(Problem {
            line: line(text.find(&name).unwrap_or(0)),
            message: format!("{name}: {}", error.text()),
            fix: "bits are counted as in a DBC; `cathforce config import-dbc` writes them".into(),
        });
    }
    Ok(master)
}

/// As it is written in a file.
pub fn text(master: &Master) -> String {
    let mut text = String::new();
    for (name, drive) in [("catheter", master.catheter), ("guidewire", master.guidewire)] {
        let Some(DriveFrame { id, insertion, rotation, held }) = drive else { continue };
        // Writing to a string does not fail.
        let _ = writeln!(text, "\n[master.{name}]\nid = {id:#05x}");
        let named = [("insertion", Some(insertion)), ("rotation", Some(rotation)), ("held", held)];
        for (name, signal) in named {
            let Some(Signal { start_bit, bits, big_endian, signed, scale, offset }) = signal else {
                continue;
            };
            let order = if big_endian { "big" } else { "little" };
            let _ = writeln!(
                text,
                "{name} = {{ start_bit = {start_bit}, bits = {bits}, byte_order = \"{order}\", \
                 signed = {signed}, scale = {scale:?}, offset = {offset:?} }}"
            );
        }
    }
    text
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
        let drive = DriveFrame {
            id: 0x2A,
            insertion: signal(0, false),
            rotation: signal(23, true),
            held: None,
        };
        let held = Some(Signal { bits: 1, scale: 1.0, ..signal(63, false) });
        let master = Master {
            catheter: Some(drive),
            guidewire: Some(DriveFrame { id: 0x2B, held, ..drive }),
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
        ] {
            let problem = parse(&text).unwrap_err();
            assert_eq!(problem.line, line, "{text}: {problem:?}");
            assert!(problem.message.contains(word), "{text}: {problem:?}");
        }
    }
}
