//! The command, and what its tests say of its answers.

#![allow(dead_code, reason = "each test uses a part of it")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

pub fn example() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none")
}

pub fn command() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cathforce"));
    command.env("NO_COLOR", "1");
    command
}

pub fn cathforce<const N: usize>(arguments: [&str; N]) -> Output {
    command().args(arguments).output().unwrap()
}

pub fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

pub fn stderr(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).unwrap()
}

#[track_caller]
pub fn assert_fails(output: &Output, code: i32, words: &[&str]) {
    assert_eq!(output.status.code(), Some(code), "{}", stderr(output));
    for word in words {
        assert!(stderr(output).contains(word), "`{word}` in: {}", stderr(output));
    }
}
