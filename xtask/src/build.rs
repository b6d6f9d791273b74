//! Building what runs elsewhere than in tests.

use std::path::PathBuf;
use std::process::Command;

use anyhow::Context;

use crate::progress;
use crate::shell::{cargo, command, output, root, target_folder};

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

/// Tells the firmware's build where its identifiers lie on the bus.
pub const ID_BASE: &str = "CATHFORCE_ID_BASE";

/// Builds the firmware, says how large it is, and gives its ELF.
pub fn firmware() -> anyhow::Result<PathBuf> {
    progress::run(&mut firmware_command())?;
    let elf = firmware_elf();
    say_how_large(&elf);
    Ok(elf)
}

pub fn say_how_large(elf: &std::path::Path) {
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
/// need. `features`: what it needs beside.
pub fn quick_host_command(features: &[&str]) -> Command {
    let mut build = cargo(&["build", "--profile", QUICK, "--package", "cathforce"]);
    build.arg("--no-default-features").args(features.iter().flat_map(|own| ["--features", own]));
    build
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
