//! Devices for tests.

use cathforce_link::qemu::Qemu;
use cathforce_link::{Link, Sim};

/// A device and the link to it. A real board would be another implementation.
pub trait Rig: Link + Sized {
    /// Switches the device on, without a configuration.
    fn boot() -> Self;
}

/// The firmware on the emulated board.
impl Rig for Qemu {
    fn boot() -> Self {
        Self::boot(None).unwrap_or_else(|error| panic!("{error}"))
    }
}

/// The device's code in this process.
impl Rig for Sim {
    fn boot() -> Self {
        Self::new()
    }
}
