//! Rigs of the example that are soon played.

use std::path::{Path, PathBuf};

use cathforce_blind_test::Stand;

fn example() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none")
}

/// A copy whose only trial ends early, with another text in its rig.toml.
pub fn changed(folder: &Path, rows: usize, from: &str, to: &str) {
    std::fs::create_dir_all(folder.join("trials")).unwrap();
    let text = std::fs::read_to_string(example().join("rig.toml")).unwrap();
    assert!(text.contains(from), "{from}");
    std::fs::write(folder.join("rig.toml"), text.replace(from, to)).unwrap();
    std::fs::copy(example().join("centreline.csv"), folder.join("centreline.csv")).unwrap();
    let trial = std::fs::read_to_string(example().join("trials/000.csv")).unwrap();
    let lines: Vec<&str> = trial.lines().take(1 + rows).collect();
    std::fs::write(folder.join("trials/000.csv"), lines.join("\n") + "\n").unwrap();
}

/// The example's rig with one trial of a second.
pub fn short() -> Stand {
    let folder = tempfile::tempdir().unwrap();
    changed(folder.path(), 250, "", "");
    Stand::of_bundle(folder.path()).unwrap()
}
