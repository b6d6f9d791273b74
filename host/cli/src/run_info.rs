//! The facts about a run that its recording keeps: versions, link, rig and origin of the bundle.

use std::path::{Path, PathBuf};

use cathforce_bundle::Bundle;
use cathforce_link::carrier;
use cathforce_link::qemu::find_firmware;
use cathforce_recording::{RunInfo, SensorNoise};
use sha2::{Digest, Sha256};

/// Link of a recording that was imported from a log of candump.
pub const CANDUMP: &str = "candump";

/// The facts about a run that are known before it begins.
pub fn info(link: &str, bundle: &Bundle, trial: &str) -> RunInfo {
    RunInfo {
        host_version: env!("CARGO_PKG_VERSION").into(),
        link: link.into(),
        rig: bundle.rig.name.clone(),
        trial: trial.into(),
        provenance: provenance(&bundle.path),
        firmware_sha256: firmware_sha256(link),
        noise: SensorNoise::of(&bundle.rig.sensor),
        ..RunInfo::default()
    }
}

/// SHA-256 of the program that acts as the device; empty where this host does not start it.
fn firmware_sha256(link: &str) -> String {
    let link = carrier(link);
    let program = match link.split_once(':').map_or(link, |(kind, _)| kind) {
        "sim" => std::env::current_exe().ok(),
        "qemu" => find_firmware(link.split_once(':').map(|(_, elf)| Path::new(elf))).ok(),
        _ => None,
    };
    let bytes = program.and_then(|path| std::fs::read(path).ok());
    bytes.map_or(String::new(), |bytes| format!("{:x}", Sha256::digest(bytes)))
}

/// Longest text about a bundle's origin: two lines of a page.
const PROVENANCE_CHARACTERS: usize = 260;

/// Where a bundle comes from: the first sentences of the first paragraph of its PROVENANCE.md or
/// README.md, or of those beside it, without markup and without text in brackets.
fn provenance(bundle: &Path) -> String {
    let parent = bundle.parent().map(Path::to_path_buf).unwrap_or_default();
    let places: [PathBuf; 4] = [
        bundle.join("PROVENANCE.md"),
        bundle.join("README.md"),
        parent.join("PROVENANCE.md"),
        parent.join("README.md"),
    ];
    let text = places.iter().find_map(|place| std::fs::read_to_string(place).ok());
    let text = text.unwrap_or_default();
    let paragraph = text.split("\n\n").find(|p| !p.trim_start().starts_with('#')).unwrap_or("");
    let mut depth = 0_u32;
    let keep = |c: &char| {
        depth = (depth + u32::from(*c == '(')).saturating_sub(u32::from(*c == ')'));
        depth == 0 && !matches!(c, ')' | '*' | '`')
    };
    let plain = paragraph.chars().filter(keep).collect::<String>();
    let plain = plain.split_whitespace().collect::<Vec<_>>().join(" ");
    let plain = plain.replace(" .", ".").replace(" ,", ",");
    let ends = plain.match_indices(". ").map(|(at, _)| at + 1).chain([plain.len()]);
    let end = ends.take_while(|&end| end <= PROVENANCE_CHARACTERS).last().unwrap_or(0);
    plain[..end].to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn provenance_is_the_first_sentences_beside_the_bundle() {
        let folder = tempfile::tempdir().unwrap();
        let bundle = folder.path().join("rig");
        std::fs::create_dir(&bundle).unwrap();
        assert_eq!(provenance(&bundle), "");
        let text = format!(
            "# Bundles\n\n**Simulated,\nnot measured** (by (f. ex.) us). So. {}.\n\nMore.\n",
            "word ".repeat(PROVENANCE_CHARACTERS / 5)
        );
        std::fs::write(folder.path().join("README.md"), text).unwrap();
        assert_eq!(provenance(&bundle), "Simulated, not measured. So.");
        std::fs::write(bundle.join("PROVENANCE.md"), "Measured here.").unwrap();
        assert_eq!(provenance(&bundle), "Measured here.");
    }
}
