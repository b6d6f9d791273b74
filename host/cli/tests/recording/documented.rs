//! The commands of the pages run as they are printed.

use std::fs;
use std::path::Path;

use crate::pages::documented;
use crate::{command, example, stderr};

/// What a reader types in place of a name in capitals.
const MEANT: [(&str, &str); 5] = [
    ("BUNDLE", "bundle"),
    ("MESH.stl", "VESSEL.stl"),
    ("OTHER|LINK", "sim"),
    ("OLD.toml", "S.toml"),
    ("FILE.mcap", "x.mcap"),
];
/// These need a network interface, a lab's file, a device that stays, or minutes; each has tests of
/// its own.
const NOT_HERE: [&str; 14] = [
    "run",
    "monitor",
    "link up",
    "link serve",
    "doctor --link",
    "config import-dbc",
    "config save",
    "gap diagnose",
    "gap apply",
    "gap verify",
    "gap blind-test",
    "gap coverage",
    "gap ablation",
    "gap isolability",
];
/// Pages whose commands need nothing but what the pages before them have made.
const PAGES: [&str; 4] = [
    "docs/reference/settings.md",
    "docs/explanation/lumen.md",
    "docs/how-to/read-a-fault.md",
    "docs/how-to/describe-your-rig.md",
];

/// In the order in which they are printed: each command finds the files of the ones before it.
#[test]
fn the_commands_of_the_pages_run_as_printed() {
    let folder = tempfile::tempdir().unwrap();
    // A bundle without a mesh is made into an image in less time.
    let rig = example().with_file_name("bend-guidewire");
    copy(&rig, &folder.path().join("bundle"));
    copy(&rig, &folder.path().join("examples/bend-guidewire"));
    fs::copy(example().join("vessel.stl"), folder.path().join("VESSEL.stl")).unwrap();
    let mut all = documented(&["cathforce"]);
    all.retain(|command| command.in_block);
    let mut ran = 0;
    for printed in
        PAGES.iter().flat_map(|page| all.iter().filter(move |c| c.place.starts_with(*page)))
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
    assert!(ran >= 17, "{ran} commands");
    for made in ["S.toml", "my-rig.mcap", "my-rig.html"] {
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
