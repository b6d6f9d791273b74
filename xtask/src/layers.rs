//! Dependencies point one way, between crates and inside each of them
//! (`docs/explanation/architecture.md`).

mod circles;

use std::collections::BTreeSet;
use std::path::Path;

use anyhow::{Context, bail};
use serde_json::Value;

/// The packages that others may use, from the bottom up.
const LIBRARIES: [&str; 12] = [
    "cathforce-scalar",
    "cathforce-mechanics",
    "cathforce-control",
    "cathforce-bus",
    "cathforce-config",
    "cathforce-device",
    "cathforce-bundle",
    "cathforce-effect-catalogue",
    "cathforce-link",
    "cathforce-recording",
    "cathforce-gap",
    "cathforce-blind-test",
];

/// What runs on the device and on the host alike, the bus included.
const SHARED: &[&str] = LIBRARIES.split_at(6).0;

/// That and the bundles.
const SHARED_AND_RIG: &[&str] = LIBRARIES.split_at(7).0;

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
    ("cathforce-firmware", SHARED),
    ("cathforce-effect-catalogue", &["cathforce-mechanics"]),
    ("cathforce-bundle", &["cathforce-mechanics", "cathforce-config"]),
    ("cathforce-link", SHARED),
    ("cathforce-recording", SHARED_AND_RIG),
    ("cathforce-reference-solver", &[]),
    (
        "cathforce-gap",
        &[
            "cathforce-mechanics",
            "cathforce-effect-catalogue",
            "cathforce-bundle",
            "cathforce-recording",
        ],
    ),
    (
        "cathforce-validation",
        &["cathforce-mechanics", "cathforce-bundle", "cathforce-reference-solver"],
    ),
    ("cathforce-blind-test", &["cathforce-reference-solver"]),
    ("cathforce", &LIBRARIES),
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
    ("cathforce-hil-tests", &LIBRARIES),
    ("xtask", &[]),
];

/// Circles that are allowed for now, as `check` prints them. This list must be empty when the
/// branches that take them apart are merged.
const KNOWN_CIRCLES: &[&str] = &[
    "host/blind-test/src: make.rs, score.rs, seal.rs",
    "host/blind-test/src: play.rs, rigs.rs, world.rs",
    "host/bundle/src: bundle/, geometry/",
    "host/bundle/src: bundle/instrument.rs, bundle/plausible.rs, bundle/priors.rs, bundle/rig.rs, bundle/tendon.rs, bundle/toml_reader.rs, bundle/trial.rs, entry.rs, error.rs, geometry/centreline.rs, geometry/mesh.rs, geometry/openings.rs, geometry/pieces.rs, geometry/rims.rs, geometry/stitch.rs, geometry/stl.rs, geometry/stl_ascii.rs, geometry/weld.rs, table.rs",
    "host/bundle/src: lumen/build.rs, lumen/grid.rs, lumen/quality.rs",
    "host/cli/src: commands/, report/",
    "host/cli/src: commands/doctor.rs, commands/doctor/device.rs, commands/doctor/interface.rs",
    "host/cli/src: commands/gap/coverage.rs, commands/gap/diagnose.rs",
    "host/cli/src: commands/import.rs, commands/replay.rs, commands/run.rs",
    "host/cli/src: output/, settings/",
    "host/cli/src: settings/band.rs, settings/master.rs, settings/mod.rs, settings/parse.rs, settings/slip.rs",
    "host/effect-catalogue/src: drive.rs, instrument.rs, lib.rs, sensor.rs, vessel.rs",
    "host/gap/src: band.rs, descriptors/band.rs, descriptors/dwells.rs, descriptors/loops.rs, descriptors/mod.rs, descriptors/timing.rs, estimate.rs, figures.rs, left.rs, locate.rs, map.rs, report.rs, snaps.rs",
    "host/gap/src: catheter/defects.rs, catheter/mod.rs",
    "host/gap/src: catheter/prepare.rs, catheter/sensors.rs",
    "host/gap/src: criteria.rs, select.rs",
    "host/gap/src: page/charts.rs, page/map.rs, page/mod.rs, page/vessel.rs",
    "host/link/src: address.rs, error.rs, qemu.rs, sim.rs, slcan.rs, socketcan.rs",
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

/// Circles in the sources of every crate below `root`, and entries of [`KNOWN_CIRCLES`] that no
/// longer exist.
fn circles_in(root: &Path) -> anyhow::Result<Vec<String>> {
    let mut found = Vec::new();
    for source in sources(root)? {
        let name = source.strip_prefix(root).unwrap_or(&source).display().to_string();
        for circle in circles::circles(&source)? {
            found.push(format!("{name}: {}", circle.join(", ")));
        }
    }
    let gone = KNOWN_CIRCLES.iter().filter(|known| !found.iter().any(|circle| circle == *known));
    let gone: Vec<String> = gone.map(|known| format!("no longer a circle: {known}")).collect();
    found.retain(|circle| !KNOWN_CIRCLES.contains(&circle.as_str()));
    let found = found.into_iter().map(|circle| format!("{circle} import each other in a circle"));
    Ok(found.chain(gone).collect())
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
