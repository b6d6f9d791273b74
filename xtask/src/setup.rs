//! Installing what is missing, having said so.

use std::io::{BufRead, IsTerminal, Write};
use std::path::Path;
use std::process::Command;

use anyhow::{Context, bail};
use clap::Args;

use crate::shell::{command, output, run};
use crate::{build, emulator};

/// Debian's suite with an emulator whose clocks are right.
pub const BACKPORTS: &str = "bookworm-backports";
const SOURCE_FILE: &str = "/etc/apt/sources.list.d/cathforce-backports.list";
const MIRROR: &str = "http://deb.debian.org/debian";
/// Of `rust-toolchain.toml`, beside the firmware's target.
const COMPONENTS: [&str; 3] = ["clippy", "rustfmt", "llvm-tools"];

/// Whether things may be installed without asking.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct Consent {
    /// Install what is missing without asking.
    #[arg(long)]
    yes: bool,
}

impl Consent {
    /// Asks for `what`, unless the answer is known: `--yes`, root, or `CI` set.
    pub fn to(self, what: &str) -> anyhow::Result<()> {
        println!("Missing; I will run: {what}");
        if self.yes || is_root() || std::env::var_os("CI").is_some() {
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

fn is_root() -> bool {
    output(command("id").arg("-u")).is_some_and(|id| id.trim() == "0")
}

/// Rust's components, the emulator, and the firmware that tests it. Gives the firmware.
pub fn everything(consent: Consent) -> anyhow::Result<std::path::PathBuf> {
    rust(consent)?;
    let elf = build::firmware()?;
    emulator::ensure(&elf, || install_emulator(consent))?;
    Ok(elf)
}

/// What `rust-toolchain.toml` asks for. Where there is no rustup, cargo's own messages tell.
pub fn rust(consent: Consent) -> anyhow::Result<()> {
    let Some(missing) = missing_rust() else { return Ok(()) };
    if missing.is_empty() {
        return Ok(());
    }
    consent
        .to(&format!("rustup toolchain install --no-self-update (for {})", missing.join(", ")))?;
    run(rustup().args(["toolchain", "install", "--no-self-update"]))?;
    match missing_rust() {
        Some(still) if !still.is_empty() => bail!(
            "rustup ended well, yet {} is not installed; try `rustup toolchain uninstall {}` \
             and `cargo xtask setup` again",
            still.join(", "),
            output(rustup().args(["show", "active-toolchain"])).unwrap_or_default().trim(),
        ),
        _ => Ok(()),
    }
}

/// Parts of Rust that the project needs and this machine lacks; `None` without a rustup.
fn missing_rust() -> Option<Vec<&'static str>> {
    let installed = [["target", "list", "--installed"], ["component", "list", "--installed"]]
        .map(|words| output(rustup().args(words)));
    let [targets, components] = installed;
    let (targets, components) = (targets?, components.unwrap_or_default());
    let has = |list: &str, name: &str| list.lines().any(|line| line.starts_with(name));
    let target = (!has(&targets, build::TARGET)).then_some(build::TARGET);
    let components = COMPONENTS.into_iter().filter(|name| !has(&components, name));
    Some(target.into_iter().chain(components).collect())
}

/// rustup as a shell in the workspace would start it. Its cargo tells every child which
/// toolchain it runs, and rustup then no longer reads `rust-toolchain.toml`.
fn rustup() -> Command {
    let mut rustup = command("rustup");
    rustup.env_remove("RUSTUP_TOOLCHAIN");
    rustup
}

/// QEMU from Debian's backports; elsewhere the user is told what is needed.
fn install_emulator(consent: Consent) -> anyhow::Result<()> {
    let release = std::fs::read_to_string("/etc/os-release").unwrap_or_default();
    if !release.lines().any(|line| line == "VERSION_CODENAME=bookworm") {
        bail!(
            "install QEMU 10.0 or later with the Arm system emulator \
             (Debian, Ubuntu: `sudo apt-get install qemu-system-arm`; Fedora: \
             `sudo dnf install qemu-system-arm-core`; macOS: `brew install qemu`), then try again"
        );
    }
    as_root(
        consent,
        &format!(
            "{}apt-get update && apt-get install -y --no-install-recommends -t {BACKPORTS} \
             qemu-system-arm",
            add_backports()
        ),
    )
}

/// The beginning of a script that needs Debian's backports.
pub fn add_backports() -> String {
    match Path::new(SOURCE_FILE).exists() {
        true => String::new(),
        false => format!("echo 'deb {MIRROR} {BACKPORTS} main' > {SOURCE_FILE} && "),
    }
}

/// Runs a shell script as root, if that is allowed.
pub fn as_root(consent: Consent, script: &str) -> anyhow::Result<()> {
    let words = match is_root() {
        true => vec!["sh", "-c", script],
        false => vec!["sudo", "sh", "-c", script],
    };
    consent.to(&format!("{} \"{script}\"", words[..words.len() - 1].join(" ")))?;
    let (program, arguments) = words.split_first().context("a program")?;
    run(command(program).args(arguments).env("DEBIAN_FRONTEND", "noninteractive"))
}
