//! `cathforce report`: a web page of a recording.

use std::path::{Path, PathBuf};

use cathforce_pages::recording_page;
use cathforce_recording::{Summary, analyse};
use serde_json::json;

use crate::args::ReportArguments;
use crate::failure::{Code, Failure};
use crate::open::open_recording;
use crate::output::{Kind, check_again, is_own_page, shown, write_again};
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &ReportArguments) -> Result<(), Failure> {
    let path = write(ui, arguments)?;
    ui.data(&json!({ "path": shown(&path) }), format_args!("page: {}\n", path.display()))
}

/// Writes the page, and gives its path.
pub fn write(ui: &Ui, arguments: &ReportArguments) -> Result<PathBuf, Failure> {
    let path = place(arguments);
    check_again(&path, Kind::Page)?;
    check_own(&path, arguments.overwrite)?;
    let recording = open_recording(ui, &arguments.recording)?;
    let analysis = analyse(&recording)?;
    let summary = Summary::of(&recording, &analysis);
    let html = recording_page(&recording, &analysis, &summary).map_err(Failure::input)?;
    write_again(&path, Kind::Page, html)?;
    Ok(path)
}

/// Where the page goes: beside its recording unless it is told.
fn place(arguments: &ReportArguments) -> PathBuf {
    arguments.out.clone().unwrap_or_else(|| arguments.recording.with_extension("html"))
}

/// A page can be made again at any time, but only by the program that made it.
fn check_own(path: &Path, overwrite: bool) -> Result<(), Failure> {
    if overwrite || !path.is_file() || is_own_page(path) {
        return Ok(());
    }
    let message = format!(
        "{} is a web page that cathforce did not make and stays as it is\n  fix: give another name \
         with --out, or replace it with --overwrite",
        path.display()
    );
    Err(Failure::new(Code::Usage, message))
}
