//! `cargo xtask audit`: licences, sources and known vulnerabilities of what the project uses.
//!
//! It needs the network and a tool that takes minutes to build, so it is no part of the suite.

use anyhow::bail;

use crate::consent::Consent;
use crate::progress;
use crate::shell::{self, cargo, command, output, target_folder};

/// The tool's version: another one may read `deny.toml` differently.
const VERSION: &str = "0.20.2";

/// Checks everything that `deny.toml` asks for. Where the list of known vulnerabilities cannot be
/// fetched, the rest is checked all the same, and the result says what was left out.
pub fn run(consent: Consent) -> anyhow::Result<()> {
    let tool = tool(consent)?;
    let deny = |check: &[&str]| {
        let mut deny = command(&tool);
        deny.args(["check", "--hide-inclusion-graph"]).args(check);
        // It asks cargo for the dependencies.
        deny.env("CARGO", std::env::var_os("CARGO").unwrap_or("cargo".into()));
        deny
    };
    progress::run(&mut deny(&["licenses", "bans", "sources"]))?;
    let fetched = output(command(&tool).args(["fetch", "db"])).is_some();
    if !fetched {
        println!(
            "\nLicences, duplicates and sources are as `deny.toml` asks. NOT CHECKED: known \
             vulnerabilities.\n  why: the list of advisories could not be fetched\n  fix: try \
             again with a network that reaches https://github.com/rustsec/advisory-db"
        );
        return Ok(());
    }
    progress::run(&mut deny(&["advisories"]))
}

/// cargo-deny of [`VERSION`]: the one that is installed, or one built into the target folder.
fn tool(consent: Consent) -> anyhow::Result<std::path::PathBuf> {
    let tools = target_folder().join("tools");
    let own = tools.join("bin").join(format!("cargo-deny{}", std::env::consts::EXE_SUFFIX));
    let is_right = |program: &std::path::Path| {
        let version = output(command(program).arg("--version")).unwrap_or_default();
        version.trim() == format!("cargo-deny {VERSION}")
    };
    if let Some(right) = ["cargo-deny".into(), own.clone()].into_iter().find(|p| is_right(p)) {
        return Ok(right);
    }
    let folder = tools.display().to_string();
    let mut install = cargo(&["install", "cargo-deny", "--locked", "--version", VERSION]);
    install.args(["--root", &folder]);
    consent.to(&format!("{}   (some minutes)", shell::line(&install)))?;
    progress::run(&mut install)?;
    if !is_right(&own) {
        bail!("cargo-deny {VERSION} was installed into {folder}, yet it does not run");
    }
    Ok(own)
}
