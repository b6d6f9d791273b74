//! `cargo xtask demo`: the whole of it, once.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::Context as _;

use crate::arguments::{Choice, Given};
use crate::build::FIRMWARE_VARIABLE;
use crate::consent::{self, Consent};
use crate::setup;
use crate::shell::{command, root, target_folder};
use crate::{build, progress};

/// The bundle that comes with the project.
pub const EXAMPLE: &str = "examples/tapered-none";
/// What shows an address to a person.
const OPENER: &str = if cfg!(target_os = "macos") { "open" } else { "xdg-open" };
/// Its first trial is shorter than 10 s.
const TEN_SECONDS: [&str; 4] = ["--trial", "1", "--duration", "10"];

pub const OPTIONS: [Choice; 4] = [
    Choice {
        name: "open",
        value: None,
        about: "Watch it live in a browser until Ctrl-C, instead of a recording and a page.",
    },
    Choice {
        name: "json",
        value: Some("FILE"),
        about: "Write the table into this file too, as JSON.",
    },
    Choice {
        name: "out",
        value: Some("DIR"),
        about: "Folder for recording, CSV and page; `target/demo` if not given.",
    },
    consent::YES,
];

pub fn run(given: &Given) -> anyhow::Result<()> {
    given.at_most_one(&["open", "json"])?;
    given.at_most_one(&["open", "out"])?;
    if given.has("open") {
        return watch(Consent::of(given));
    }
    let out = given.path("out")?.unwrap_or_else(|| target_folder().join("demo"));
    let json = given.path("json")?;
    std::fs::create_dir_all(&out)?;
    println!("{}", plan());
    let board = setup::emulator_and_firmware(Consent::of(given), &[])?;
    println!(
        "\nThe board is inserted for 10 s, tick by tick; that takes the emulator half a minute."
    );
    let summary = play(&board.program, &board.elf, &out)?;
    let recording = out.join("run.mcap");
    let page = out.join("report.html");
    let mut export = command(&board.program);
    export.arg("export").arg(&recording).arg("--csv").arg(out.join("ticks.csv"));
    progress::run(export.arg("--nodes").arg(out.join("nodes.csv")).arg("--overwrite"))?;
    let mut report = command(&board.program);
    progress::run(report.arg("report").arg(&recording).arg("--html").arg(&page))?;
    if let Some(json) = &json {
        std::fs::copy(&summary, json)?;
    }
    println!("\n{EXAMPLE} was simulated by an independent simulator, not measured on a rig.");
    println!("Recording, CSV and page: {}", out.display());
    println!("Open {}", page.display());
    Ok(())
}

/// Lets the example be played there and back, and opens the page that shows it.
fn watch(consent: Consent) -> anyhow::Result<()> {
    println!("The program is built with its web pages: some minutes the first time.\n");
    let board = setup::emulator_and_firmware(consent, &["dash"])?;
    let mut dash = command(&board.program);
    dash.args(["dash", "qemu", "--json", "--quiet", "--play", "--bundle"])
        .arg(root().join(EXAMPLE));
    dash.args(["--listen", "127.0.0.1:0"]).env(FIRMWARE_VARIABLE, &board.elf);
    let mut dash = dash.stdout(Stdio::piped()).spawn().context("the page cannot be served")?;
    let said = dash.stdout.take().context("its output is a pipe")?;
    // It goes on after this answer, so no end of the text is awaited.
    let said = serde_json::Deserializer::from_reader(said).into_iter::<serde_json::Value>().next();
    let address =
        said.and_then(Result::ok).and_then(|said| Some(said["address"].as_str()?.to_owned()));
    if let Some(address) = address {
        println!("\nWatch it at {address}; Ctrl-C ends it.");
        // Where there is no desktop, the address is all that is needed.
        let _ = command(OPENER).arg(&address).stderr(Stdio::null()).status();
    }
    let ended = dash.wait()?;
    anyhow::ensure!(ended.success(), "the page was no longer served ({ended})");
    Ok(())
}

/// What will be done and how long that takes.
fn plan() -> String {
    let is_built = build::quick_host_program().is_file() && build::firmware_elf().is_file();
    let building = match is_built {
        true => "built already; it takes seconds to see that nothing has changed",
        false => "about 3 minutes on 2 cores the first time",
    };
    format!(
        "1. Build the firmware and the host program, side by side: {building}.\n\
         2. Run a 10 s insertion of {EXAMPLE} on the emulated board: about a minute.\n\
         3. Write recording, CSV and a page to look at: seconds.\n"
    )
}

/// Plays the example on the emulated board; gives the summary's file.
pub fn play(program: &Path, elf: &Path, out: &Path) -> anyhow::Result<PathBuf> {
    let (mut run, summary) = example(program, elf, out);
    progress::run(&mut run)?;
    Ok(summary)
}

/// The command that plays it, and the file that the summary will be in.
pub fn example(program: &Path, elf: &Path, out: &Path) -> (Command, PathBuf) {
    let summary = out.join("summary.json");
    let mut run = command(program);
    run.args(["run", "--link", "qemu"]).arg(root().join(EXAMPLE)).args(TEN_SECONDS);
    run.arg("--out").arg(out.join("run.mcap")).args(["--overwrite", "--summary"]).arg(&summary);
    run.env(FIRMWARE_VARIABLE, elf);
    (run, summary)
}
