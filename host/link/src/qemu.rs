//! The firmware on an emulated board.

use std::path::Path;

use crate::{Link, LinkError};

/// Boots the firmware in QEMU and links to its UART.
pub(crate) fn open(_elf: Option<&Path>) -> Result<Box<dyn Link>, LinkError> {
    Err(LinkError::Emulator {
        link: "qemu".into(),
        problem: "this build has no emulated board".into(),
        fix: "Use another link".into(),
    })
}
