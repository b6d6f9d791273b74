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

/// Cargo's profile for a first run.
pub const QUICK: &str = "quick";

/// Builds the firmware, says how large it is, and gives its ELF.
pub fn firmware() -> anyhow::Result<PathBuf> {
    progress::run(&mut firmware_command())?;
    let elf = firmware_elf();
    if let Some(sections) = sections(&elf) {
        println!("{sections}");
    }
    Ok(elf)
}

/// The command that builds the firmware.
pub fn firmware_command() -> Command {
    let mut build = cargo(&["build"]);
    // Flags from outside replace those of .cargo/config.toml, and the processor with them.
    build.args(FIRMWARE).env_remove("RUSTFLAGS");
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
