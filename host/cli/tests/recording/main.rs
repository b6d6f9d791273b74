//! Recordings as people and scripts meet them: made, checked, converted, shown.

#[cfg(unix)]
mod bus;
mod check;
mod clients;
mod convert;
mod documented;
mod formats;
mod kept;
mod live;
mod made;
#[path = "../support/documented.rs"]
mod pages;
mod sensor;
#[path = "../support/mod.rs"]
mod support;
#[cfg(target_os = "linux")]
mod terminal;

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use cathforce_test_fixture::once;
use support::{assert_fails, cathforce, command, example, stderr, text};

/// What a command that must succeed says as JSON.
#[track_caller]
fn data<const N: usize>(arguments: [&str; N]) -> serde_json::Value {
    let output = command().args(arguments).arg("--json").output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// A recording of the example's first trial, whole, made once.
fn recording() -> &'static Path {
    static MADE: OnceLock<PathBuf> = OnceLock::new();
    MADE.get_or_init(|| {
        let folder = once("whole-recording", |folder| {
            let (example, path) = (example(), folder.join("run.mcap"));
            let arguments = ["simulate", text(&example), "--trial", "0", "--out", text(&path)];
            let output = cathforce(arguments);
            assert!(output.status.success(), "{}", stderr(&output));
        });
        folder.join("run.mcap")
    })
}
