//! `cargo xtask promises`: runs the tests behind the promises, and prints what is kept with which figure.

mod outcomes;
mod page;

use anyhow::{Context, bail};
use serde_json::{Value, json};

use crate::arguments::{Choice, Given};
use crate::build::{self, FIRMWARE_VARIABLE};
use crate::consent::{self, Consent};
use crate::setup;
use crate::shell::{cargo, line, root};

use outcomes::Outcomes;
use page::Promise;
pub use page::check;
#[cfg(test)]
pub use page::ids;

/// Asks the tests for another board than the emulated one (`hil-tests/src/real_board/wiring.rs`).
const RIG_VARIABLE: &str = "CATHFORCE_RIG";

pub const OPTIONS: [Choice; 3] = [
    Choice {
        name: "json",
        value: Some("FILE"),
        about: "Write id, kept, figure and tests of every promise into this file too.",
    },
    Choice { name: "only", value: Some("IDS"), about: "Only these promises, such as P10,P11." },
    consent::YES,
];

/// Runs the tests of the promises, prints the table, and fails if a promise is not kept.
pub fn run(given: &Given) -> anyhow::Result<()> {
    let json = given.path("json")?;
    if std::env::var_os(RIG_VARIABLE).is_some_and(|rig| rig == "bench") {
        bail!(
            "{RIG_VARIABLE}=bench: these tests run on the emulated board, and would not count on another\n  fix: unset \
             it; docs/how-to/bring-up-a-board.md has the tests for a real board"
        );
    }
    check(root())?;
    let promises = wanted(page::promises(root())?, given)?;
    setup::firmware_target(Consent::of(given))?;
    let elf = build::firmware()?;
    let mut names: Vec<_> =
        promises.iter().flat_map(|p| &p.tests).map(|test| function(test)).collect();
    names.sort_unstable();
    names.dedup();
    // The program that some of the tests start.
    crate::shell::run(&mut cargo(&["build", "--workspace", "--bin", "cathforce"]))?;
    let mut tests = cargo(&["test", "--workspace", "--no-fail-fast", "--"]);
    tests.arg("--show-output").args(&names).env(FIRMWARE_VARIABLE, elf);
    eprintln!("\n▶ cargo test of {} tests behind {} promises", names.len(), promises.len());
    let outcomes = Outcomes::of(&mut tests).with_context(|| line(&tests))?;
    let table: Vec<_> = promises.iter().map(|promise| row(promise, &outcomes)).collect();
    for row in &table {
        let kept = if row["kept"] == true { "kept" } else { "NOT KEPT" };
        let text = |key: &str| row[key].as_str().unwrap_or_default().to_owned();
        println!("{} {kept:<8} {}\n             {}", text("id"), text("promise"), text("figure"));
        for why in row["not"].as_array().into_iter().flatten().filter_map(Value::as_str) {
            println!("             {why}");
        }
    }
    if let Some(path) = json {
        let text = serde_json::to_string_pretty(&table)?;
        std::fs::write(&path, text + "\n").with_context(|| path.display().to_string())?;
    }
    let broken: Vec<_> = table.iter().filter(|row| row["kept"] != true).collect();
    if !broken.is_empty() {
        let ids: Vec<_> = broken.iter().filter_map(|row| row["id"].as_str()).collect();
        bail!("not kept: {}", ids.join(", "));
    }
    Ok(())
}

/// The promises that `--only` names.
fn wanted(all: Vec<Promise>, given: &Given) -> anyhow::Result<Vec<Promise>> {
    let Some(only) = given.value("only") else { return Ok(all) };
    let only = only.to_string_lossy();
    let ids: Vec<_> = only.split(',').map(str::trim).collect();
    if let Some(unknown) = ids.iter().find(|id| all.iter().all(|promise| promise.id != **id)) {
        bail!("--only {unknown}: docs/promises.md has no such promise");
    }
    Ok(all.into_iter().filter(|promise| ids.contains(&promise.id.as_str())).collect())
}

/// Name of a test's function.
fn function(test: &str) -> &str {
    test.rsplit("::").next().unwrap_or(test)
}

/// A promise is kept if it has tests and all of them have run and passed. Its figure is what they have
/// measured, or else the one of the page.
fn row(promise: &Promise, outcomes: &Outcomes) -> Value {
    let Promise { id, promise: text, mechanism, figure, tests } = promise;
    let not: Vec<_> = tests
        .iter()
        .filter_map(|test| match outcomes.passed(function(test)) {
            Some(true) => None,
            Some(false) => Some(format!("failed: {test}")),
            None => Some(format!("did not run: {test}")),
        })
        .collect();
    let measured = outcomes.figures(id);
    let figure = if measured.is_empty() { figure.clone() } else { measured.join("; ") };
    json!({
        "id": id,
        "promise": text,
        "mechanism": mechanism,
        "kept": !tests.is_empty() && not.is_empty(),
        "figure": figure,
        "tests": tests,
        "not": not,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_promise_without_a_test_or_with_one_that_failed_or_did_not_run_is_not_kept() {
        let outcomes = Outcomes::read(
            "test a::p01_good ... ok\ntest b::p01_bad ... FAILED\n\n---- a::p01_good stdout ----\n\
             figure P01: 24 ms\n",
        );
        let kept = |tests: &[&str]| {
            let promise = Promise {
                id: "P01".into(),
                promise: String::new(),
                mechanism: String::new(),
                figure: "25 ms".into(),
                tests: tests.iter().map(|test| (*test).to_owned()).collect(),
            };
            row(&promise, &outcomes)
        };
        let good = kept(&["x.rs::p01_good"]);
        assert_eq!((&good["kept"], &good["figure"]), (&json!(true), &json!("24 ms")));
        for tests in [&["x.rs::p01_good", "x.rs::p01_bad"][..], &["x.rs::p01_absent"], &[]] {
            assert_eq!(kept(tests)["kept"], false, "{tests:?}");
        }
    }
}
