//! Names of the files with tokens, and those that a killed program has left.

use std::path::Path;

const BEFORE: &str = "cathforce-dash-";
const AFTER: &str = ".token";

/// The name for this process at a port.
pub fn name(port: u16) -> String {
    format!("{BEFORE}{port}-{}{AFTER}", std::process::id())
}

/// Removes the files of processes that have ended without removing theirs.
///
/// A file that cannot be removed belongs to somebody else, and stays.
pub fn remove_left(folder: &Path) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        if name.to_str().and_then(process).is_some_and(has_ended) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// The process that a file is named after.
fn process(name: &str) -> Option<i32> {
    let (port, process) = name.strip_prefix(BEFORE)?.strip_suffix(AFTER)?.split_once('-')?;
    port.parse::<u16>().ok()?;
    process.parse().ok()
}

#[cfg(unix)]
fn has_ended(process: i32) -> bool {
    use rustix::{io::Errno, process as processes};
    // A process of another user exists too, although no signal may be sent to it.
    let found = processes::Pid::from_raw(process).map(processes::test_kill_process);
    found.is_some_and(|found| found == Err(Errno::SRCH))
}

/// Elsewhere nothing tells it without unsafe code.
#[cfg(not(unix))]
fn has_ended(_: i32) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_named_after_its_process() {
        let own = i32::try_from(std::process::id()).unwrap();
        assert_eq!(process(&name(7410)), Some(own));
        for other in ["cathforce-dash-7410.token", "cathforce-dash-x-1.token", "notes.token"] {
            assert_eq!(process(other), None, "{other}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn only_the_files_of_ended_processes_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let mut ended = std::process::Command::new("true").spawn().unwrap();
        ended.wait().unwrap();
        let of = |process: u32| folder.path().join(format!("cathforce-dash-7410-{process}.token"));
        // Process 1 is of another user, or of this one; it runs in any case.
        let (left, own, first) = (of(ended.id()), of(std::process::id()), of(1));
        let other = folder.path().join("notes.token");
        for path in [&left, &own, &first, &other] {
            std::fs::write(path, "").unwrap();
        }
        remove_left(folder.path());
        assert!(!left.exists());
        assert!(own.exists() && first.exists() && other.exists());
    }
}
