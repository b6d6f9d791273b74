//! The boards whose firmware is distributed. A new board is a line of [`BOARDS`].

use std::path::PathBuf;

use crate::build;

/// A board, by the name that its firmware reports.
pub struct Board {
    pub name: &'static str,
    /// What cargo is told, beside `build`.
    pub cargo: &'static [&'static str],
    /// Where cargo leaves the ELF, in its target folder.
    pub elf: &'static str,
    /// QEMU boots it, so that what the file says of itself is compared with what it says when it runs.
    pub is_emulated: bool,
}

pub static BOARDS: [Board; 1] = [Board {
    name: "mps2-an500",
    cargo: &build::FIRMWARE,
    elf: "thumbv7em-none-eabihf/firmware/cathforce-firmware",
    is_emulated: true,
}];

impl Board {
    /// The name of its file, without the ending.
    pub fn file(&self) -> PathBuf {
        PathBuf::from(format!("lib/cathforce/cathforce-firmware-{}", self.name))
    }
}
