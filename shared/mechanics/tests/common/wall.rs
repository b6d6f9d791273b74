//! Vessels with a known wall, stored as a device would store them.

use cathforce_mechanics::{FREE, Lumen, LumenHeader};

/// A lumen with the bytes that it reads.
pub struct StoredWall {
    header: LumenHeader,
    bytes: Vec<u8>,
}

impl StoredWall {
    /// No wall anywhere.
    pub fn none() -> Self {
        let header = LumenHeader {
            origin_m: [-1.0; 3],
            cell_m: 1e-2,
            distance_unit_m: 1e-6,
            bricks: [50; 3],
            stored: 0,
        };
        Self { header, bytes: FREE.to_le_bytes().repeat(50 * 50 * 50) }
    }

    pub fn lumen(&self) -> Lumen<'_> {
        Lumen::new(self.header, &self.bytes).unwrap()
    }
}
