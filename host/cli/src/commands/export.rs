//! `cathforce export`.

use std::fs::File;
use std::path::Path;

use cathforce_record::{analyse, write_nodes_csv, write_ticks_csv};
use serde_json::json;

use crate::args::ExportArguments;
use crate::failure::Failure;
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &ExportArguments) -> Result<(), Failure> {
    let recording = super::open_recording(ui, &arguments.recording)?;
    let track = analyse(&recording)?.track;
    let create = |path: &Path| File::create(path).map_err(|e| Failure::write(path, e));
    let path = &arguments.csv;
    write_ticks_csv(&recording, &track.ticks, create(path)?)
        .map_err(|e| Failure::write(path, e))?;
    let mut files = vec![json!({ "path": path, "ticks": track.ticks.len() })];
    let mut text = format!("{} ticks: {}\n", track.ticks.len(), path.display());
    if let Some(path) = &arguments.nodes {
        write_nodes_csv(&recording, &track.shapes, create(path)?)
            .map_err(|e| Failure::write(path, e))?;
        files.push(json!({ "path": path, "shapes": track.shapes.len() }));
        text += &format!("{} shapes: {}\n", track.shapes.len(), path.display());
    }
    ui.data(&files, text)
}
