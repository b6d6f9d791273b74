//! One frame, and its direction.

/// Largest 11-bit identifier.
pub const MAX_ID: u16 = 0x7FF;

/// Direction of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    ToDevice,
    ToHost,
}

/// A classic CAN data frame with an 11-bit identifier: at most 8 bytes.
#[derive(Clone, Copy, PartialEq, Eq, Default)]
pub struct Frame {
    id: u16,
    len: u8,
    /// Bytes past `len` are zero, so that equality compares the data only.
    data: [u8; 8],
}

impl Frame {
    /// `None` if the identifier needs more than 11 bits or the data more than 8 bytes.
    pub fn new(id: u16, data: &[u8]) -> Option<Self> {
        let mut bytes = [0; 8];
        bytes.get_mut(..data.len())?.copy_from_slice(data);
        (id <= MAX_ID).then_some(Self { id, len: data.len() as u8, data: bytes })
    }

    /// A frame of 8 bytes; only the low 11 bits of the identifier are used.
    pub(crate) const fn full(id: u16, data: [u8; 8]) -> Self {
        Self { id: id & MAX_ID, len: 8, data }
    }

    /// The 11-bit identifier.
    pub fn id(&self) -> u16 {
        self.id
    }

    /// Largest number of bits on the bus, from the start bit to the interframe space.
    ///
    /// There are 44 + 3 bits besides the data. Of the bits before the CRC delimiter, the first stuff bit
    /// needs five equal ones, and each further one four.
    pub const fn most_bits(&self) -> u32 {
        let data = 8 * self.len as u32;
        data + 47 + (34 + data - 1) / 4
    }

    /// The data, 0 to 8 bytes.
    pub fn data(&self) -> &[u8] {
        // `len` is at most 8 by construction; the fallback only avoids a panic.
        self.data.get(..usize::from(self.len)).unwrap_or(&self.data)
    }
}

/// In the notation of candump: `100#0102030405060708`.
impl core::fmt::Display for Frame {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{:03X}#", self.id)?;
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
        // What the literature gives for 0 and for 8 bytes.
        assert_eq!(Frame::new(0, &[]).unwrap().most_bits(), 55);
        assert_eq!(Frame::new(0, &[0; 8]).unwrap().most_bits(), 135);
    }
}
