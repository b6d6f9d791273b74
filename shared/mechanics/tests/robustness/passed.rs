//! A record of the random sets that have passed, in the target folder. An interrupted long run can be
//! continued, as long as the tick is the same to the last bit.

use std::collections::BTreeSet;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

pub struct Passed {
    before: BTreeSet<u64>,
    file: Option<Mutex<File>>,
}

impl Passed {
    /// An empty record that is not stored.
    pub fn nothing() -> Self {
        Self { before: BTreeSet::new(), file: None }
    }

    /// The record of `check` on the tick with this fingerprint.
    pub fn of(check: &str, fingerprint: u64) -> Self {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("random-sets");
        std::fs::create_dir_all(&folder).unwrap();
        Self::in_file(&folder.join(format!("{check}-{fingerprint:016x}.txt")))
    }

    /// One seed per line; an incomplete last line of a killed run is ignored.
    fn in_file(path: &Path) -> Self {
        let kept = std::fs::read_to_string(path).unwrap_or_default();
        let ended = kept.rfind('\n').map_or(0, |end| end + 1);
        let before = kept[..ended].lines().filter_map(|line| line.parse().ok()).collect();
        let mut file = OpenOptions::new().create(true).append(true).open(path).unwrap();
        if ended < kept.len() {
            file.write_all(b"?\n").unwrap();
        }
        Self { before, file: Some(Mutex::new(file)) }
    }

    pub fn has(&self, seed: u64) -> bool {
        self.before.contains(&seed)
    }

    pub fn add(&self, seed: u64) {
        if let Some(file) = &self.file {
            file.lock().unwrap().write_all(format!("{seed}\n").as_bytes()).unwrap();
        }
    }
}

#[test]
fn what_has_passed_is_known_to_the_next_run() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let path = folder.join(format!("passed-{}.txt", std::process::id()));
    let first = Passed::in_file(&path);
    assert!(!first.has(7));
    first.add(7);
    first.add(123);
    // The run was killed within a line.
    std::fs::write(&path, "7\n123\n45").unwrap();
    let second = Passed::in_file(&path);
    assert!(second.has(7) && second.has(123) && !second.has(45));
    second.add(6);
    let third = Passed::in_file(&path);
    assert!(third.has(7) && third.has(123) && third.has(6) && !third.has(45) && !third.has(456));
    std::fs::remove_file(path).unwrap();
}
