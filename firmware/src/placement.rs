//! Where the identifiers lie on this board's bus.

use cathforce_bus::Placement;

/// Where the identifiers lie on this board's bus: `CATHFORCE_ID_BASE=0x12345 cargo xtask firmware` moves them to 29
/// bits. It is fixed when the firmware is built, so that a board never sends under two identifiers.
pub const PLACEMENT: Placement = match option_env!("CATHFORCE_ID_BASE") {
    None => Placement::UNMOVED,
    Some(base) => match Placement::read(base) {
        Some(placement) => placement,
        None => panic!("CATHFORCE_ID_BASE is a number from 0 to 0x3FFFF"),
    },
};
