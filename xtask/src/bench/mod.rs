//! `cargo xtask bench`: what the model costs and how it compares, measured in one run.

mod environments;
mod page;
mod peers;

use anyhow::Context;
use serde_json::Value;

use crate::arguments::{Choice, Given};
use crate::build::FIRMWARE_VARIABLE;
use crate::consent::{self, Consent};
use crate::figures::insert;
use crate::setup;
use crate::shell::{cargo, command, root, run, target_folder};

/// Where the README quotes the figures.
const BEGIN: &str = "<!-- cargo xtask bench -->\n";

pub const OPTIONS: [Choice; 5] = [
    Choice {
        name: "json",
        value: Some("FILE"),
        about: "Write the figures into this file too, as JSON.",
    },
    Choice {
        name: "without-peers",
        value: None,
        about: "Measure without the other simulators; docs and README stay as they are.",
    },
    Choice {
        name: "environments",
        value: None,
        about: "Measure instead the steps a second of the Gymnasium environment beside those of others.",
    },
    Choice {
        name: "wheel",
        value: Some("FILE"),
        about: "With --environments: the wheel to measure; built if it is not given.",
    },
    consent::YES,
];

/// Measures everything, then writes `docs/reference/benchmarks.md` and the README's table: a run that
/// fails changes neither.
pub fn measure(given: &Given) -> anyhow::Result<()> {
    given.at_most_one(&["environments", "json"])?;
    given.at_most_one(&["environments", "without-peers"])?;
    if given.has("environments") {
        return environments::measure(given);
    }
    anyhow::ensure!(!given.has("wheel"), "--wheel goes with --environments");
    let (json, consent) = (given.path("json")?, Consent::of(given));
    let elf = setup::emulator_and_firmware(consent, &[])?.elf;
    let python = match given.has("without-peers") {
        true => None,
        false => Some(peers::python(consent)?),
    };
    let build = ["build", "--release", "--package", "cathforce-bench"];
    run(&mut cargo(&build))?;
    let mut bench = command(target_folder().join("release/cathforce-bench"));
    bench.env(FIRMWARE_VARIABLE, elf);
    bench.args(python.iter().flat_map(|python| ["--python".as_ref(), python.as_os_str()]));
    let report = answer(&mut bench)?;
    let page = page::benchmarks(&report)?;
    print!("{page}");
    if let Some(file) = &json {
        std::fs::write(file, serde_json::to_string_pretty(&report)? + "\n")
            .with_context(|| file.display().to_string())?;
    }
    if python.is_some() {
        let docs = root().join("docs/reference/benchmarks.md");
        std::fs::write(&docs, page)?;
        insert(&root().join("README.md"), BEGIN, &page::summary(&report)?)?;
        println!("written: README.md, {}", docs.display());
    }
    Ok(())
}

/// What the program prints on its standard output; its progress is seen.
fn answer(bench: &mut std::process::Command) -> anyhow::Result<Value> {
    let output = bench.stderr(std::process::Stdio::inherit()).output()?;
    anyhow::ensure!(output.status.success(), "cathforce-bench failed ({})", output.status);
    Ok(serde_json::from_slice(&output.stdout)?)
}
