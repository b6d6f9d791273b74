//! Building what runs elsewhere than in tests.

use std::path::PathBuf;
use std::process::Command;

use anyhow::Context;

use crate::arguments::{Choice, Given};
use crate::consent::{self, Consent};
use crate::shell::{cargo, command, output, root, target_folder};
use crate::{progress, setup};

/// Where the firmware runs.
pub const TARGET: &str = "thumbv7em-none-eabihf";

/// Tells `cathforce` which firmware the emulated board boots.
pub const FIRMWARE_VARIABLE: &str = "CATHFORCE_FIRMWARE";

/// What cargo is told about the firmware.
pub const FIRMWARE: [&str; 6] =
    ["--package", "cathforce-firmware", "--target", TARGET, "--profile", "firmware"];

/// What cargo is told about the firmware of the Nucleo besides.
pub const NUCLEO: [&str; 2] = ["--features", "board-nucleo-h743"];

/// Tells the tests where the firmware of the Nucleo is.
pub const NUCLEO_FIRMWARE_VARIABLE: &str = "CATHFORCE_NUCLEO_FIRMWARE";

/// Cargo's profile for a first run.
pub const QUICK: &str = "quick";

pub const FIRMWARE_OPTIONS: [Choice; 2] = [
    Choice {
        name: "id-base",
        value: Some("BASE"),
        about: "Move the identifiers to 29 bits whose upper 18 are BASE, such as 0x12345.",
    },
    consent::YES,
];

/// Tells the firmware's build where its identifiers lie on the bus.
const ID_BASE: &str = "CATHFORCE_ID_BASE";

/// Builds the firmware of both boards and says how large it is.
pub fn both_boards(given: &Given) -> anyhow::Result<()> {
    setup::firmware_target(Consent::of(given))?;
    let base = given.value("id-base");
    for mut build in [firmware_command(), nucleo_firmware_command()] {
        build.env_remove(ID_BASE);
        if let Some(base) = base {
            build.env(ID_BASE, base);
        }
        progress::run(&mut build)?;
    }
    say_how_large(&firmware_elf());
    say_how_large(&nucleo_firmware_elf());
    if let Some(base) = base {
        println!("Reach it by a link that ends in `,id-base={}`.", base.to_string_lossy());
    }
    Ok(())
}

/// Builds the firmware, says how large it is, and gives its ELF.
pub fn firmware() -> anyhow::Result<PathBuf> {
    progress::run(&mut firmware_command())?;
    let elf = firmware_elf();
    say_how_large(&elf);
    Ok(elf)
}

fn say_how_large(elf: &std::path::Path) {
    if let Some(sections) = sections(elf) {
        println!("{sections}");
    }
}

/// The command that builds the firmware of the Nucleo. It has a target folder of its own, because both
/// boards' ELFs have the same name.
pub fn nucleo_firmware_command() -> Command {
    let mut build = firmware_command();
    build.args(NUCLEO).arg("--target-dir").arg(nucleo_folder());
    build
}

/// Where [`nucleo_firmware_command`] leaves the firmware.
pub fn nucleo_firmware_elf() -> PathBuf {
    nucleo_folder().join(TARGET).join("firmware/cathforce-firmware")
}

fn nucleo_folder() -> PathBuf {
    target_folder().join("nucleo-h743")
}

/// The command that builds the firmware.
pub fn firmware_command() -> Command {
    let mut build = cargo(&["build"]);
    // Flags from outside replace those of .cargo/config.toml, and the processor with them.
    build.args(FIRMWARE).env_remove("RUSTFLAGS").env_remove(ID_BASE);
    build
}

/// Where [`firmware_command`] leaves the firmware.
pub fn firmware_elf() -> PathBuf {
    target_folder().join(TARGET).join("firmware/cathforce-firmware")
}

/// The `cathforce` program, as people use it.
pub fn host() -> anyhow::Result<PathBuf> {
    progress::run(&mut cargo(&["build", "--release", "--package", "cathforce"]))?;
    Ok(target_folder().join("release/cathforce"))
}

/// The command that builds a `cathforce` without what takes long to build and the demo does not
/// need.
pub fn quick_host_command() -> Command {
    cargo(&["build", "--profile", QUICK, "--package", "cathforce", "--no-default-features"])
}

/// Where [`quick_host_command`] leaves the program.
pub fn quick_host_program() -> PathBuf {
    target_folder().join(QUICK).join("cathforce")
}

/// How large the sections of an ELF are.
fn sections(elf: &std::path::Path) -> Option<String> {
    output(command(tool("llvm-size")?).arg(elf))
}

/// One of the toolchain's own tools (`llvm-tools`).
pub fn tool(name: &str) -> Option<PathBuf> {
    let sysroot = output(command("rustc").args(["--print", "sysroot"]))?;
    let host = output(command("rustc").args(["--print", "host-tuple"]))?;
    let rustlib = PathBuf::from(sysroot.trim()).join("lib/rustlib");
    Some(rustlib.join(host.trim()).join("bin").join(name))
}

/// `cargo metadata`, of the workspace's own packages.
pub fn metadata() -> anyhow::Result<serde_json::Value> {
    let text = output(&mut cargo(&["metadata", "--format-version", "1", "--no-deps"]))
        .with_context(|| format!("`cargo metadata` failed in {}", root().display()))?;
    Ok(serde_json::from_str(&text)?)
}
