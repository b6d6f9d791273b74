//! Building what runs elsewhere than in tests.

use std::path::PathBuf;

use anyhow::Context;

use crate::shell::{cargo, command, output, root, run, target_folder};

/// Where the firmware runs.
pub const TARGET: &str = "thumbv7em-none-eabihf";

/// What cargo is told about the firmware.
pub const FIRMWARE: [&str; 6] =
    ["--package", "cathforce-firmware", "--target", TARGET, "--profile", "firmware"];

/// Builds the firmware, says how large it is, and gives its ELF.
pub fn firmware() -> anyhow::Result<PathBuf> {
    // Flags from outside replace those of .cargo/config.toml, and the processor with them.
    run(cargo(&["build"]).args(FIRMWARE).env_remove("RUSTFLAGS"))?;
    let elf = target_folder().join(TARGET).join("firmware/cathforce-firmware");
    if let Some(sections) = sections(&elf) {
        println!("{sections}");
    }
    Ok(elf)
}

/// The `cathforce` program, as people use it.
pub fn host() -> anyhow::Result<PathBuf> {
    run(&mut cargo(&["build", "--release", "--package", "cathforce"]))?;
    Ok(target_folder().join("release/cathforce"))
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
