//! `cathforce export`.

use std::fmt::Display;
use std::io;
use std::path::Path;

use cathforce_recording::{
    Track, analyse, write_bundle, write_candump, write_nodes_csv, write_ticks_csv, write_whole,
};
use serde_json::{Value, json};

use crate::args::ExportArguments;
use crate::failure::Failure;
use crate::open::open_recording;
use crate::output::{Kind, NODES, TICKS, check_apart, check_export, check_new_folder, shown};
use crate::ui::Ui;

/// A file of this name means stdout.
const STDOUT: &str = "-";
/// Interface that an exported log names.
const INTERFACE: &str = "can0";

pub fn run(ui: &Ui, arguments: &ExportArguments) -> Result<(), Failure> {
    let written = write(ui, arguments)?;
    let to_stdout = [&arguments.csv, &arguments.nodes, &arguments.candump].into_iter().flatten();
    match to_stdout.into_iter().any(|path| path == Path::new(STDOUT)) {
        // The exported table is the data; nothing else may be on stdout.
        true => {
            ui.say(written.text.trim_end());
            Ok(())
        }
        false => ui.data(&written.json, written.text),
    }
}

/// Writes what is asked for, and gives what was written.
pub fn write(ui: &Ui, arguments: &ExportArguments) -> Result<Written, Failure> {
    check(arguments)?;
    let recording = open_recording(ui, &arguments.recording)?;
    let decoded = [&arguments.csv, &arguments.nodes, &arguments.parquet];
    let (track, entry_m) = match decoded.iter().any(|path| path.is_some()) {
        true => {
            let analysis = analyse(&recording)?;
            (analysis.track, analysis.entry_m.map(|x| x as f32))
        }
        false => (Track::default(), [0.0; 3]),
    };
    let ticks = &track.ticks;
    let mut written = Written::default();
    if let Some(path) = &arguments.csv {
        whole(path, |out| write_ticks_csv(&recording, ticks, entry_m, out))?;
        written.add(path, "ticks", ticks.len());
    }
    if let Some(path) = &arguments.nodes {
        let shapes = &track.shapes;
        whole(path, |out| write_nodes_csv(&recording, shapes, out))?;
        written.add(path, "shapes", shapes.len());
    }
    if let Some(path) = &arguments.parquet {
        write_parquet(&recording, ticks, entry_m, path)?;
        written.add(path, "ticks", ticks.len());
    }
    if let Some(path) = &arguments.candump {
        let (frames, started_ns) = (&recording.frames, recording.info.started_unix_ns);
        whole(path, |out| write_candump(frames, started_ns, INTERFACE, out))?;
        written.add(path, "frames", frames.len());
    }
    if let Some(path) = &arguments.bundle {
        write_bundle(&recording, path).map_err(|e| Failure::write(path, e))?;
        if recording.trial.rows.is_empty() {
            ui.warn(format_args!(
                "{}: no trial was measured, so {} has the rig and the vessel but no trial",
                arguments.recording.display(),
                path.display()
            ));
        }
        written.add(path, "rows", recording.trial.rows.len());
    }
    Ok(written)
}

#[cfg(feature = "parquet")]
fn write_parquet(
    recording: &cathforce_recording::Recording,
    ticks: &[cathforce_recording::TickEstimate],
    entry_m: [f32; 3],
    path: &Path,
) -> Result<(), Failure> {
    write_whole(path, |out| {
        cathforce_recording::write_ticks_parquet(recording, ticks, entry_m, out)
            .map_err(io::Error::other)
    })
    .map_err(|e| Failure::write(path, e))
}

#[cfg(not(feature = "parquet"))]
use super::left_out::write_parquet;

/// Checks every output before the work begins.
fn check(arguments: &ExportArguments) -> Result<(), Failure> {
    let ExportArguments { csv, nodes, parquet, candump, bundle, overwrite, .. } = arguments;
    let files = [(csv, TICKS), (nodes, NODES), (parquet, Kind::Parquet), (candump, Kind::Candump)];
    let files = files.into_iter().filter_map(|(path, kind)| Some((path.as_deref()?, kind)));
    check_apart(files.clone().map(|(path, _)| path).chain(bundle.as_deref()))?;
    for (path, kind) in files.filter(|(path, _)| *path != Path::new(STDOUT)) {
        check_export(path, kind, *overwrite)?;
    }
    bundle.as_deref().map_or(Ok(()), check_new_folder)
}

/// Writes text into a file, whole or not at all, or to stdout.
fn whole(
    path: &Path,
    write: impl FnOnce(&mut dyn io::Write) -> io::Result<()>,
) -> Result<(), Failure> {
    if path != Path::new(STDOUT) {
        return write_whole(path, |out| write(out)).map_err(|e| Failure::write(path, e));
    }
    match write(&mut io::BufWriter::new(io::stdout().lock())) {
        // The reader of the pipe has seen enough.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        written => written.map_err(|e| Failure::write(path, e)),
    }
}

/// The files that were written, for a reader and for a program.
#[derive(Default)]
pub struct Written {
    json: Vec<Value>,
    text: String,
}

impl Written {
    fn add(&mut self, path: &Path, what: &'static str, count: impl Display + Into<Value>) {
        self.text += &format!("{count} {what}: {}\n", path.display());
        self.json.push(json!({ "path": shown(path), what: count.into() }));
    }
}
