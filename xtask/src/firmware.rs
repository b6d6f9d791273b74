//! `cargo xtask firmware`: the firmware of both boards.

use crate::arguments::{Choice, Given};
use crate::consent::{self, Consent};
use crate::{build, progress, setup};

pub const OPTIONS: [Choice; 2] = [
    Choice {
        name: "id-base",
        value: Some("BASE"),
        about: "Move the identifiers to 29 bits whose upper 18 are BASE, such as 0x12345.",
    },
    consent::YES,
];

/// Builds the firmware of both boards and says how large it is.
pub fn build(given: &Given) -> anyhow::Result<()> {
    setup::firmware_target(Consent::of(given))?;
    let base = given.value("id-base");
    for mut command in [build::firmware_command(), build::nucleo_firmware_command()] {
        if let Some(base) = base {
            command.env(build::ID_BASE, base);
        }
        progress::run(&mut command)?;
    }
    build::say_how_large(&build::firmware_elf());
    build::say_how_large(&build::nucleo_firmware_elf());
    if let Some(base) = base {
        println!("Reach it by a link that ends in `,id-base={}`.", base.to_string_lossy());
    }
    Ok(())
}
