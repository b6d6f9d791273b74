//! `cargo xtask test`: everything, in the order in which it fails fastest.

use cathforce_link::qemu::FIRMWARE_VARIABLE;

use crate::shell::{cargo, command, output, root, run, target_folder};
use crate::{build, citations, demo, disk, gates, guest, layers, promises, setup};

pub fn run_all(consent: setup::Consent) -> anyhow::Result<()> {
    disk::warn();
    setup::rust(consent)?;
    run(&mut cargo(&["fmt", "--all", "--check"]))?;
    layers::check(&build::metadata()?)?;
    promises::check(root())?;
    citations::check(root())?;
    run(&mut cargo(&["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))?;
    let elf = setup::everything(consent)?;
    guest::ensure(consent)?;
    run(cargo(&["clippy"])
        .args(build::FIRMWARE)
        .args(["--", "-D", "warnings"])
        .env_remove("RUSTFLAGS"))?;
    // Tests of the emulated board are tests like any other; they boot this firmware.
    let has_nextest = output(command("cargo").args(["nextest", "--version"])).is_some();
    let runner: &[&str] =
        if has_nextest { &["nextest", "run", "--workspace"] } else { &["test", "--workspace"] };
    run(cargo(runner).arg("--no-run"))?;
    // With the tests stands the program that they run; the gates do not need a second, faster one.
    let out = target_folder().join("demo");
    std::fs::create_dir_all(&out)?;
    let program = target_folder().join("debug/cathforce");
    gates::check(&demo::play(&program, &elf, &out)?)?;
    let mut tests = cargo(runner);
    if has_nextest {
        // Tests of the emulated board and of the buses wait for frames; another one uses that time.
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        tests.args(["--test-threads", &(processors + 1).to_string()]);
    }
    run(tests.arg("--no-fail-fast").env(FIRMWARE_VARIABLE, elf))
}
