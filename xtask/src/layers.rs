//! Dependencies point one way, between crates and inside each of them
//! (`docs/explanation/architecture.md`).

mod circles;

use std::collections::BTreeSet;
use std::path::Path;

use anyhow::{Context, bail};
use serde_json::Value;

/// The packages that others may use, from the bottom up.
const LIBRARIES: [&str; 27] = [
    "cathforce-scalar",
    "cathforce-mechanics",
    "cathforce-control",
    "cathforce-bus",
    "cathforce-config",
    "cathforce-device",
    "cathforce-storage",
    "cathforce-bundle",
    "cathforce-effect-catalogue",
    "cathforce-link",
    "cathforce-recording",
    "cathforce-calibration",
    "cathforce-gap",
    "cathforce-reproduce",
    "cathforce-pages",
    "cathforce-dash",
    "cathforce-blind-test",
    "cathforce-material",
    "cathforce-sparse",
    "cathforce-wall",
    "cathforce-camera",
    "cathforce-mesh-files",
    "cathforce-filter",
    "cathforce-haptics",
    "cathforce-ultrasound",
    "cathforce-identification",
    "cathforce-test-fixture",
];

/// What runs on the device and on the host alike, the bus included.
const SHARED: &[&str] = LIBRARIES.split_at(7).0;

/// That and the bundles.
const SHARED_AND_RIG: &[&str] = LIBRARIES.split_at(8).0;

/// All but what only tests use.
const PRODUCT: &[&str] = LIBRARIES.split_at(LIBRARIES.len() - 1).0;

/// Each package and the packages of the project that it may use.
const ALLOWED: &[(&str, &[&str])] = &[
    ("cathforce-scalar", &[]),
    ("cathforce-mechanics", &["cathforce-scalar"]),
    ("cathforce-control", &["cathforce-mechanics"]),
    ("cathforce-bus", &[]),
    ("cathforce-config", &["cathforce-mechanics", "cathforce-control", "cathforce-bus"]),
    (
        "cathforce-device",
        &["cathforce-mechanics", "cathforce-control", "cathforce-bus", "cathforce-config"],
    ),
    ("cathforce-storage", &[]),
    ("cathforce-firmware", SHARED),
    ("cathforce-effect-catalogue", &["cathforce-mechanics"]),
    ("cathforce-bundle", &["cathforce-mechanics", "cathforce-config"]),
    ("cathforce-link", SHARED),
    ("cathforce-recording", SHARED_AND_RIG),
    ("cathforce-reference-solver", &[]),
    (
        "cathforce-gap",
        &[
            "cathforce-calibration",
            "cathforce-mechanics",
            "cathforce-effect-catalogue",
            "cathforce-bundle",
            "cathforce-recording",
        ],
    ),
    (
        "cathforce-pages",
        &[
            "cathforce-mechanics",
            "cathforce-config",
            "cathforce-recording",
            "cathforce-gap",
            "cathforce-reproduce",
        ],
    ),
    (
        "cathforce-dash",
        &[
            "cathforce-bundle",
            "cathforce-mechanics",
            "cathforce-control",
            "cathforce-bus",
            "cathforce-config",
            "cathforce-device",
            "cathforce-link",
            "cathforce-recording",
            "cathforce-pages",
        ],
    ),
    (
        "cathforce-validation",
        &["cathforce-mechanics", "cathforce-bundle", "cathforce-reference-solver"],
    ),
    (
        "cathforce-reproduce",
        &[
            "cathforce-mechanics",
            "cathforce-bundle",
            "cathforce-reference-solver",
            "cathforce-validation",
            "cathforce-material",
            "cathforce-wall",
            "cathforce-calibration",
            "cathforce-identification",
            "cathforce-ultrasound",
        ],
    ),
    ("cathforce-blind-test", &["cathforce-reference-solver"]),
    ("cathforce", PRODUCT),
    ("cathforce-material", &[]),
    ("cathforce-sparse", &[]),
    ("cathforce-wall", &["cathforce-material", "cathforce-sparse", "cathforce-bundle"]),
    ("cathforce-camera", &[]),
    ("cathforce-mesh-files", &["cathforce-bundle"]),
    ("cathforce-ultrasound", &["cathforce-calibration", "cathforce-material", "cathforce-wall"]),
    ("cathforce-filter", &[]),
    (
        "cathforce-haptics",
        &["cathforce-control", "cathforce-bus", "cathforce-config", "cathforce-device"],
    ),
    ("cathforce-calibration", &[]),
    (
        "cathforce-identification",
        &[
            "cathforce-mechanics",
            "cathforce-bundle",
            "cathforce-reference-solver",
            "cathforce-filter",
            "cathforce-calibration",
        ],
    ),
    (
        "cathforce-bench",
        &[
            "cathforce-mechanics",
            "cathforce-control",
            "cathforce-bus",
            "cathforce-bundle",
            "cathforce-link",
            "cathforce-reference-solver",
            "cathforce-validation",
        ],
    ),
    (
        "cathforce-python",
        &[
            "cathforce-mechanics",
            "cathforce-control",
            "cathforce-bus",
            "cathforce-config",
            "cathforce-effect-catalogue",
            "cathforce-bundle",
            "cathforce-recording",
        ],
    ),
    ("cathforce-test-fixture", &[]),
    ("cathforce-fuzz", PRODUCT),
    ("cathforce-hil-tests", &LIBRARIES),
    ("xtask", &[]),
];

/// Fails on a dependency that points the wrong way, on a package without a place, and on files or
/// folders of one crate that import each other in a circle.
pub fn check(metadata: &Value) -> anyhow::Result<()> {
    let mut violations = violations(metadata);
    violations.extend(circles_in(crate::shell::root())?);
    if !violations.is_empty() {
        bail!(
            "dependencies against docs/explanation/architecture.md:\n  {}",
            violations.join("\n  ")
        );
    }
    Ok(())
}

/// Circles in the sources of every crate below `root`.
fn circles_in(root: &Path) -> anyhow::Result<Vec<String>> {
    let mut found = Vec::new();
    for source in sources(root)? {
        let name = source.strip_prefix(root).unwrap_or(&source).display().to_string();
        for circle in circles::circles(&source)? {
            found.push(format!("{name}: {} import each other in a circle", circle.join(", ")));
        }
    }
    Ok(found)
}

/// The `src` folder of every crate: beside a `Cargo.toml`, at most two folders below `root`.
fn sources(root: &Path) -> anyhow::Result<Vec<std::path::PathBuf>> {
    let folders = |of: &Path| -> anyhow::Result<Vec<std::path::PathBuf>> {
        let entries = std::fs::read_dir(of).with_context(|| of.display().to_string())?;
        let paths = entries.map(|entry| Ok(entry?.path())).collect::<anyhow::Result<Vec<_>>>()?;
        Ok(paths.into_iter().filter(|path| path.is_dir() && !path.ends_with("target")).collect())
    };
    let mut found = Vec::new();
    for top in folders(root)? {
        for folder in std::iter::once(top.clone()).chain(folders(&top)?) {
            let source = folder.join("src");
            if folder.join("Cargo.toml").is_file() && source.is_dir() {
                found.push(source);
            }
        }
    }
    found.sort();
    Ok(found)
}

fn violations(metadata: &Value) -> Vec<String> {
    let packages = || metadata["packages"].as_array().into_iter().flatten();
    let ours: BTreeSet<&str> = packages().filter_map(|p| p["name"].as_str()).collect();
    let mut found = Vec::new();
    for package in packages() {
        let name = package["name"].as_str().unwrap_or_default();
        let Some((_, allowed)) = ALLOWED.iter().find(|(known, _)| *known == name) else {
            found.push(format!("{name} has no place in xtask/src/layers.rs"));
            continue;
        };
        // Tests may look further: only what is built into the package counts.
        let used = package["dependencies"].as_array().into_iter().flatten();
        let used = used.filter(|d| d["kind"].as_str() != Some("dev"));
        for used in used.filter_map(|d| d["name"].as_str()) {
            if ours.contains(used) && !allowed.contains(&used) {
                found.push(format!("{name} uses {used}"));
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn the_workspace_keeps_its_layers() {
        check(&crate::build::metadata().unwrap()).unwrap();
    }

    #[test]
    fn a_dependency_upwards_is_found() {
        let upwards = json!({ "packages": [
            { "name": "cathforce-bus", "dependencies": [{ "name": "cathforce-device", "kind": null }] },
            { "name": "cathforce-device", "dependencies": [{ "name": "cathforce-bus", "kind": null }] },
            { "name": "cathforce-new", "dependencies": [] },
        ]});
        let expected = [
            "cathforce-bus uses cathforce-device",
            "cathforce-new has no place in xtask/src/layers.rs",
        ];
        assert_eq!(violations(&upwards), expected);
    }
}
