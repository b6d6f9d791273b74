//! `docs/cathforce.dbc`, read by an independent parser, agrees with our encoders.

mod support;

use std::sync::LazyLock;

use can_dbc::{ByteOrder, Dbc, Message, MessageId, MultiplexIndicator, Signal, ValueType};
use cathforce_bus::{Frame, Id, MODE_UNCONFIGURED, Process, Sealer, Status, crc8};
use proptest::prelude::*;
use support::{meant, process_ids};

fn dbc() -> Dbc {
    Dbc::try_from(include_str!("../../../docs/cathforce.dbc")).unwrap()
}

/// A value as another tool reads it from a frame: raw value × factor + offset.
fn read(signal: &Signal, frame: &Frame) -> f64 {
    assert_eq!(signal.byte_order, ByteOrder::LittleEndian);
    assert_eq!(signal.multiplexer_indicator, MultiplexIndicator::Plain);
    let bits = u64::from_le_bytes(frame.data().try_into().unwrap());
    let (size, start) = (signal.size, signal.start_bit);
    let raw = (bits >> start) & (u64::MAX >> (64 - size));
    let raw = match signal.value_type {
        ValueType::Unsigned => raw as f64,
        ValueType::Signed => ((raw << (64 - size)) as i64 >> (64 - size)) as f64,
    };
    raw * signal.factor + signal.offset
}

fn message(dbc: &Dbc, id: Id) -> &Message {
    let key = MessageId::Standard(id.raw() as u16);
    dbc.messages.iter().find(|m| m.id == key).unwrap_or_else(|| panic!("{id:?} is missing"))
}

#[test]
fn every_process_frame_is_described_and_nothing_else() {
    let dbc = dbc();
    assert_eq!(dbc.messages.len(), process_ids().count());
    for id in process_ids() {
        let message = message(&dbc, id);
        assert_eq!(message.size, 8);
        let sender = if id.is_from_host() { "Host" } else { "Device" };
        assert_eq!(message.transmitter.as_deref(), Some(sender), "{}", message.name);
        // SHAPE_7 and the like: Debug of the id, in other letters.
        let name = format!("{id:?}").to_uppercase().replace('(', "_").replace(')', "");
        assert_eq!(message.name, name);
    }
}

#[test]
fn no_two_signals_of_a_frame_overlap() {
    for message in dbc().messages {
        let mut taken = 0u64;
        for signal in &message.signals {
            let mask = (u64::MAX >> (64 - signal.size)) << signal.start_bit;
            assert_eq!(taken & mask, 0, "{} {}", message.name, signal.name);
            taken |= mask;
        }
    }
}

#[test]
fn codes_have_names() {
    let dbc = dbc();
    let names = |id: Id, signal| {
        let key = MessageId::Standard(id.raw() as u16);
        let values = dbc.value_descriptions_for_signal(key, signal).unwrap();
        values.iter().map(|v| (v.id, v.description.clone())).collect::<Vec<_>>()
    };
    for (code, name) in names(Id::Command, "Code") {
        let payload = [code as u8, 0, 0, 0, 0, 0];
        let Some(Process::Command(command)) = Process::decode(Id::Command, payload) else {
            panic!("{code} {name}");
        };
        assert!(format!("{command:?}").starts_with(&name), "{command:?} {name}");
    }
    let modes = names(Id::Haptic, "Mode");
    assert_eq!(modes.len(), 8);
    assert!(modes.contains(&(MODE_UNCONFIGURED.into(), "Unconfigured".into())));
}

proptest! {
    #[test]
    fn other_tools_read_what_we_mean(payload: [u8; 6], [a, b, c]: [bool; 3], n in 0u8..40) {
        static DBC: LazyLock<Dbc> = LazyLock::new(dbc);
        let mut sealer = Sealer::default();
        for id in process_ids() {
            // Commands are few: most payloads are none.
            let payload = match id {
                Id::Command => [4, 0, payload[2], payload[3], payload[4], payload[5]],
                Id::GuidewireDrive => [payload[0], payload[1], 0, 0, payload[4], payload[5] & 1],
                _ => payload,
            };
            let Some(process) = Process::decode(id, payload) else { continue };
            for _ in 0..n {
                sealer.seal(process, Status::default());
            }
            let mut meant = meant(&process);
            let status = if !id.is_from_host() {
                let bits = [("Unresolved", a), ("Limited", b), ("Last", c)];
                meant.extend(bits.map(|(name, bit)| (name, f64::from(u8::from(bit)))));
                Status { unresolved: a, limited: b, last: c, hand: false }
            } else if id == Id::Guidewire {
                meant.push(("Held", f64::from(u8::from(a))));
                Status { hand: a, ..Status::default() }
            } else if id == Id::Encoder {
                meant.push(("Released", f64::from(u8::from(a))));
                Status { hand: a, ..Status::default() }
            } else {
                Status::default()
            };
            let frame = sealer.seal(process, status);
            meant.push(("Counter", f64::from(n % 16)));
            let body = frame.data()[..7].try_into().unwrap();
            meant.push(("Crc", f64::from(crc8(id.raw(), body))));

            let signals = &message(&DBC, id).signals;
            prop_assert_eq!(signals.len(), meant.len());
            for signal in signals {
                let value = meant.iter().find(|(name, _)| *name == signal.name);
                let value = value.map_or(f64::NAN, |&(_, value)| value);
                // A quantity went through f32, which has 24 bits.
                let tolerance = value.abs() * 1.2e-7;
                let read = read(signal, &frame);
                prop_assert!((read - value).abs() <= tolerance, "{id:?} {}: {read} {value}", signal.name);
                let range = number(&signal.min) - tolerance..=number(&signal.max) + tolerance;
                prop_assert!(range.contains(&read), "{id:?} {}: {read}", signal.name);
            }
        }
    }
}

fn number(value: &can_dbc::NumericValue) -> f64 {
    value.to_string().parse().unwrap()
}
