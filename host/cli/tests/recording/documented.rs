//! What README and docs print can be typed.

use std::fs;
use std::path::Path;

use crate::pages::documented;
use crate::{command, example, stderr};

/// What a reader puts where the pages leave it to him.
const MEANT: [(&str, &str); 5] = [
    ("BUNDLE", "bundle"),
    ("MESH.stl", "VESSEL.stl"),
    ("OTHER|LINK", "sim"),
    ("OLD.toml", "S.toml"),
    ("FILE.mcap", "x.mcap"),
];
/// Need a network interface, a lab's file, a device that stays, or minutes; each has tests of its own.
const NOT_HERE: [&str; 9] = [
    "link up",
    "doctor --link",
    "config import-dbc",
    "config save",
    "gap diagnose",
    "gap apply",
    "gap verify",
    "gap blind-test",
    "gap coverage",
];

/// Page by page from the settings on, in the order in which they are printed: each finds what the
/// ones before it have made.
#[test]
fn the_commands_of_the_pages_run_as_printed() {
    let folder = tempfile::tempdir().unwrap();
    let bundle = folder.path().join("bundle");
    // A bundle without a mesh is made into an image in less time.
    copy(&example().with_file_name("bend-guidewire"), &bundle);
    fs::copy(example().join("vessel.stl"), folder.path().join("VESSEL.stl")).unwrap();
    let mut all = documented(&["cathforce"]);
    all.retain(|command| command.in_block);
    let pages = ["docs/config.md", "README.md", "docs/lumen.md", "docs/recording.md"];
    let mut ran = 0;
    for printed in
        pages.iter().flat_map(|page| all.iter().filter(move |c| c.place.starts_with(*page)))
    {
        let text = printed.words[1..].join(" ");
        if NOT_HERE.iter().any(|begin| text.starts_with(begin)) {
            continue;
        }
        let mut words = printed.words[1..].to_vec();
        for at in 0..words.len() {
            if let Some((_, meant)) = MEANT.iter().find(|(name, _)| *name == words[at]) {
                words[at] = (*meant).to_owned();
            }
            if at > 0 && words[at - 1] == "--link" {
                words[at] = "sim".into();
            }
        }
        let output = command().args(&words).current_dir(folder.path()).output().unwrap();
        let said = stderr(&output);
        assert!(
            output.status.success(),
            "{}: cathforce {}\n{said}",
            printed.place,
            words.join(" ")
        );
        ran += 1;
    }
    assert!(ran >= 20, "{ran} commands");
    for made in ["S.toml", "x.mcap", "x.html"] {
        assert!(folder.path().join(made).is_file(), "{made}");
    }
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let to = to.join(entry.file_name());
        match entry.file_type().unwrap().is_dir() {
            true => copy(&entry.path(), &to),
            false => drop(fs::copy(entry.path(), to).unwrap()),
        }
    }
}
