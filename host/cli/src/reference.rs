//! Writes the pages of docs/reference that are generated from the program, and checks that they are
//! up to date.

mod command_line;
mod settings;

use std::fs;
use std::path::Path;

/// Set to 1, it makes the tests write the pages instead of comparing them.
const WRITE: &str = "CATHFORCE_WRITE_PAGES";

/// Compares a page below docs/reference with `text`, or writes it.
#[track_caller]
fn check(page: &str, text: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference").join(page);
    if std::env::var_os(WRITE).is_some_and(|value| value == "1") {
        fs::create_dir_all(path.parent().expect("a folder")).expect("docs/reference");
        fs::write(&path, text).expect("the page");
    }
    let found = fs::read_to_string(&path).unwrap_or_default();
    let again = format!("{WRITE}=1 cargo test --package cathforce reference");
    assert!(found == text, "docs/reference/{page} is out of date; write it again: {again}");
}

/// A note for whoever edits the page.
fn notice(source: &str) -> String {
    format!(
        "<!-- Generated from {source}. To write it again:\n     {WRITE}=1 cargo test --package \
         cathforce reference -->\n"
    )
}

/// Text in a cell of a table.
fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace('\n', " ")
}
