//! A throw-away Python environment with the simulators that Cathforce is compared with.

use std::path::PathBuf;

use anyhow::{Context, bail};

use crate::consent::Consent;
use crate::shell::{command, output, root, run, target_folder};

const REQUIREMENTS: &str = "host/bench/peers/requirements.txt";

/// Python of an environment under `target/` that has exactly what the requirements name.
pub fn python(consent: Consent) -> anyhow::Result<PathBuf> {
    let wanted = root().join(REQUIREMENTS);
    let text = std::fs::read_to_string(&wanted).with_context(|| wanted.display().to_string())?;
    let folder = target_folder().join("bench/venv");
    let python = folder.join("bin/python");
    // Written last: an installation that broke off is begun anew.
    let installed = folder.join("installed.txt");
    if std::fs::read_to_string(&installed).is_ok_and(|installed| installed == text) {
        return Ok(python);
    }
    if output(command("python3").args(["-m", "venv", "--help"])).is_none() {
        bail!(
            "the other simulators need Python 3.10 or later with `venv` (Debian, Ubuntu: \
             `sudo apt-get install python3-venv`); {WITHOUT}"
        );
    }
    let packages = text.lines().filter(|line| !line.starts_with('#')).collect::<Vec<_>>();
    consent.to(&format!(
        "python3 -m venv {} and pip install {} in it",
        folder.display(),
        packages.join(" ")
    ))?;
    run(command("python3").args(["-m", "venv", "--clear"]).arg(&folder)).context(WITHOUT)?;
    run(command(&python)
        .args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r"])
        .arg(&wanted))
    .with_context(|| {
        format!("pip could not install {}: is there a network? {WITHOUT}", packages.join(", "))
    })?;
    std::fs::write(&installed, text)?;
    Ok(python)
}

const WITHOUT: &str = "`cargo xtask bench --without-peers` measures the rest";
