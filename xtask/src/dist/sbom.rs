//! A software bill of materials in the format CycloneDX 1.5.

use std::collections::BTreeSet;

use serde_json::{Value, json};

use super::sources::Package;

/// The bill of the program of `package`.
///
/// It has no serial number and no time, so that the same sources give the same bytes.
pub fn bill(package: &str, packages: &[Package]) -> Value {
    let subject = packages.iter().find(|p| p.name == package);
    let components: Vec<_> = packages.iter().filter(|p| p.name != package).map(component).collect();
    let known: BTreeSet<_> = packages.iter().map(|p| (&p.name, &p.version)).collect();
    let dependencies: Vec<_> = packages
        .iter()
        .map(|p| {
            let used = p.uses.iter().filter(|(name, version)| known.contains(&(name, version)));
            let used: Vec<_> = used.map(|(name, version)| purl(name, version)).collect();
            json!({ "ref": purl(&p.name, &p.version), "dependsOn": used })
        })
        .collect();
    json!({
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": { "component": subject.map(|p| described(p, "application")) },
        "components": components,
        "dependencies": dependencies,
    })
}

fn component(package: &Package) -> Value {
    let mut value = described(package, "library");
    // What only builds the program is not delivered with it.
    value["scope"] = json!(if package.is_linked { "required" } else { "excluded" });
    value
}

fn described(package: &Package, kind: &str) -> Value {
    let Package { name, version, licence, description, repository, checksum, .. } = package;
    let mut value = json!({
        "type": kind,
        "bom-ref": purl(name, version),
        "name": name,
        "version": version,
        "purl": purl(name, version),
        "licenses": [{ "expression": licence }],
    });
    if !description.is_empty() {
        value["description"] = json!(description);
    }
    if let Some(sum) = checksum {
        value["hashes"] = json!([{ "alg": "SHA-256", "content": sum }]);
    }
    if !repository.is_empty() {
        value["externalReferences"] = json!([{ "type": "vcs", "url": repository }]);
    }
    value
}

fn purl(name: &str, version: &str) -> String {
    format!("pkg:cargo/{name}@{version}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dist::boards;

    #[test]
    fn every_package_is_there_once_with_its_licence_and_every_reference_leads_somewhere() {
        let packages = boards::packages().unwrap();
        let bill = bill("cathforce-firmware", &packages);
        assert_eq!(bill["metadata"]["component"]["name"], "cathforce-firmware");
        let components = bill["components"].as_array().unwrap();
        let references: BTreeSet<_> = components
            .iter()
            .chain([&bill["metadata"]["component"]])
            .map(|c| c["bom-ref"].as_str().unwrap().to_owned())
            .collect();
        assert_eq!(references.len(), components.len() + 1);
        for component in components {
            let licence = component["licenses"][0]["expression"].as_str().unwrap();
            assert!(!licence.is_empty() && !licence.contains('/'), "{component}");
        }
        let used = bill["dependencies"].as_array().unwrap();
        for one in used.iter().flat_map(|d| d["dependsOn"].as_array().unwrap()) {
            assert!(references.contains(one.as_str().unwrap()), "{one}");
        }
    }
}
