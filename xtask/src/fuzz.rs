//! `cargo xtask fuzz` and `cargo xtask miri`: searches on request.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, bail, ensure};

use crate::arguments::{Choice, Given};
use crate::setup;
use crate::shell::{cargo, command, line, output, root, run, target_folder};

pub const OPTIONS: [Choice; 3] = [
    Choice {
        name: "minutes",
        value: Some("N"),
        about: "Time for all targets together; 60 if not given.",
    },
    Choice { name: "only", value: Some("NAMES"), about: "Only these targets, such as mesh,rig." },
    Choice { name: "list", value: None, about: "List the targets." },
];

pub const MIRI_OPTIONS: [Choice; 1] = [crate::consent::YES];

/// What libFuzzer needs to see which code an input reaches. They are cargo-fuzz's, without a sanitizer,
/// which would need a nightly compiler.
const COVERAGE: [&str; 8] = [
    "-Cpasses=sancov-module",
    "-Cllvm-args=-sanitizer-coverage-level=4",
    "-Cllvm-args=-sanitizer-coverage-inline-8bit-counters",
    "-Cllvm-args=-sanitizer-coverage-pc-table",
    "-Cllvm-args=-sanitizer-coverage-trace-compares",
    "-Ccodegen-units=1",
    "-Cdebug-assertions",
    "-Coverflow-checks",
];
/// An input that takes longer hangs, and one that needs more memory fills it.
const LONGEST_S: u32 = 30;
const MOST_MIB: u32 = 2048;
/// Inputs do not grow beyond it \[bytes\].
const MOST_BYTES: u32 = 1 << 16;
const DEFAULT_MINUTES: f64 = 60.0;
/// Crates of the shared code that Miri runs: those that need no instruction of the processor that it does
/// not know. The tests of mechanics take hours there.
const MIRI: [&str; 3] = ["cathforce-bus", "cathforce-storage", "cathforce-scalar"];

/// Runs each target for its share of the time, and prints executions and coverage.
pub fn search(given: &Given) -> anyhow::Result<()> {
    let targets = wanted(&names()?, given)?;
    if given.has("list") {
        targets.iter().for_each(|name| println!("{name}"));
        return Ok(());
    }
    let minutes = match given.value("minutes") {
        None => DEFAULT_MINUTES,
        Some(text) => {
            let text = text.to_string_lossy();
            let number = text.parse().ok().filter(|minutes: &f64| *minutes > 0.0);
            number.with_context(|| format!("--minutes {text}: give a number above 0"))?
        }
    };
    let fuzzer = built()?;
    let seconds = (60.0 * minutes / targets.len() as f64).ceil().max(1.0);
    println!(
        "{:<12} {:>12} {:>8} {:>9} {:>7}",
        "target", "executions", "seconds", "coverage", "found"
    );
    let mut crashes = Vec::new();
    for name in &targets {
        let found = searched(&fuzzer, name, seconds)?;
        let Found { executions, coverage, crash } = found;
        let sign = if crash.is_some() { "CRASH" } else { "none" };
        println!("{name:<12} {executions:>12} {seconds:>8} {coverage:>9} {sign:>7}");
        crashes.extend(crash.map(|file| format!("{name}: {}", file.display())));
    }
    if !crashes.is_empty() {
        bail!(
            "inputs that panic, hang or fill the memory:\n  {}\n  fix: mend the target and put the input \
             into fuzz/seeds/NAME",
            crashes.join("\n  ")
        );
    }
    Ok(())
}

/// The names of the folders with seeds, which a test of the targets holds to theirs.
fn names() -> anyhow::Result<Vec<String>> {
    let folder = root().join("fuzz/seeds");
    let entries = fs::read_dir(&folder).with_context(|| folder.display().to_string())?;
    let names = entries.map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()));
    let mut names = names.collect::<anyhow::Result<Vec<_>>>()?;
    names.sort();
    Ok(names)
}

fn wanted(all: &[String], given: &Given) -> anyhow::Result<Vec<String>> {
    let Some(only) = given.value("only") else { return Ok(all.to_vec()) };
    let only = only.to_string_lossy();
    let names: Vec<_> = only.split(',').map(|name| name.trim().to_owned()).collect();
    if let Some(unknown) = names.iter().find(|name| !all.contains(name)) {
        bail!("--only {unknown}: there is no such target; the targets are {}", all.join(", "));
    }
    Ok(names)
}

/// Builds the targets for libFuzzer, which needs a C++ compiler.
fn built() -> anyhow::Result<PathBuf> {
    ensure!(
        output(command("c++").arg("--version")).is_some(),
        "libFuzzer is built by a C++ compiler\n  fix: on Debian and Ubuntu, `apt-get install g++`"
    );
    let mut build = cargo(&["build", "--release"]);
    let host = output(command("rustc").args(["--print", "host-tuple"]));
    let host = host.context("rustc names no host")?.trim().to_owned();
    // With a target, the flags are not those of build scripts.
    build.args(["--target", &host, "--manifest-path", "fuzz/Cargo.toml"]);
    build.env("RUSTFLAGS", COVERAGE.join(" "));
    let target = target_folder().join("fuzz");
    build.env("CARGO_TARGET_DIR", &target);
    run(&mut build)?;
    Ok(target.join(host).join("release/any"))
}

struct Found {
    executions: u64,
    /// Edges of the code that were reached.
    coverage: u64,
    crash: Option<PathBuf>,
}

fn searched(fuzzer: &Path, name: &str, seconds: f64) -> anyhow::Result<Found> {
    let (corpus, artifacts) = (folder("corpus", name)?, folder("artifacts", name)?);
    let mut search = Command::new(fuzzer);
    search.current_dir(root()).stdin(Stdio::null()).env("CATHFORCE_FUZZ", name);
    search.args([corpus, root().join("fuzz/seeds").join(name)]);
    search.arg(format!("-artifact_prefix={}/", artifacts.display()));
    search.args([format!("-max_total_time={seconds}"), format!("-timeout={LONGEST_S}")]);
    search.args([format!("-rss_limit_mb={MOST_MIB}"), format!("-max_len={MOST_BYTES}")]);
    search.args(["-print_final_stats=1", "-verbosity=1"]);
    let ran = search.output().with_context(|| line(&search))?;
    let said = String::from_utf8_lossy(&ran.stderr).into_owned();
    let crash = said.lines().find_map(|line| line.split_once("Test unit written to "));
    if !ran.status.success() && crash.is_none() {
        bail!("the target {name} did not run:\n{said}");
    }
    Ok(Found {
        executions: number_after(&said, "stat::number_of_executed_units:").unwrap_or(0),
        coverage: number_after(&said, " cov:").unwrap_or(0),
        crash: crash.map(|(_, path)| PathBuf::from(path.trim())),
    })
}

fn folder(kind: &str, name: &str) -> anyhow::Result<PathBuf> {
    let folder = root().join("fuzz").join(kind).join(name);
    fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    Ok(folder)
}

/// The number after the last mark of this kind.
fn number_after(text: &str, mark: &str) -> Option<u64> {
    let (_, rest) = text.rsplit_once(mark)?;
    rest.split_whitespace().next()?.parse().ok()
}

/// Runs tests of the shared crates in Miri, which finds undefined behaviour.
pub fn miri(given: &Given) -> anyhow::Result<()> {
    setup::nightly_with_miri(crate::consent::Consent::of(given))?;
    for package in MIRI {
        let mut miri = command("cargo");
        miri.args(["+nightly", "miri", "test", "--lib", "--package", package]);
        // A toolchain that cargo has chosen for its children would be taken instead.
        miri.env_remove("RUSTUP_TOOLCHAIN").env_remove("CARGO").env_remove("RUSTC");
        miri.env("CARGO_TARGET_DIR", target_folder().join("miri"));
        // A property is tried with few cases: an instruction takes a thousand times as long.
        miri.env("PROPTEST_CASES", "4").env("MIRIFLAGS", "-Zmiri-disable-isolation");
        run(&mut miri)?;
    }
    println!("\nMiri found nothing in {}", MIRI.join(", "));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_number_of_libfuzzers_report_counts() {
        let said = "#2\tINITED cov: 5 ft: 6\n#9\tDONE   cov: 77 ft: 80\nstat::number_of_executed_units: 1234\n";
        assert_eq!(number_after(said, " cov:"), Some(77));
        assert_eq!(number_after(said, "stat::number_of_executed_units:"), Some(1234));
        assert_eq!(number_after(said, "stat::peak_rss_mb:"), None);
    }
}
