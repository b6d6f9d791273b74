//! `cathforce import ros`.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use cathforce_recording::import::{
    ColumnMap, ImportedBag, ImportedTable, RosFile, RosTopic, list_ros, read_ros,
};
use serde_json::json;

use super::trial::{at, say_all, warn_all, write};
use crate::args::ImportRosArguments;
use crate::failure::Failure;
use crate::open::read_bytes;
use crate::output::{check_new, shown};
use crate::ui::Ui;

const FORCE: [&str; 3] = ["fx_N", "fy_N", "fz_N"];
const TIP: [&str; 3] = ["tip_x_m", "tip_y_m", "tip_z_m"];
const AXES: [&str; 3] = ["x", "y", "z"];
/// Columns that a lead turns from an angle into a length.
const INSERTIONS: [&str; 2] = ["insertion_m", "guidewire_insertion_m"];

pub fn run(ui: &Ui, arguments: &ImportRosArguments) -> Result<(), Failure> {
    let path = &arguments.bag;
    let Some(out) = arguments.out.as_ref().filter(|_| !arguments.list) else {
        let (topics, remarks) = list_ros(&files(path)?).map_err(|e| at(path, &e))?;
        warn_all(ui, path, &remarks);
        return list(ui, &topics);
    };
    check_new(out)?;
    let files = files(path)?;
    let read = read_ros(&files, &columns(arguments), arguments.clock.into());
    let ImportedBag { table, understood } = read.map_err(|e| at(path, &e))?;
    let ImportedTable { mut trial, remarks } = table;
    say_all(ui, path, &understood);
    warn_all(ui, path, &remarks);
    if let Some(tare_s) = arguments.tare {
        trial.tare(tare_s).map_err(|problem| {
            let fix = "give --tare the seconds in which nothing touched, and a force";
            Failure::input(format!("{}: {problem}\n  fix: {fix}", path.display()))
        })?;
    }
    let rows = trial.rows();
    let json = json!({
        "path": shown(out), "rows": rows, "understood": understood, "remarks": remarks,
    });
    let out = (!arguments.dry_run).then_some(&**out);
    write(ui, out, &trial, &json, &format!("{rows} rows"))
}

/// The columns of the command line, those of whole vectors among them.
fn columns(arguments: &ImportRosArguments) -> Vec<ColumnMap> {
    let mut maps = arguments.columns.clone();
    // A drive that counts turns feeds by its lead.
    if let Some(lead_mm) = arguments.lead {
        let insertions = maps.iter_mut().filter(|map| INSERTIONS.contains(&map.to.as_str()));
        insertions.for_each(|map| map.factor *= 1e-3 * lead_mm / TAU);
    }
    let map =
        |to: &str, from: String, factor| ColumnMap { to: to.into(), from, factor, offset: 0.0 };
    if let Some(topic) = &arguments.force {
        let axes = FORCE.iter().zip(arguments.axes.signed());
        maps.extend(
            axes.map(|(to, (axis, sign))| map(to, format!("{topic}:force.{}", AXES[axis]), sign)),
        );
    }
    if let Some(tip) = &arguments.tip {
        // A frame of tf is named behind its topic.
        let separator = if tip.contains(':') { '.' } else { ':' };
        maps.extend(
            TIP.iter().zip(AXES).map(|(to, axis)| map(to, format!("{tip}{separator}{axis}"), 1.0)),
        );
    }
    maps
}

/// The files of a bag: one, or all in a folder.
pub fn files(path: &Path) -> Result<Vec<RosFile>, Failure> {
    let paths = match path.is_dir() {
        false => vec![path.to_path_buf()],
        true => in_folder(path)?,
    };
    let file = |path: PathBuf| {
        check_closed(&path)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok(RosFile { name, bytes: read_bytes(&path)? })
    };
    paths.into_iter().map(file).collect()
}

fn in_folder(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let failed = |e: std::io::Error| {
        Failure::input(format!(
            "cannot read {}: {e}\n  fix: give the bag's folder",
            folder.display()
        ))
    };
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let name = name.strip_suffix(".zstd").unwrap_or(&name);
        if name.ends_with(".mcap") || name.ends_with(".db3") {
            found.push(path);
        }
    }
    found.sort();
    if found.is_empty() {
        let message = format!(
            "{}: there is no .mcap and no .db3 in this folder\n  fix: give the folder of `ros2 bag record`",
            folder.display()
        );
        return Err(Failure::input(message));
    }
    Ok(found)
}

/// Refuses a database whose last messages are in a file beside it: they would be missing without a word.
fn check_closed(path: &Path) -> Result<(), Failure> {
    let mut beside = path.as_os_str().to_owned();
    beside.push("-wal");
    match std::fs::metadata(&beside).is_ok_and(|found| found.len() > 0) {
        false => Ok(()),
        true => Err(Failure::input(format!(
            "{}: the bag is still being written, or its recorder was killed: {} holds messages of it\n  fix: \
             stop the recorder; after a kill, `sqlite3 {} 'PRAGMA wal_checkpoint(TRUNCATE)'`",
            path.display(),
            Path::new(&beside).display(),
            path.display()
        ))),
    }
}

fn list(ui: &Ui, topics: &[RosTopic]) -> Result<(), Failure> {
    let mut text = String::new();
    for RosTopic { name, kind, messages, signals } in topics {
        let read = if signals.is_empty() { "; not read" } else { "" };
        text += &format!("{name}  {kind}, {messages} messages{read}\n");
        text += &signals.iter().map(|signal| format!("    {signal}\n")).collect::<String>();
    }
    let topics = topics.iter().map(|topic| {
        json!({
            "topic": topic.name, "type": topic.kind, "messages": topic.messages, "signals": topic.signals,
        })
    });
    ui.data(&topics.collect::<Vec<_>>(), text)
}
