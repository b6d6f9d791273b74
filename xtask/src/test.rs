//! `cargo xtask test`: everything, in the order in which it fails fastest.

use cathforce_link::qemu::FIRMWARE_VARIABLE;

use crate::shell::{cargo, command, output, root, run, target_folder};
use crate::{build, demo, disk, gates, guest, layers, promises, setup};

pub fn run_all(consent: setup::Consent) -> anyhow::Result<()> {
    disk::warn();
    setup::rust(consent)?;
    run(&mut cargo(&["fmt", "--all", "--check"]))?;
    layers::check(&build::metadata()?)?;
    promises::check(root())?;
    run(&mut cargo(&["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))?;
    let elf = setup::everything(consent)?;
    guest::ensure(consent)?;
    run(cargo(&["clippy"])
        .args(build::FIRMWARE)
        .args(["--", "-D", "warnings"])
        .env_remove("RUSTFLAGS"))?;
    // Tests of the emulated board are tests like any other; they boot this firmware.
    let runner: &[&str] = match output(command("cargo").args(["nextest", "--version"])) {
        Some(_) => &["nextest", "run", "--workspace"],
        None => &["test", "--workspace"],
    };
    run(cargo(runner).arg("--no-run"))?;
    // With the tests stands the program that they run; the gates do not need a second, faster one.
    let out = target_folder().join("demo");
    std::fs::create_dir_all(&out)?;
    let program = target_folder().join("debug/cathforce");
    gates::check(&demo::play(&program, &elf, &out)?)?;
    run(cargo(runner).arg("--no-fail-fast").env(FIRMWARE_VARIABLE, elf))
}
