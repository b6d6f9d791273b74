//! `cargo xtask accuracy`: the device's model against the reference solver.

use std::path::PathBuf;

use anyhow::Context;

use crate::figures;
use crate::shell::{cargo, command, output, root, run, target_folder};

const PACKAGE: &str = "cathforce-validation";
const BEGIN: &str = "<!-- cargo xtask validation -->\n";

/// Where the results go.
#[derive(clap::Args)]
pub struct Arguments {
    /// Also write rows and summary here.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Only write the cases and both solutions into this folder.
    #[arg(long, value_name = "FOLDER", conflicts_with = "json")]
    export: Option<PathBuf>,
    /// Only print what lifting one limit of the device does to the cases with this in their name.
    #[arg(long, value_name = "TEXT", conflicts_with_all = ["json", "export"])]
    causes: Option<String>,
    /// Only print how the cases with this in their name converge with the number of links, to 512.
    #[arg(long, value_name = "TEXT", conflicts_with_all = ["json", "export", "causes"])]
    links: Option<String>,
}

/// Measures every case and writes the table into docs/reference/validation.md; or exports the cases.
pub fn write(arguments: &Arguments) -> anyhow::Result<()> {
    run(&mut cargo(&["build", "--release", "--package", PACKAGE]))?;
    let mut program = command(target_folder().join("release").join(PACKAGE));
    if let Some(folder) = &arguments.export {
        return run(program.arg("--export").arg(std::path::absolute(folder)?));
    }
    if let Some(text) = &arguments.causes {
        return run(program.args(["--causes", "--only", text]));
    }
    if let Some(text) = &arguments.links {
        return run(program.args(["--links", "--only", text]));
    }
    if let Some(file) = &arguments.json {
        program.arg("--json").arg(std::path::absolute(file)?);
    }
    println!("measuring; this takes a minute or two");
    // Quiet, so that a failure has to be seen by running the program itself.
    let table = output(&mut program).with_context(|| {
        format!("measuring failed: `cargo run --release --package {PACKAGE}` says why")
    })?;
    let page = root().join("docs/reference/validation.md");
    figures::insert(&page, BEGIN, &table)?;
    println!("{table}\nwritten: {}", page.display());
    Ok(())
}
