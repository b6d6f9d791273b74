//! Installing what is missing, having said so.

use std::process::Command;

use crate::consent::Consent;
use crate::shell::{command, output};
use crate::{build, emulator, guest, progress};

/// Components of Rust that only the suite needs.
const COMPONENTS: [&str; 3] = ["clippy", "rustfmt", "llvm-tools"];

/// Everything that any task needs.
pub fn all(consent: Consent) -> anyhow::Result<()> {
    suite_components(consent)?;
    let built = emulator_and_firmware(consent, &[])?;
    println!("{} builds, and {} boots it", built.elf.display(), emulator::PROGRAM);
    guest::prepare(consent)
}

/// What runs the example on the emulated board.
pub struct Board {
    pub program: std::path::PathBuf,
    pub elf: std::path::PathBuf,
}

/// The emulator, the firmware, and the program, built for a first run, that has measured both. `features`: what
/// the program needs beside.
pub fn emulator_and_firmware(consent: Consent, features: &[&str]) -> anyhow::Result<Board> {
    let mut jobs = vec![progress::Job::new("firmware", firmware_build(consent)?)];
    jobs.push(progress::Job::new("program", [build::quick_host_command(features)]));
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

/// Rust's libraries for these targets, and the tools that treat what is built.
pub fn targets(consent: Consent, targets: &[&str]) -> anyhow::Result<()> {
    suite_components(consent)?;
    let Some(installed) = installed("target") else { return Ok(()) };
    let missing: Vec<_> = targets.iter().copied().filter(|name| !has(&installed, name)).collect();
    match missing[..] {
        [] => Ok(()),
        _ => progress::run(&mut add(consent, "target", &missing)?),
    }
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

/// A nightly compiler with Miri, which no stable one has.
pub fn nightly_with_miri(consent: Consent) -> anyhow::Result<()> {
    let list = ["component", "list", "--installed", "--toolchain", "nightly"];
    let components = output(command("rustup").args(list)).unwrap_or_default();
    if has(&components, "miri") && has(&components, "rust-src") {
        return Ok(());
    }
    let words = "rustup toolchain install nightly --profile minimal --component miri,rust-src";
    consent.to(words)?;
    let mut rustup = command("rustup");
    rustup.args(words.split_whitespace().skip(1));
    progress::run(&mut rustup)
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
}
