//! A frame as it crossed the bus, and its message in a recording.

use cathforce_bus::{Direction, EXTENDED, Frame, MAX_EXTENDED_ID};

use super::messages::{CanFrame, Header};

/// A frame with the time and direction in which it crossed the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BusFrame {
    /// Virtual time in lock step, else time of the host's monotonic clock \[ns\].
    pub at_ns: u64,
    pub direction: Direction,
    pub frame: Frame,
}

impl BusFrame {
    /// `arrived_ns`: when it reached the host's computer.
    pub(crate) fn to_message(self, arrived_ns: u64) -> CanFrame {
        let bytes = self.frame.data();
        let mut data = [0; 8];
        data[..bytes.len()].copy_from_slice(bytes);
        CanFrame {
            header: Header::new(arrived_ns, ""),
            id: self.frame.id() & MAX_EXTENDED_ID,
            is_rtr: false,
            is_extended: self.frame.is_extended(),
            is_error: false,
            dlc: bytes.len() as u8,
            data,
        }
    }

    /// `Err` says what is wrong with the message.
    pub(crate) fn from_message(
        at_ns: u64,
        direction: Direction,
        message: &CanFrame,
    ) -> Result<Self, String> {
        let CanFrame { id, dlc, data, .. } = message;
        if message.is_rtr || message.is_error {
            return Err("only data frames are recorded".into());
        }
        let data = data
            .get(..usize::from(*dlc))
            .ok_or_else(|| format!("a frame has at most 8 bytes, not {dlc}"))?;
        // The mark is a field of its own in a message.
        let marked = if message.is_extended { id | EXTENDED } else { *id };
        let frame = Frame::new(marked, data).filter(|frame| frame.id() & MAX_EXTENDED_ID == *id);
        let bits = if message.is_extended { 29 } else { 11 };
        let frame =
            frame.ok_or_else(|| format!("an identifier has at most {bits} bits, not {id:#x}"))?;
        Ok(Self { at_ns, direction, frame })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_survives_its_message() {
        let ids = [0x580, EXTENDED | 0x580];
        for (id, direction) in ids.into_iter().zip([Direction::ToDevice, Direction::ToHost]) {
            let frame = Frame::new(id, &[1, 2, 3]).unwrap();
            let frame = BusFrame { at_ns: 7, direction, frame };
            assert_eq!(BusFrame::from_message(7, direction, &frame.to_message(5)), Ok(frame));
        }
    }

    #[test]
    fn what_is_no_frame_of_this_bus_is_refused() {
        let frame = Frame::new(0x580, &[1, 2, 3]).unwrap();
        let good = BusFrame { at_ns: 7, direction: Direction::ToHost, frame }.to_message(7);
        let refused = |change: fn(&mut CanFrame)| {
            let mut message = good.clone();
            change(&mut message);
            BusFrame::from_message(7, Direction::ToHost, &message).unwrap_err()
        };
        assert!(refused(|m| m.dlc = 9).contains("at most 8 bytes, not 9"));
        assert!(refused(|m| m.id = 0x800).contains("0x800"));
        assert!(refused(|m| m.id = 0x1_0100).contains("0x10100"));
        assert!(refused(|m| m.id = EXTENDED | 0x100).contains("11 bits"));
        let long = refused(|m| (m.id, m.is_extended) = (0x2000_0000, true));
        assert!(long.contains("29 bits, not 0x20000000"), "{long}");
        assert!(refused(|m| m.is_rtr = true).contains("data frames"));
    }
}
