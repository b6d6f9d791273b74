//! Software of unknown provenance in the firmware: every package of others, with the reason for it.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use anyhow::bail;

use crate::dist::boards;
use crate::dist::sources::Package;

/// What the project's own crates use of others: purpose, and why it is trusted. A package that is only
/// used by one of these comes with it.
const DIRECT: &[(&str, &str, &str)] = &[
    (
        "cortex-m",
        "registers and instructions of the processor",
        "of the Rust embedded working group; thin; what it does shows on the emulated board",
    ),
    (
        "cortex-m-rt",
        "memory layout and start of the program",
        "of the Rust embedded working group; every boot of the suite runs it",
    ),
    (
        "crc",
        "the checksums of frames, messages, images and the store",
        "compared with other implementations: `crc32fast`, `cantools` and a table of known values",
    ),
    (
        "critical-section",
        "the interface of a short section without interrupts",
        "of the Rust embedded working group; an interface, whose work `cortex-m` does",
    ),
    (
        "defmt",
        "the log, as numbers that the host makes text of",
        "writes into a ring and never waits; no result depends on it",
    ),
    (
        "embassy-executor",
        "runs the tasks below the tick",
        "widely used; a task that hangs resets the board (P11), and the tick does not run in it",
    ),
    (
        "embassy-stm32",
        "drivers of the STM32H743: clocks, FDCAN, flash, watchdog, timers, DAC",
        "widely used; no board has run it yet, and the control path does not go through it",
    ),
    (
        "embassy-sync",
        "queues between interrupts and tasks",
        "widely used; tests with full queues (P20), and a soak of hours (P25)",
    ),
    (
        "embedded-storage",
        "the interface of a flash",
        "an interface without code; the store is tested with power cuts at every word",
    ),
    (
        "embedded-can",
        "the interface to identifiers and frames of a CAN driver",
        "a few lines of types; an identifier of a wrong length is refused",
    ),
    (
        "heapless",
        "collections of fixed size",
        "of the Rust embedded working group; no panic of it is reachable from the control interrupt (P13)",
    ),
    (
        "libm",
        "square root, sine and cosine with the same bits everywhere",
        "of the Rust project, ported from musl; host and board are compared bit by bit (P22)",
    ),
    (
        "nalgebra",
        "small vectors and matrices",
        "used for products and sums alone; host and board are compared bit by bit (P22)",
    ),
    (
        "postcard",
        "the bytes of service messages and device images",
        "a published format; every bit flip of an image is refused (P16), and its decoder is fuzzed",
    ),
    (
        "postcard-schema",
        "the hash of the layout of messages and images",
        "runs while the firmware is compiled; a wrong hash refuses a connection and changes no number",
    ),
    (
        "serde",
        "the interface between types and their bytes",
        "the usual one in Rust; its code is made while the firmware is compiled",
    ),
    (
        "static_cell",
        "memory that is given out once",
        "a few lines around one flag; a second call would panic at boot, in every test",
    ),
    (
        "volatile-register",
        "access to registers of devices",
        "a few lines; every access shows on the emulated board",
    ),
];

/// The page's text.
pub fn text() -> anyhow::Result<String> {
    let packages = boards::packages()?;
    table(&packages)
}

fn table(packages: &[Package]) -> anyhow::Result<String> {
    let own = |package: &&Package| package.is_own();
    let direct: BTreeSet<_> = packages.iter().filter(own).flat_map(|p| &p.uses).cloned().collect();
    let linked: Vec<_> = packages.iter().filter(|p| p.is_linked && !p.is_own()).collect();
    let mut unsaid = Vec::new();
    let mut through: BTreeMap<(String, String), BTreeSet<&str>> = BTreeMap::new();
    for package in &linked {
        for used in &package.uses {
            through.entry(used.clone()).or_default().insert(&package.name);
        }
    }
    let mut text = format!(
        "The firmware of the two boards is linked from the project's own crates and from {} packages of others, which are \
         listed here with the version that `Cargo.lock` fixes by its checksum. `cargo xtask audit` checks \
         their licences and known vulnerabilities.\n\n## Used by the project itself\n\n\
         | package | version | licence | what for | why it is trusted |\n| --- | --- | --- | --- | --- |\n",
        linked.len()
    );
    let key = |package: &Package| (package.name.clone(), package.version.clone());
    for package in linked.iter().filter(|package| direct.contains(&key(package))) {
        let Package { name, version, licence, .. } = package;
        match DIRECT.iter().find(|(known, ..)| known == name) {
            None => unsaid.push(name.clone()),
            Some((_, purpose, trust)) => {
                let _ =
                    writeln!(text, "| `{name}` | {version} | {licence} | {purpose} | {trust} |");
            }
        }
    }
    if !unsaid.is_empty() {
        bail!(
            "xtask/src/pages/soup.rs does not say what these are for and why they are trusted: {}",
            unsaid.join(", ")
        );
    }
    text += "\n## Used by those\n\nThey are trusted as a part of the packages that use them, and are \
             tested with them.\n\n| package | version | licence | what it is | used by |\n\
             | --- | --- | --- | --- | --- |\n";
    for package in linked.iter().filter(|package| !direct.contains(&key(package))) {
        let Package { name, version, licence, description, .. } = package;
        let users = through.get(&key(package)).cloned().unwrap_or_default();
        let users: Vec<_> = users.into_iter().map(|user| format!("`{user}`")).collect();
        let what = description.trim_end_matches('.').replace('|', "\\|").replace(['<', '>'], "");
        let _ =
            writeln!(text, "| `{name}` | {version} | {licence} | {what} | {} |", users.join(", "));
    }
    let builds = packages.iter().filter(|package| !package.is_linked && !package.is_own());
    let builds: Vec<_> = builds.map(|p| format!("`{}` {}", p.name, p.version)).collect();
    let _ = writeln!(
        text,
        "\n## While it is compiled\n\n{} packages write code or scripts for the compiler and are not in the \
         firmware. The compiler itself is the one of `rust-toolchain.toml`. The packages are:\n\n{}",
        builds.len(),
        builds.join(", ")
    );
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn package(name: &str, checksum: Option<&str>, uses: &[&str]) -> Package {
        Package {
            name: name.into(),
            version: "1.0.0".into(),
            licence: "MIT".into(),
            description: format!("It is {name}."),
            repository: String::new(),
            folder: "/".into(),
            checksum: checksum.map(str::to_owned),
            is_linked: true,
            uses: uses.iter().map(|name| ((*name).to_owned(), "1.0.0".to_owned())).collect(),
        }
    }

    #[test]
    fn a_new_dependency_needs_a_reason_and_what_it_uses_names_its_user() {
        let mut packages = vec![
            package("own", None, &["crc"]),
            package("crc", Some("00"), &["tables"]),
            package("tables", Some("01"), &[]),
        ];
        let text = table(&packages).unwrap();
        assert!(text.contains("| `crc` | 1.0.0 | MIT | the checksums"), "{text}");
        assert!(text.contains("| `tables` | 1.0.0 | MIT | It is tables | `crc` |"), "{text}");
        packages[0].uses.insert(("new".into(), "1.0.0".into()));
        packages.push(package("new", Some("02"), &[]));
        let error = table(&packages).unwrap_err().to_string();
        assert!(error.ends_with("trusted: new"), "{error}");
    }
}
