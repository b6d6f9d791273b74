//! Where the identifiers of this protocol lie on a bus.
//!
//! Usually they are the 11-bit identifiers of `docs/reference/frames.md`. Other devices of a bus may use the same ones,
//! as drives of CANopen do with their default PDOs. Ours can then be moved to identifiers of 29 bits: the upper 18 bits
//! are a base that nobody else on the bus uses, and the lower 11 bits stay as they are.

use crate::frame::{EXTENDED, Frame, MAX_ID};
use crate::process::Id;

/// Largest base: the upper 18 of 29 bits.
pub const MAX_ID_BASE: u32 = 0x3_FFFF;

/// Where the identifiers lie.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Placement {
    /// `None`: where the protocol has them, in 11 bits.
    base: Option<u32>,
}

impl Placement {
    /// Where the protocol has them.
    pub const UNMOVED: Self = Self { base: None };

    /// Identifiers of 29 bits with the base in a text, decimal or with `0x` before it; `None` if it is none.
    pub const fn read(text: &str) -> Option<Self> {
        let (digits, radix) = match text.as_bytes() {
            [b'0', b'x', ..] => (text.split_at(2).1, 16),
            _ => (text, 10),
        };
        match u32::from_str_radix(digits, radix) {
            Ok(base) => Self::at(base),
            Err(_) => None,
        }
    }

    /// Identifiers of 29 bits with this base; `None` if it has more than 18 bits.
    pub const fn at(base: u32) -> Option<Self> {
        if base <= MAX_ID_BASE { Some(Self { base: Some(base) }) } else { None }
    }

    /// The base, where identifiers are moved.
    pub const fn base(self) -> Option<u32> {
        self.base
    }

    /// A frame of the protocol as it is on the bus, and a frame of the bus as the protocol has it.
    ///
    /// The two places of an identifier are exchanged, so that the same function leads there and back. A frame of somebody
    /// else that has one of the protocol's 11-bit identifiers becomes one that means nothing to the protocol. Frames with
    /// other identifiers stay as they are.
    pub fn exchange(self, frame: Frame) -> Frame {
        let id = self.exchange_id(frame.id());
        // Cannot fail: an identifier is exchanged for an identifier.
        Frame::new(id, frame.data()).unwrap_or(frame)
    }

    /// The same of an identifier.
    pub fn exchange_id(self, id: u32) -> u32 {
        let Some(base) = self.base else { return id };
        let own = id & MAX_ID;
        if Id::from_raw(own).is_none() {
            return id;
        }
        let moved = EXTENDED | base << 11 | own;
        match id {
            _ if id == own => moved,
            _ if id == moved => own,
            other => other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::MAX_EXTENDED_ID;
    use proptest::prelude::*;

    #[test]
    fn ours_move_and_those_of_others_mean_nothing_then() {
        let moved = Placement::at(0x1_2345).unwrap();
        let haptic = Frame::new(Id::Haptic.raw(), &[1, 2]).unwrap();
        let on_bus = moved.exchange(haptic);
        assert_eq!((on_bus.id(), on_bus.data()), (EXTENDED | 0x91A_2980, &[1, 2][..]));
        assert_eq!(moved.exchange(on_bus), haptic);
        // The RPDO1 of a drive with the number 1, which is SHAPE of node 1 otherwise.
        let of_drive = Frame::new(0x201, &[7]).unwrap();
        assert_eq!(Id::from_raw(0x201), Some(Id::Shape(1)));
        assert_eq!(Id::from_raw(moved.exchange(of_drive).id()), None);
        let other = Frame::new(0x181, &[7]).unwrap();
        assert_eq!(moved.exchange(other), other);
        assert_eq!(Placement::default().exchange(haptic), haptic);
        assert_eq!(Placement::at(MAX_ID_BASE + 1), None);
    }

    proptest! {
        #[test]
        fn twice_is_where_it_was(
            base in 0..=MAX_ID_BASE, id in prop_oneof![0..=MAX_ID, EXTENDED..=EXTENDED | MAX_EXTENDED_ID]
        ) {
            let placement = Placement::at(base).unwrap();
            let frame = Frame::new(id, &[5]).unwrap();
            prop_assert_eq!(placement.exchange(placement.exchange(frame)), frame);
        }
    }
}
