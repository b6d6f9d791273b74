//! The emulator must count time right; that is measured, not read off a version.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, bail};

use crate::build::FIRMWARE_VARIABLE;
use crate::consent::Consent;
use crate::shell::{self, command, output};
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

/// What `cathforce` ends with when a link cannot be opened: an emulator that is wrong is refused.
const REFUSED: i32 = 4;

/// Lets the firmware measure the emulator; installs another one if it is wrong, and measures again.
pub fn ensure(program: &Path, elf: &Path, consent: Consent) -> anyhow::Result<()> {
    let Some(problem) = refusal(program, elf)? else { return Ok(()) };
    println!("{problem}");
    progress::run(&mut install(consent)?)?;
    refusal(program, elf)?.map_or(Ok(()), |problem| bail!("{problem}"))
}

/// `cathforce doctor --link qemu` opens the link, which measures the emulator's clocks. Gives why
/// it was refused; an error has nothing to do with the emulator.
fn refusal(program: &Path, elf: &Path) -> anyhow::Result<Option<String>> {
    let mut doctor = command(program);
    doctor.args(["doctor", "--link", "qemu"]).env(FIRMWARE_VARIABLE, elf);
    let measured = doctor.output().with_context(|| program.display().to_string())?;
    let [said, error] = [measured.stdout, measured.stderr];
    let text = [said, error].map(|text| String::from_utf8_lossy(&text).into_owned()).concat();
    match measured.status.code() {
        Some(0) => {
            println!("{PROGRAM} boots the firmware, and its clocks are right.");
            Ok(None)
        }
        Some(REFUSED) => Ok(Some(format!("{PROGRAM} is refused:\n{}", text.trim_end()))),
        _ => bail!("`{}` failed ({}):\n{}", shell::line(&doctor), measured.status, text.trim_end()),
    }
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
