//! What several tests need is made once for all of them.
//!
//! A runner such as cargo-nextest starts a process for each test, so a `static` is made anew in each.
//! [`once`] keeps such things in a folder of the build instead, behind a lock.

#![forbid(unsafe_code)]

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// Names the run that a test belongs to; cargo-nextest sets it.
const RUN_VARIABLE: &str = "NEXTEST_RUN_ID";
/// Longer than any run of tests: `.ci/run` is ended after 90 minutes.
const OLD: Duration = Duration::from_secs(2 * 3600);
/// Is in a folder that was filled to the end.
const COMPLETE: &str = ".complete";

/// A folder that `make` fills once for all tests of a run; the other tests wait for it.
///
/// `name` is that of one thing of one test program. Where `make` panics, the next test tries again.
///
/// # Panics
/// Where the folder cannot be written.
pub fn once(name: &str, make: impl FnOnce(&Path)) -> PathBuf {
    let process = || format!("process-{}", std::process::id());
    once_in(&fixtures(), name, &std::env::var(RUN_VARIABLE).unwrap_or_else(|_| process()), make)
}

fn once_in(fixtures: &Path, name: &str, run: &str, make: impl FnOnce(&Path)) -> PathBuf {
    fs::create_dir_all(fixtures).unwrap();
    let lock = File::create(fixtures.join(format!("{name}.lock"))).unwrap();
    // It is free again when the file is closed, at the end of a process too.
    lock.lock().unwrap();
    let folder = fixtures.join(format!("{name}-{run}"));
    if !folder.join(COMPLETE).exists() {
        remove_old(fixtures);
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir(&folder).unwrap();
        make(&folder);
        fs::write(folder.join(COMPLETE), "").unwrap();
    }
    folder
}

/// `target/PROFILE/fixtures`: a test program lies in `target/PROFILE/deps`.
fn fixtures() -> PathBuf {
    let test = std::env::current_exe().expect("a test has a path");
    let built = test.parent().and_then(Path::parent).expect("target/PROFILE/deps");
    built.join("fixtures")
}

/// Removes what earlier runs have left.
fn remove_old(fixtures: &Path) {
    for entry in fs::read_dir(fixtures).into_iter().flatten().flatten() {
        let changed = entry.metadata().and_then(|data| data.modified());
        let age = changed.map(|at| SystemTime::now().duration_since(at).unwrap_or_default());
        if age.is_ok_and(|age| age > OLD) && entry.path().is_dir() {
            let _ = fs::remove_dir_all(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};

    /// A folder of this test's own.
    fn folder(name: &str) -> PathBuf {
        let folder = fixtures().join(format!("own-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        folder
    }

    #[test]
    fn many_askers_get_the_one_folder_complete() {
        let (fixtures, made) = (folder("many"), AtomicUsize::new(0));
        let ask = || {
            let given = once_in(&fixtures, "thing", "run", |folder| {
                made.fetch_add(1, SeqCst);
                std::thread::sleep(Duration::from_millis(20));
                fs::write(folder.join("data"), "whole").unwrap();
            });
            assert_eq!(fs::read_to_string(given.join("data")).unwrap(), "whole");
        };
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(ask);
            }
        });
        assert_eq!(made.load(SeqCst), 1);
        once_in(&fixtures, "thing", "another run", |_| {
            made.fetch_add(1, SeqCst);
        });
        assert_eq!(made.load(SeqCst), 2, "another run does not take what an earlier one made");
        fs::remove_dir_all(fixtures).unwrap();
    }

    #[test]
    fn what_was_not_finished_is_made_again() {
        let fixtures = folder("unfinished");
        let failing = || {
            once_in(&fixtures, "thing", "run", |folder| {
                fs::write(folder.join("half"), "").unwrap();
                panic!("on purpose");
            })
        };
        assert!(std::panic::catch_unwind(failing).is_err());
        let given = once_in(&fixtures, "thing", "run", |folder| {
            fs::write(folder.join("data"), "").unwrap();
        });
        assert!(given.join("data").exists() && !given.join("half").exists());
        fs::remove_dir_all(fixtures).unwrap();
    }
}
