//! What a program is made of: the packages that are linked into it, and those that build it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::Context;
use serde_json::Value;

use crate::shell::{cargo, line, output};

/// A package of the project or of others.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Package {
    pub name: String,
    pub version: String,
    /// SPDX expression.
    pub licence: String,
    pub description: String,
    pub repository: String,
    /// Its folder.
    pub folder: PathBuf,
    /// SHA-256 of the package in the registry; none for the project's own.
    pub checksum: Option<String>,
    /// Linked into the program; else it only takes part in building it.
    pub is_linked: bool,
    /// Names and versions of the packages that it uses, as far as they are a part of the whole.
    pub uses: BTreeSet<(String, String)>,
}

impl Package {
    pub fn is_own(&self) -> bool {
        self.checksum.is_none()
    }
}

/// What is built.
#[derive(Clone, Copy, Debug)]
pub struct Build<'a> {
    pub package: &'a str,
    pub target: &'a str,
    /// Features, as cargo is told them.
    pub features: &'a [&'a str],
}

/// All packages behind a program that is built in the checkout `root`, in the order of their names. They are
/// those that its `Cargo.lock` fixes.
pub fn behind(root: &Path, build: &Build<'_>) -> anyhow::Result<Vec<Package>> {
    let linked = tree(root, build, "normal,no-proc-macro")?;
    let all = tree(root, build, "normal,build")?;
    let metadata = metadata(root)?;
    let packages = metadata["packages"].as_array().context("cargo metadata names no packages")?;
    let mut by_id = BTreeMap::new();
    let mut found = BTreeMap::new();
    let checksums = checksums(&std::fs::read_to_string(root.join("Cargo.lock"))?);
    for value in packages {
        let text = |key: &str| value[key].as_str().unwrap_or_default().to_owned();
        let key = (text("name"), text("version"));
        by_id.insert(text("id"), key.clone());
        if !all.contains(&key) {
            continue;
        }
        let manifest = PathBuf::from(text("manifest_path"));
        let folder = manifest.parent().map(PathBuf::from).unwrap_or_default();
        // `/` between licences is an old spelling of OR.
        let licence = text("license").replace('/', " OR ").replace("  ", " ");
        let package = Package {
            name: key.0.clone(),
            version: key.1.clone(),
            licence,
            description: text("description").split_whitespace().collect::<Vec<_>>().join(" "),
            repository: text("repository"),
            folder,
            checksum: checksums.get(&key).cloned(),
            is_linked: linked.contains(&key),
            uses: BTreeSet::new(),
        };
        found.insert(key, package);
    }
    let nodes =
        metadata["resolve"]["nodes"].as_array().context("cargo metadata resolves nothing")?;
    for node in nodes {
        let id = node["id"].as_str().unwrap_or_default();
        let Some(package) = by_id.get(id).and_then(|key| found.get(key)).map(|p| p.name.clone())
        else {
            continue;
        };
        let key = by_id[id].clone();
        let used = node["deps"].as_array().into_iter().flatten();
        let used = used.filter(|dep| {
            let kinds = dep["dep_kinds"].as_array().into_iter().flatten();
            kinds.into_iter().any(|kind| kind["kind"].as_str() != Some("dev"))
        });
        let used = used.filter_map(|dep| by_id.get(dep["pkg"].as_str()?).cloned());
        let used: BTreeSet<_> = used.filter(|key| all.contains(key)).collect();
        debug_assert_eq!(package, key.0);
        if let Some(package) = found.get_mut(&key) {
            package.uses = used;
        }
    }
    let missing: Vec<_> = all.iter().filter(|key| !found.contains_key(key)).collect();
    anyhow::ensure!(missing.is_empty(), "cargo metadata does not know {missing:?}");
    Ok(found.into_values().collect())
}

/// Adds packages to others, in the order of their names.
pub fn merge(all: &mut Vec<Package>, more: Vec<Package>) {
    for package in more {
        let is_same = |p: &&mut Package| (&p.name, &p.version) == (&package.name, &package.version);
        match all.iter_mut().find(is_same) {
            Some(known) => {
                known.is_linked |= package.is_linked;
                known.uses.extend(package.uses);
            }
            None => all.push(package),
        }
    }
    all.sort();
}

/// Name and version of each package on these edges of the tree.
fn tree(root: &Path, build: &Build<'_>, edges: &str) -> anyhow::Result<BTreeSet<(String, String)>> {
    let mut command = cargo(&["tree", "--locked", "--prefix", "none", "--no-dedupe"]);
    command.args(["--package", build.package, "--target", build.target, "--edges", edges]);
    command.args(["--format", "{p}"]).args(build.features).current_dir(root);
    let text = output(&mut command).with_context(|| format!("`{}` failed", line(&command)))?;
    let read = |line: &str| {
        let mut words = line.split_whitespace();
        let (name, version) = (words.next()?, words.next()?);
        Some((name.to_owned(), version.strip_prefix('v')?.to_owned()))
    };
    Ok(text.lines().filter_map(read).collect())
}

/// Of all platforms: build scripts run on another one than what they build is for.
fn metadata(root: &Path) -> anyhow::Result<Value> {
    let mut command = cargo(&["metadata", "--format-version", "1", "--locked"]);
    // What is not a part of the program is left out afterwards.
    command.arg("--all-features").current_dir(root);
    let text = output(&mut command).with_context(|| format!("`{}` failed", line(&command)))?;
    Ok(serde_json::from_str(&text)?)
}

/// The checksums of Cargo.lock, by name and version.
fn checksums(lock: &str) -> BTreeMap<(String, String), String> {
    let mut found = BTreeMap::new();
    for part in lock.split("[[package]]").skip(1) {
        let value = |key: &str| {
            let line = part.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(" = \""));
            line.and_then(|line| line.strip_suffix('"')).map(str::to_owned)
        };
        if let (Some(name), Some(version), Some(sum)) =
            (value("name"), value("version"), value("checksum"))
        {
            found.insert((name, version), sum);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_file_gives_the_checksums_of_the_registry() {
        let lock = "version = 4\n\n[[package]]\nname = \"a\"\nversion = \"1.0.0\"\nchecksum = \"ab\"\n\n\
                    [[package]]\nname = \"own\"\nversion = \"0.1.0\"\n";
        let found = checksums(lock);
        assert_eq!(found.len(), 1);
        assert_eq!(found[&("a".to_owned(), "1.0.0".to_owned())], "ab");
    }

    #[test]
    fn the_firmware_is_made_of_its_own_crates_and_of_locked_ones() {
        let build =
            Build { package: "cathforce-firmware", target: crate::build::TARGET, features: &[] };
        let packages = behind(crate::shell::root(), &build).unwrap();
        let find = |name: &str| packages.iter().find(|package| package.name == name).unwrap();
        assert!(find("cathforce-control").is_own() && find("cathforce-control").is_linked);
        let libm = find("libm");
        assert!(libm.is_linked && libm.checksum.as_ref().is_some_and(|sum| sum.len() == 64));
        // It writes code at build time and is not in the program.
        assert!(!find("serde_derive").is_linked);
        // Only tests of the shared crates use it.
        assert!(packages.iter().all(|package| package.name != "proptest"));
        assert!(
            find("cathforce-control").uses.iter().any(|(name, _)| name == "cathforce-mechanics")
        );
    }
}
