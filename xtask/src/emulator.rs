//! The emulator must count time right; that is measured, not read off a version.

use std::path::Path;

use anyhow::bail;
use cathforce_link::qemu::{self, SelfTest};

/// Measures the emulator; if it is missing or wrong, `install`s one and measures again.
pub fn ensure(elf: &Path, install: impl FnOnce() -> anyhow::Result<()>) -> anyhow::Result<()> {
    match measure(elf) {
        Ok(()) => Ok(()),
        Err(problem) => {
            println!("{problem}");
            install()?;
            measure(elf)
        }
    }
}

fn measure(elf: &Path) -> anyhow::Result<()> {
    let measured = qemu::self_test(elf)?;
    let SelfTest { instructions, counter, timer } = measured;
    let expected = measured.expected_counts();
    if !measured.passed() {
        bail!(
            "{} is refused: its clocks are wrong. {instructions} instructions should take \
             {expected} counts of 40 ns; its counter gave {counter}, its timer {timer}",
            qemu::PROGRAM
        );
    }
    println!(
        "{}: {instructions} instructions take {counter} counts and {timer} of the tick timer, \
         as they should ({expected})",
        qemu::PROGRAM
    );
    Ok(())
}
