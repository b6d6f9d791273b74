//! Devices for tests.

use cathforce_link::qemu::Qemu;
use cathforce_link::{Link, Sim};

use crate::real_board::refuse_on_a_bench;

/// A device and the link to it: emulated, in this process, or a real board on a bench.
pub trait Rig: Link + Sized {
    /// Switches the device on, without a configuration unless it has saved one.
    fn boot() -> Self;

    /// The device after somebody has pressed its button.
    fn again(self) -> Self {
        panic!("{} has no button", self.name())
    }
}

/// The firmware on the emulated board.
impl Rig for Qemu {
    fn boot() -> Self {
        refuse_on_a_bench("the emulated board, whose ticks the test grants");
        Self::boot(None).unwrap_or_else(|error| panic!("{error}"))
    }
}

/// The device's code in this process.
impl Rig for Sim {
    fn boot() -> Self {
        refuse_on_a_bench("the device's code in this process");
        Self::new()
    }
}
