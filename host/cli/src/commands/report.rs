//! `cathforce report`.

use cathforce_record::analyse;
use serde_json::json;

use crate::args::ReportArguments;
use crate::failure::Failure;
use crate::report::page;
use crate::summary::Summary;
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &ReportArguments) -> Result<(), Failure> {
    let recording = super::open_recording(ui, &arguments.recording)?;
    let analysis = analyse(&recording)?;
    let summary = Summary::of(&recording, &analysis);
    let html = page(&recording, &analysis, &summary)?;
    let path = &arguments.html;
    std::fs::write(path, html).map_err(|e| Failure::write(path, e))?;
    ui.data(&json!({ "path": path }), format_args!("page: {}\n", path.display()))
}
