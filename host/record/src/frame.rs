//! A frame as it crossed the bus, and its bytes in a recording.

use cathforce_bus::{Direction, Frame};

/// A frame, when and which way it crossed the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BusFrame {
    /// Virtual time in lock step, else the host's monotonic clock \[ns\].
    pub at_ns: u64,
    pub direction: Direction,
    pub frame: Frame,
}

/// Bytes that a frame takes in a recording.
pub(crate) const FRAME_BYTES: usize = 12;

/// What is wrong with the bytes of a recorded frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    #[error("a frame takes {FRAME_BYTES} bytes, this one has {0}")]
    Size(usize),
    #[error("the direction of a frame is 0 or 1, not {0}")]
    Direction(u8),
    #[error("a frame has at most 8 bytes, not {0}")]
    Length(u8),
    #[error("an identifier has at most 11 bits, not {0:#x}")]
    Id(u16),
}

impl BusFrame {
    /// direction u8 (0 to the device, 1 to the host) · length u8 · id u16 · 8 data bytes,
    /// little endian.
    pub(crate) fn to_bytes(self) -> [u8; FRAME_BYTES] {
        let mut bytes = [0; FRAME_BYTES];
        let data = self.frame.data();
        bytes[0] = match self.direction {
            Direction::ToDevice => 0,
            Direction::ToHost => 1,
        };
        bytes[1] = data.len() as u8;
        bytes[2..4].copy_from_slice(&self.frame.id().to_le_bytes());
        bytes[4..4 + data.len()].copy_from_slice(data);
        bytes
    }

    pub(crate) fn from_bytes(at_ns: u64, bytes: &[u8]) -> Result<Self, FrameError> {
        let &[direction, length, id_low, id_high, ref data @ ..] = bytes else {
            return Err(FrameError::Size(bytes.len()));
        };
        if bytes.len() != FRAME_BYTES {
            return Err(FrameError::Size(bytes.len()));
        }
        let direction = match direction {
            0 => Direction::ToDevice,
            1 => Direction::ToHost,
            other => return Err(FrameError::Direction(other)),
        };
        let id = u16::from_le_bytes([id_low, id_high]);
        let data = data.get(..usize::from(length)).ok_or(FrameError::Length(length))?;
        let frame = Frame::new(id, data).ok_or(FrameError::Id(id))?;
        Ok(Self { at_ns, direction, frame })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_survives_its_bytes() {
        for direction in [Direction::ToDevice, Direction::ToHost] {
            let frame = Frame::new(0x580, &[1, 2, 3]).unwrap();
            let frame = BusFrame { at_ns: 7, direction, frame };
            assert_eq!(BusFrame::from_bytes(7, &frame.to_bytes()), Ok(frame));
        }
    }

    #[test]
    fn each_wrong_byte_has_its_own_error() {
        let mut bytes = [0; FRAME_BYTES];
        assert_eq!(BusFrame::from_bytes(0, &bytes[..11]), Err(FrameError::Size(11)));
        assert_eq!(BusFrame::from_bytes(0, &[0; 13]), Err(FrameError::Size(13)));
        assert_eq!(BusFrame::from_bytes(0, &[]), Err(FrameError::Size(0)));
        bytes[1] = 9;
        assert_eq!(BusFrame::from_bytes(0, &bytes), Err(FrameError::Length(9)));
        bytes[1] = 8;
        bytes[3] = 8;
        assert_eq!(BusFrame::from_bytes(0, &bytes), Err(FrameError::Id(0x800)));
        bytes[0] = 2;
        assert_eq!(BusFrame::from_bytes(0, &bytes), Err(FrameError::Direction(2)));
    }
}
