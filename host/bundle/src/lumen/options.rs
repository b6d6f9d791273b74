//! Options of a lumen, and its bytes.

use cathforce_mechanics::LumenHeader;

/// Bytes of lumen that the device has room for.
pub const DEVICE_LUMEN_BYTES: usize = 2 << 20;
/// Part of it that is left for the rest of an image \[bytes\].
const HEAD_ROOM_BYTES: usize = 16 << 10;

/// How finely and how widely a lumen is stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LumenOptions {
    /// Grid spacing \[m\].
    pub cell_m: f64,
    /// Metres per unit of a stored distance; ± 32 767 of them must span the band and a brick.
    pub distance_unit_m: f64,
    /// Outer radius of the instrument \[m\].
    pub outer_radius_m: f64,
    /// Bricks that lie farther than this outside are not stored \[m\].
    pub outside_m: f64,
    /// Length over which the wall continues straight past an opening \[m\].
    pub past_opening_m: f64,
    /// Bricks with a larger error where an instrument touches get half the spacing \[m\].
    pub fine_above_m: f64,
    /// Largest size of the lumen up to which bricks are refined \[bytes\].
    pub room_bytes: usize,
}

impl LumenOptions {
    /// The options for an instrument of this outer radius \[m\] and this grid spacing \[m\].
    pub fn for_instrument(outer_radius_m: f64, cell_m: f64) -> Self {
        Self {
            cell_m,
            distance_unit_m: 0.25e-6,
            outer_radius_m,
            outside_m: 2.5e-3,
            past_opening_m: 4e-3,
            fine_above_m: 8e-6,
            room_bytes: DEVICE_LUMEN_BYTES - HEAD_ROOM_BYTES,
        }
    }

    /// Bricks that lie deeper than this inside the lumen are not stored \[m\].
    pub fn inside_m(&self) -> f64 {
        self.outer_radius_m + 1e-3
    }
}

/// Header and bytes of a lumen, as [`cathforce_mechanics::Lumen::new`] takes them.
#[derive(Clone, Debug, PartialEq)]
pub struct BuiltLumen {
    pub header: LumenHeader,
    pub bytes: Vec<u8>,
    /// Bricks that were refined, and bricks that had no room for that.
    pub fine: [usize; 2],
}
