//! Installing what is missing, having said so.

use std::io::{BufRead, IsTerminal, Write};
use std::process::Command;

use anyhow::bail;

use crate::arguments::{Choice, Given};
use crate::shell::{command, output};
use crate::{build, emulator, guest, progress};

/// Of every task that may install something.
pub const YES: Choice =
    Choice { name: "yes", value: None, about: "Install what is missing without asking." };

/// Components of Rust that only the suite needs.
const COMPONENTS: [&str; 3] = ["clippy", "rustfmt", "llvm-tools"];

/// Whether things may be installed without asking.
#[derive(Clone, Copy, Debug)]
pub struct Consent {
    is_given: bool,
}

impl Consent {
    /// Given in advance by `--yes`, by root, or where `CI` is set.
    pub fn of(given: &Given) -> Self {
        Self { is_given: given.has(YES.name) || is_root() || std::env::var_os("CI").is_some() }
    }

    /// Asks for `what`, unless the answer is known.
    pub fn to(self, what: &str) -> anyhow::Result<()> {
        println!("Missing; I will run: {what}");
        if self.is_given {
            return Ok(());
        }
        if std::io::stdin().is_terminal() {
            print!("Go ahead? [y/N] ");
            std::io::stdout().flush()?;
            let mut answer = String::new();
            std::io::stdin().lock().read_line(&mut answer)?;
            if answer.trim().eq_ignore_ascii_case("y") {
                return Ok(());
            }
        }
        bail!("not installed. Run it yourself, or allow it with --yes:\n  {what}");
    }
}

pub fn is_root() -> bool {
    output(command("id").arg("-u")).is_some_and(|id| id.trim() == "0")
}

/// Everything that any task needs.
pub fn all(consent: Consent) -> anyhow::Result<()> {
    suite_components(consent)?;
    let built = emulator_and_firmware(consent)?;
    println!("{} builds, and {} boots it", built.elf.display(), emulator::PROGRAM);
    guest::prepare(consent)
}

/// What runs the example on the emulated board.
pub struct Board {
    pub program: std::path::PathBuf,
    pub elf: std::path::PathBuf,
}

/// The emulator, the firmware, and the program, built for a first run, that has measured both.
pub fn emulator_and_firmware(consent: Consent) -> anyhow::Result<Board> {
    let mut jobs = vec![progress::Job::new("firmware", firmware_build(consent)?)];
    jobs.push(progress::Job::new("program", [build::quick_host_command()]));
    if let Some(install) = emulator::missing(consent)? {
        jobs.push(progress::Job::new("QEMU", [install]));
    }
    progress::side_by_side(jobs)?;
    let board = Board { program: build::quick_host_program(), elf: build::firmware_elf() };
    emulator::ensure(&board.program, &board.elf, consent)?;
    Ok(board)
}

/// Builds the firmware, and before it, where it is missing, installs its target.
fn firmware_build(consent: Consent) -> anyhow::Result<Vec<Command>> {
    Ok(missing_target(consent)?.into_iter().chain([build::firmware_command()]).collect())
}

/// Rust's library for the firmware's processor.
pub fn firmware_target(consent: Consent) -> anyhow::Result<()> {
    missing_target(consent)?.map_or(Ok(()), |mut add| progress::run(&mut add))
}

/// The command that installs it, where there is a rustup and it is missing. Without rustup,
/// cargo's own messages tell.
fn missing_target(consent: Consent) -> anyhow::Result<Option<Command>> {
    let installed = installed("target");
    match installed.is_some_and(|installed| !has(&installed, build::TARGET)) {
        true => add(consent, "target", &[build::TARGET]).map(Some),
        false => Ok(None),
    }
}

/// The components that `cargo xtask test` needs.
pub fn suite_components(consent: Consent) -> anyhow::Result<()> {
    let Some(installed) = installed("component") else { return Ok(()) };
    let missing: Vec<_> = COMPONENTS.into_iter().filter(|name| !has(&installed, name)).collect();
    match missing[..] {
        [] => Ok(()),
        _ => progress::run(&mut add(consent, "component", &missing)?),
    }
}

/// What rustup has installed of a kind, a line each.
fn installed(kind: &str) -> Option<String> {
    output(command("rustup").args([kind, "list", "--installed"]).args(of_toolchain()))
}

fn has(installed: &str, name: &str) -> bool {
    installed.lines().any(|line| line.starts_with(name))
}

/// Adds to the toolchain that runs this program; `rustup toolchain install` would fetch all of
/// its components again.
fn add(consent: Consent, kind: &str, names: &[&str]) -> anyhow::Result<Command> {
    let toolchain = of_toolchain();
    let words = ["rustup", kind, "add"].into_iter().chain(names.iter().copied());
    let words: Vec<_> = words.chain(toolchain.iter().map(String::as_str)).collect();
    consent.to(&words.join(" "))?;
    let mut rustup = command(words[0]);
    rustup.args(&words[1..]);
    Ok(rustup)
}

/// `--toolchain NAME`, as rustup's cargo tells its children.
fn of_toolchain() -> Vec<String> {
    let name = std::env::var("RUSTUP_TOOLCHAIN").ok();
    name.into_iter().flat_map(|name| ["--toolchain".to_owned(), name]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn installed_parts_are_told_by_their_beginning() {
        let components = "clippy-x86_64-unknown-linux-gnu\nrust-std-thumbv7em-none-eabihf\n";
        assert!(has(components, "clippy"));
        assert!(!has(components, "rustfmt"));
    }

    #[test]
    fn nothing_is_installed_unasked() {
        // A test has no terminal to ask on.
        let refused = Consent { is_given: false }.to("apt-get install qemu").unwrap_err();
        let text = refused.to_string();
        assert!(text.contains("--yes") && text.ends_with("apt-get install qemu"), "{text}");
        assert!(Consent { is_given: true }.to("true").is_ok());
    }
}
