//! Recordings as people and scripts meet them: made, checked, converted, shown.

mod check;
mod clients;
mod convert;
mod live;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

fn example() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none")
}

fn command() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cathforce"));
    command.env("NO_COLOR", "1");
    command
}

fn cathforce<const N: usize>(arguments: [&str; N]) -> Output {
    command().args(arguments).output().unwrap()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn stderr(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).unwrap()
}

/// What a command that must succeed says as JSON.
#[track_caller]
fn data<const N: usize>(arguments: [&str; N]) -> serde_json::Value {
    let output = command().args(arguments).arg("--json").output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[track_caller]
fn assert_fails(output: &Output, code: i32, words: &[&str]) {
    assert_eq!(output.status.code(), Some(code), "{}", stderr(output));
    for word in words {
        assert!(stderr(output).contains(word), "`{word}` in: {}", stderr(output));
    }
}

/// A recording of the example's first trial, whole, made once.
fn recording() -> &'static Path {
    static MADE: OnceLock<(tempfile::TempDir, PathBuf)> = OnceLock::new();
    let (_, path) = MADE.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        let example = example();
        let arguments = ["simulate", text(&example), "--trial", "0", "--out", text(&path)];
        let output = cathforce(arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        (folder, path)
    });
    path
}
