//! `cargo xtask wheel`: the Python package as one wheel, with the program in it.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use crate::build;
use crate::consent::Consent;
use crate::shell::{command, output, root, run, target_folder};

/// Builds wheels; another version may lay them out differently.
const MATURIN: &str = "maturin==1.16.0";

/// Builds program and library as people use them; says where the wheel is, and returns it.
pub fn build(consent: Consent) -> anyhow::Result<PathBuf> {
    let maturin = maturin(consent)?;
    let program = build::host()?;
    let package = root().join("host/python");
    let beside = package.join("python/cathforce/bin");
    let out = target_folder().join("wheels");
    std::fs::create_dir_all(&beside).with_context(|| beside.display().to_string())?;
    let name = program.file_name().unwrap_or_default();
    std::fs::copy(&program, beside.join(name)).with_context(|| program.display().to_string())?;
    let mut wheel = command(maturin);
    wheel
        .args(["build", "--release", "--strip", "--manifest-path"])
        .arg(package.join("Cargo.toml"));
    wheel.arg("--out").arg(&out);
    let built = run(&mut wheel);
    // A package that is installed from its folder would take a program that has grown old.
    std::fs::remove_dir_all(&beside).with_context(|| beside.display().to_string())?;
    built?;
    let wheel = newest(&out)?;
    println!("\npip install {}", wheel.display());
    Ok(wheel)
}

fn newest(folder: &Path) -> anyhow::Result<PathBuf> {
    let wheels = std::fs::read_dir(folder)?.flatten().map(|entry| entry.path());
    let wheels = wheels.filter(|path| path.extension().is_some_and(|ending| ending == "whl"));
    let newest = wheels.max_by_key(|path| path.metadata().and_then(|of| of.modified()).ok());
    newest.with_context(|| format!("no wheel in {}", folder.display()))
}

fn maturin(consent: Consent) -> anyhow::Result<PathBuf> {
    let venv = target_folder().join("tools/maturin");
    let own = venv.join("bin/maturin");
    let said = output(command(&own).arg("--version")).unwrap_or_default();
    if said.trim().replace("maturin ", "maturin==") == MATURIN {
        return Ok(own);
    }
    if output(command("python3").args(["-m", "venv", "--help"])).is_none() {
        bail!(
            "a wheel needs Python 3.10 or later with `venv`\n  fix: on Debian and Ubuntu, `sudo apt-get \
             install python3-venv`"
        );
    }
    consent.to(&format!("python3 -m venv {} and pip install {MATURIN} in it", venv.display()))?;
    run(command("python3").args(["-m", "venv", "--clear"]).arg(&venv))?;
    let pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", MATURIN];
    run(command(venv.join("bin/python")).args(pip))?;
    Ok(own)
}
