//! `cargo xtask demo`: the whole of it, once.

use std::path::{Path, PathBuf};

use crate::shell::{self, command, root, target_folder};
use crate::{build, setup};

/// The bundle that comes with the project.
pub const EXAMPLE: &str = "examples/tapered-none";
/// Its first trial is shorter than 10 s.
const TEN_SECONDS: [&str; 4] = ["--trial", "1", "--duration", "10"];

#[derive(clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    consent: setup::Consent,
    /// Write the table into this file too, as JSON.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Folder for recording, CSV and page; `target/demo` if not given.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let here = std::env::current_dir()?;
    let out = arguments.out.as_ref().map_or_else(|| target_folder().join("demo"), |o| here.join(o));
    std::fs::create_dir_all(&out)?;
    let elf = setup::everything(arguments.consent)?;
    let program = build::host()?;
    let summary = play(&program, &elf, &out)?;
    let recording = out.join("run.mcap");
    let page = out.join("report.html");
    run_host(&program, &elf, |c| {
        c.arg("export")
            .arg(&recording)
            .arg("--csv")
            .arg(out.join("ticks.csv"))
            .arg("--nodes")
            .arg(out.join("nodes.csv"))
            .arg("--overwrite")
    })?;
    run_host(&program, &elf, |c| c.arg("report").arg(&recording).arg("--html").arg(&page))?;
    if let Some(json) = &arguments.json {
        std::fs::copy(&summary, here.join(json))?;
    }
    println!("\n{EXAMPLE} was simulated by an independent simulator, not measured on a rig.");
    println!("Recording, CSV and page: {}", out.display());
    println!("Open {}", page.display());
    Ok(())
}

/// Plays the example on the emulated board; gives the summary's file.
pub fn play(program: &Path, elf: &Path, out: &Path) -> anyhow::Result<PathBuf> {
    let summary = out.join("summary.json");
    run_host(program, elf, |c| {
        c.args(["run", "--link", "qemu"])
            .arg(root().join(EXAMPLE))
            .args(TEN_SECONDS)
            .arg("--out")
            .arg(out.join("run.mcap"))
            .args(["--overwrite", "--summary"])
            .arg(&summary)
    })?;
    Ok(summary)
}

fn run_host(
    program: &Path,
    elf: &Path,
    arguments: impl FnOnce(&mut std::process::Command) -> &mut std::process::Command,
) -> anyhow::Result<()> {
    let mut command = command(program);
    command.env(cathforce_link::qemu::FIRMWARE_VARIABLE, elf);
    shell::run(arguments(&mut command))
}
