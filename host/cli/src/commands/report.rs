//! `cathforce report`.

use cathforce_pages::recording_page;
use cathforce_recording::{Summary, analyse};
use serde_json::json;

use crate::args::ReportArguments;
use crate::failure::Failure;
use crate::output::{Kind, check_again, write_again};
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &ReportArguments) -> Result<(), Failure> {
    check_again(&arguments.html, Kind::Page)?;
    let recording = super::open_recording(ui, &arguments.recording)?;
    let analysis = analyse(&recording)?;
    let summary = Summary::of(&recording, &analysis);
    let html = recording_page(&recording, &analysis, &summary).map_err(Failure::input)?;
    let path = &arguments.html;
    write_again(path, Kind::Page, html)?;
    ui.data(&json!({ "path": path }), format_args!("page: {}\n", path.display()))
}
