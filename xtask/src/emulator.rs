//! The emulator must count time right; that is measured, not read off a version.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, bail};

use crate::build::FIRMWARE_VARIABLE;
use crate::consent::Consent;
use crate::shell::{command, output};
use crate::{packages, progress};

/// The emulator of the board.
pub const PROGRAM: &str = "qemu-system-arm";

/// The command that installs the emulator, if there is none.
pub fn missing(consent: Consent) -> anyhow::Result<Option<Command>> {
    match output(command(PROGRAM).arg("--version")) {
        Some(_) => Ok(None),
        None => install(consent).map(Some),
    }
}

/// Lets the firmware measure the emulator; installs another one if it is wrong, and measures again.
pub fn ensure(program: &Path, elf: &Path, consent: Consent) -> anyhow::Result<()> {
    let Err(problem) = measure(program, elf) else { return Ok(()) };
    println!("{problem:#}");
    progress::run(&mut install(consent)?)?;
    measure(program, elf)
}

/// `cathforce doctor --link qemu` opens the link, which refuses an emulator whose clocks are wrong.
fn measure(program: &Path, elf: &Path) -> anyhow::Result<()> {
    let mut doctor = command(program);
    doctor.args(["doctor", "--link", "qemu"]).env(FIRMWARE_VARIABLE, elf);
    let measured = doctor.output().with_context(|| program.display().to_string())?;
    if !measured.status.success() {
        let [said, error] = [measured.stdout, measured.stderr];
        let text = [said, error].map(|text| String::from_utf8_lossy(&text).into_owned()).concat();
        bail!("{PROGRAM} is refused:\n{}", text.trim_end());
    }
    println!("{PROGRAM} boots the firmware, and its clocks are right.");
    Ok(())
}

/// QEMU from Debian's backports; elsewhere the user is told what is needed.
fn install(consent: Consent) -> anyhow::Result<Command> {
    if !packages::is_bookworm() {
        bail!(
            "install QEMU 10.0 or later with the Arm system emulator \
             (Debian, Ubuntu: `sudo apt-get install qemu-system-arm`; Fedora: \
             `sudo dnf install qemu-system-arm-core`; macOS: `brew install qemu`), then try again"
        );
    }
    let script = packages::install_from_backports("qemu-system-arm")?;
    packages::as_root(consent, &script)
}
