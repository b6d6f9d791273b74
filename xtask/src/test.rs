//! `cargo xtask test`: everything, what fails fastest first.

use crate::build::FIRMWARE_VARIABLE;
use crate::progress::{Job, side_by_side};
use crate::setup::{self, Consent};
use crate::shell::{cargo, command, output, root, run, target_folder};
use crate::{build, citations, demo, disk, emulator, gates, guest, layers, promises};

pub fn run_all(consent: Consent) -> anyhow::Result<()> {
    disk::warn();
    setup::suite_components(consent)?;
    setup::firmware_target(consent)?;
    run(&mut cargo(&["fmt", "--all", "--check"]))?;
    layers::check(&build::metadata()?)?;
    promises::check(root())?;
    citations::check(root())?;
    guest::prepare(consent)?;
    if let Some(mut install) = emulator::missing(consent)? {
        run(&mut install)?;
    }
    // Cargo keeps the firmware in a folder of its own: neither waits for the other.
    let mut lints_of_firmware = cargo(&["clippy"]);
    lints_of_firmware.args(build::FIRMWARE).args(DENY_WARNINGS).env_remove("RUSTFLAGS");
    let host = Job::new("host", [lints(), lints_without_features()]);
    let firmware = Job::new("firmware", [build::firmware_command(), lints_of_firmware]);
    side_by_side(vec![host, firmware])?;
    let elf = build::firmware_elf();
    // Tests of the emulated board are tests like any other; they boot this firmware.
    let has_nextest = output(command("cargo").args(["nextest", "--version"])).is_some();
    let runner: &[&str] =
        if has_nextest { &["nextest", "run", "--workspace"] } else { &["test", "--workspace"] };
    run(cargo(runner).arg("--no-run"))?;
    // With the tests stands the program that they run; the gates do not need a second, faster one.
    let program = target_folder().join("debug/cathforce");
    guest::give(&program)?;
    emulator::ensure(&program, &elf, consent)?;
    let out = target_folder().join("demo");
    std::fs::create_dir_all(&out)?;
    gates::check(&demo::play(&program, &elf, &out)?)?;
    let mut tests = cargo(runner);
    if has_nextest {
        // Tests of the emulated board and of the buses wait for frames; another one uses that time.
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        tests.args(["--test-threads", &(processors + 1).to_string()]);
    }
    run(tests.arg("--no-fail-fast").env(FIRMWARE_VARIABLE, elf))
}

const DENY_WARNINGS: [&str; 3] = ["--", "-D", "warnings"];

fn lints() -> std::process::Command {
    let mut clippy = cargo(&["clippy", "--workspace", "--all-targets"]);
    clippy.args(DENY_WARNINGS);
    clippy
}

/// The program that the demo builds.
fn lints_without_features() -> std::process::Command {
    let mut clippy = cargo(&["clippy", "--package", "cathforce", "--no-default-features"]);
    clippy.args(DENY_WARNINGS);
    clippy
}
