//! What makes the bytes of a slot an image.

use crate::CRC32;

/// Boots that a new image has to prove itself.
pub const TRIALS: usize = 3;
/// Length of a header \[bytes\].
pub const HEADER: usize = 32;
/// Where the image begins in its slot \[bytes\]: behind the header, a word for each trial and one that
/// confirms, for words of up to 32 bytes.
pub const IMAGE_OFFSET: u32 = 256;

const MAGIC: u32 = u32::from_le_bytes(*b"CFS1");

/// The header of a slot. It is written last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Rises with every image.
    pub generation: u32,
    /// Length of the image \[bytes\].
    pub len: u32,
    pub crc32: u32,
}

impl Header {
    /// As it is stored, filled up with zeros.
    pub fn bytes(self) -> [u8; HEADER] {
        let words = [MAGIC, self.generation, self.len, self.crc32];
        let mut bytes = [0; HEADER];
        for (place, word) in bytes.chunks_mut(4).zip(words) {
            place.copy_from_slice(&word.to_le_bytes());
        }
        let (front, sum) = bytes.split_at_mut(HEADER - 4);
        sum.copy_from_slice(&CRC32.checksum(front).to_le_bytes());
        bytes
    }

    /// `None` if any bit is wrong.
    pub fn read(bytes: &[u8; HEADER]) -> Option<Self> {
        let word = |i: usize| {
            let word = bytes.get(4 * i..4 * i + 4)?;
            Some(u32::from_le_bytes(word.try_into().ok()?))
        };
        let header = Self { generation: word(1)?, len: word(2)?, crc32: word(3)? };
        (header.bytes() == *bytes).then_some(header)
    }
}
