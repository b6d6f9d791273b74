//! Does what was built run where there is no checkout?
//!
//! It is copied to a temporary folder, and each program gets an environment of its own, with nothing but
//! a search path in it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context, ensure};
use serde_json::Value;

use super::boards::BOARDS;
use super::files;
use crate::build;
use crate::shell::{command, output, root, run};

/// How long the demo may take \[s\].
const DEMO_S: f64 = 60.0;

/// Checks the folder and the Debian package; says what was found.
pub fn check(out: &Path, with_demo: bool) -> anyhow::Result<String> {
    knows_no_checkout(out)?;
    let mut said = vec![is_static(&out.join("bin/cathforce"))?];
    let place = Temporary::new()?;
    let copy = place.0.join("copy");
    files::copy(out, &copy)?;
    ensure!(
        alone("sha256sum", &copy)
            .args(["--check", "--quiet", "--strict", "SHA256SUMS"])
            .status()?
            .success(),
        "SHA256SUMS does not agree with the files"
    );
    said.push(format!(
        "SHA256SUMS: {} files agree",
        fs::read_to_string(copy.join("SHA256SUMS"))?.lines().count()
    ));
    for board in BOARDS.iter().filter(|board| board.is_emulated) {
        said.push(as_it_says(&copy, &board.file().with_extension("elf"))?);
    }
    if with_demo {
        let program = copy.join("bin/cathforce");
        said.push(demo(&program, &place.0.join("demo"))?);
        said.push(debian(out, &place.0)?);
    }
    Ok(said.join("\n"))
}

/// No file holds the path of this checkout.
fn knows_no_checkout(out: &Path) -> anyhow::Result<()> {
    let path = root().to_string_lossy().into_owned();
    let found = files::that_hold(out, path.as_bytes())?;
    ensure!(found.is_empty(), "the path {path} of this checkout is in {found:?}");
    Ok(())
}

/// A program that needs no library has no interpreter.
fn is_static(program: &Path) -> anyhow::Result<String> {
    let tool = build::tool("llvm-readobj").context("rustc names no folder of its own")?;
    let text = output(command(tool).arg("--program-headers").arg(program));
    let text = text.context("llvm-readobj cannot read the program")?;
    ensure!(!text.contains("PT_INTERP"), "{} is not static", program.display());
    let mib = program.metadata()?.len() as f64 / f64::from(1 << 20);
    Ok(format!("bin/cathforce: static, {mib:.1} MiB"))
}

/// What the firmware's file says of itself is what the firmware says when it runs.
fn as_it_says(copy: &Path, elf: &Path) -> anyhow::Result<String> {
    let program = copy.join("bin/cathforce");
    let json = |arguments: &[&str]| -> anyhow::Result<Value> {
        let out = alone(&program, copy).args(arguments).stderr(Stdio::inherit()).output()?;
        ensure!(out.status.success(), "`cathforce {}` failed", arguments.join(" "));
        Ok(serde_json::from_slice(&out.stdout)?)
    };
    let file = elf.to_string_lossy();
    let said = json(&["info", "--json", &file])?;
    let link = format!("qemu:{file}");
    let runs = json(&["info", "--json", "--link", &link])?;
    let text = |value: &Value, key: &str| value[key].as_str().unwrap_or_default().to_owned();
    let whole = format!("{}+{}", text(&said, "version"), text(&said, "build"));
    for (what, stated, found) in [
        ("board", text(&said, "board"), text(&runs, "board")),
        ("firmware", whole.clone(), text(&runs, "firmware")),
        ("image schema", text(&said, "image_schema"), text(&runs, "image_schema")),
    ] {
        ensure!(stated == found, "{file}: it says {what} {stated}, and runs as {found}");
    }
    Ok(format!("{file}: {whole} for {}, as the running board says", text(&said, "board")))
}

fn demo(program: &Path, folder: &Path) -> anyhow::Result<String> {
    let began = Instant::now();
    let parent = folder.parent().context("it lies in a folder")?;
    let mut demo = alone(program, parent);
    eprintln!("\n▶ cathforce demo, from {}", program.display());
    ensure!(demo.args(["demo", "--out"]).arg(folder).status()?.success(), "the demo failed");
    let seconds = began.elapsed().as_secs_f64();
    for name in ["run.mcap", "summary.json", "ticks.csv", "nodes.csv", "report.html"] {
        ensure!(folder.join(name).is_file(), "the demo wrote no {name}");
    }
    // A computer that does other things meanwhile takes longer, which is no fault of the program.
    let judged = if seconds > DEMO_S { "MORE THAN" } else { "at most" };
    Ok(format!(
        "demo from {}: {seconds:.0} s, {judged} the {DEMO_S} s it may take",
        program.display()
    ))
}

/// Installs the package below a folder of its own, and runs the program from there.
fn debian(out: &Path, place: &Path) -> anyhow::Result<String> {
    let deb =
        files::list(out)?.into_iter().find(|path| path.extension().is_some_and(|e| e == "deb"));
    let deb = deb.context("there is no package")?;
    run(command("dpkg-deb").arg("--info").arg(&deb))?;
    let system = place.join("system");
    fs::create_dir_all(system.join("var/lib/dpkg/updates"))?;
    fs::create_dir_all(system.join("var/lib/dpkg/info"))?;
    fs::write(system.join("var/lib/dpkg/status"), "")?;
    let mut install = command("dpkg");
    install
        .arg(format!("--root={}", system.display()))
        .args(["--force-not-root", "--log=/dev/null"]);
    run(install.arg("--install").arg(&deb))?;
    let mut verify = command("dpkg");
    verify.arg(format!("--root={}", system.display()));
    run(verify.args(["--verify", "cathforce"]))?;
    let program = system.join("usr/bin/cathforce");
    let version = output(alone(&program, place).arg("--version"));
    let version = version.context("the installed program does not start")?;
    let found = demo(&program, &place.join("demo-of-the-package"))?;
    Ok(format!("Debian package: {} installed; {found}", version.lines().next().unwrap_or_default()))
}

/// A program in an environment of its own.
fn alone(program: impl AsRef<std::ffi::OsStr>, folder: &Path) -> Command {
    let mut command = Command::new(program);
    command.current_dir(folder).stdin(Stdio::null()).env_clear();
    command.env("PATH", "/usr/local/bin:/usr/bin:/bin");
    command
}

/// A folder outside of the checkout that goes with its owner.
struct Temporary(PathBuf);

impl Temporary {
    fn new() -> anyhow::Result<Self> {
        let folder = std::env::temp_dir().join(format!("cathforce-dist-{}", std::process::id()));
        fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        Ok(Self(folder))
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        // What stays is in the system's folder for temporary files.
        let _ = fs::remove_dir_all(&self.0);
    }
}
