//! `cargo xtask validation`: the device's model against the reference solver.

use anyhow::Context;

use crate::arguments::{Choice, Given};
use crate::figures;
use crate::shell::{cargo, command, output, root, run, target_folder};

const PACKAGE: &str = "cathforce-validation";
const BEGIN: &str = "<!-- cargo xtask validation -->\n";

/// Options that are tasks of their own.
const ALONE: [&str; 4] = ["json", "export", "causes", "links"];

pub const OPTIONS: [Choice; 4] = [
    Choice { name: "json", value: Some("FILE"), about: "Also write rows and summary here." },
    Choice {
        name: "export",
        value: Some("FOLDER"),
        about: "Only write the cases and both solutions into this folder.",
    },
    Choice {
        name: "causes",
        value: Some("TEXT"),
        about: "Only print what lifting one limit of the device does to the cases with this in their name.",
    },
    Choice {
        name: "links",
        value: Some("TEXT"),
        about: "Only print how the cases with this in their name converge with the number of links, to 512.",
    },
];

/// Measures every case and writes the table into docs/reference/validation.md; or exports the cases.
pub fn write(given: &Given) -> anyhow::Result<()> {
    given.at_most_one(&ALONE)?;
    run(&mut cargo(&["build", "--release", "--package", PACKAGE]))?;
    let mut program = command(target_folder().join("release").join(PACKAGE));
    if let Some(folder) = given.path("export")? {
        return run(program.arg("--export").arg(folder));
    }
    for what in ["causes", "links"] {
        if let Some(text) = given.value(what) {
            return run(program.arg(format!("--{what}")).arg("--only").arg(text));
        }
    }
    if let Some(file) = given.path("json")? {
        program.arg("--json").arg(file);
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
