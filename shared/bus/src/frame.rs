//! One frame, and its direction.

/// Largest 11-bit identifier.
pub const MAX_ID: u32 = 0x7FF;
/// Largest 29-bit identifier, without [`EXTENDED`].
pub const MAX_EXTENDED_ID: u32 = 0x1FFF_FFFF;
/// Marks an identifier of 29 bits, as SocketCAN and a DBC do: 0x123 of 11 bits and 0x123 of 29 bits are two
/// identifiers.
pub const EXTENDED: u32 = 1 << 31;

/// Whether a frame can have this identifier: one of 11 bits, or one of 29 bits with [`EXTENDED`].
pub const fn is_id(id: u32) -> bool {
    id <= MAX_ID || id & EXTENDED != 0 && id & !EXTENDED <= MAX_EXTENDED_ID
}

/// Direction of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    ToDevice,
    ToHost,
}

/// A classic CAN data frame with an identifier of 11 or 29 bits: at most 8 bytes.
///
/// All frames of this protocol have 11 bits. Those of a robot's master may have 29.
#[derive(Clone, Copy, PartialEq, Eq, Default)]
pub struct Frame {
    id: u32,
    len: u8,
    /// Bytes past `len` are zero, so that equality compares the data only.
    data: [u8; 8],
}

impl Frame {
    /// `None` if it is no identifier ([`is_id`]) or the data have more than 8 bytes.
    pub fn new(id: u32, data: &[u8]) -> Option<Self> {
        let mut bytes = [0; 8];
        bytes.get_mut(..data.len())?.copy_from_slice(data);
        is_id(id).then_some(Self { id, len: data.len() as u8, data: bytes })
    }

    /// A frame of 8 bytes; only the low 11 bits of the identifier are used.
    pub(crate) const fn full(id: u32, data: [u8; 8]) -> Self {
        Self { id: id & MAX_ID, len: 8, data }
    }

    /// The identifier; one of 29 bits has [`EXTENDED`] added.
    pub const fn id(&self) -> u32 {
        self.id
    }

    /// Whether the identifier has 29 bits.
    pub const fn is_extended(&self) -> bool {
        self.id & EXTENDED != 0
    }

    /// Largest number of bits on the bus, from the start bit to the interframe space.
    ///
    /// There are 44 + 3 bits besides the data, 20 more with an identifier of 29 bits. Of the bits before the CRC
    /// delimiter, the first stuff bit needs five equal ones, and each further one four.
    pub const fn most_bits(&self) -> u32 {
        let data = 8 * self.len as u32;
        let longer = if self.is_extended() { 20 } else { 0 };
        data + 47 + longer + (34 + longer + data - 1) / 4
    }

    /// The data, 0 to 8 bytes.
    pub fn data(&self) -> &[u8] {
        // `len` is at most 8 by construction; the fallback only avoids a panic.
        self.data.get(..usize::from(self.len)).unwrap_or(&self.data)
    }
}

/// The digits of an identifier, in the notation of candump: three, or eight if it has 29 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IdDigits(pub u32);

impl core::fmt::Display for IdDigits {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.0 & EXTENDED {
            0 => write!(f, "{:03X}", self.0),
            _ => write!(f, "{:08X}", self.0 & MAX_EXTENDED_ID),
        }
    }
}

/// In the notation of candump: `100#0102030405060708`, and with an identifier of 29 bits `00000100#01`.
impl core::fmt::Display for Frame {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{}#", IdDigits(self.id))?;
        self.data().iter().try_for_each(|byte| write!(f, "{byte:02X}"))
    }
}

impl core::fmt::Debug for Frame {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        core::fmt::Display::fmt(self, f)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::format;

    #[test]
    fn only_what_fits_on_the_bus_becomes_a_frame() {
        assert!(Frame::new(0x800, &[]).is_none());
        assert!(Frame::new(0x100, &[0; 9]).is_none());
        let frame = Frame::new(0x7FF, &[1, 0xAB]).unwrap();
        assert_eq!((frame.id(), frame.data()), (0x7FF, &[1, 0xAB][..]));
        assert_eq!(format!("{frame}"), "7FF#01AB");
        let long = Frame::new(EXTENDED | 0x1234, &[2]).unwrap();
        assert_eq!((long.id(), format!("{long}")), (EXTENDED | 0x1234, "00001234#02".into()));
        assert!(long.is_extended() && !frame.is_extended());
        assert!(Frame::new(EXTENDED | 0x2000_0000, &[]).is_none());
        assert!(Frame::new(0x1_0123, &[]).is_none(), "29 bits without the mark");
        // What the literature gives for 0 and for 8 bytes, and for 29 bits.
        assert_eq!(Frame::new(EXTENDED, &[0; 8]).unwrap().most_bits(), 160);
        assert_eq!(Frame::new(0, &[]).unwrap().most_bits(), 55);
        assert_eq!(Frame::new(0, &[0; 8]).unwrap().most_bits(), 135);
    }
}
