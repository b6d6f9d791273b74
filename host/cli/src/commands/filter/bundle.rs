//! The trials of a bundle or of a recording, written as a new bundle.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use cathforce_bundle::{Bundle, nearest};
use cathforce_filter::Table;
use cathforce_recording::{VESSEL_FILES, write_bundle};

use super::report::Report;
use super::rows;
use crate::args::FilterArguments;
use crate::commands::bundle::{check_folder, fill_folder};
use crate::failure::{Code, Failure};
use crate::open::{open_bundle, open_recording};
use crate::ui::{Ui, to_json};

/// A bundle: its rig and vessel are copied, its trials filtered.
pub fn of_folder(ui: &Ui, arguments: &FilterArguments, out: &Path) -> Result<Report, Failure> {
    if !arguments.dry_run {
        check_folder(out)?;
    }
    let bundle = open_bundle(ui, &arguments.source)?;
    filtered(ui, arguments, out, &bundle, |file| file.display().to_string())
}

/// A recording, exported as a bundle first.
pub fn of_recording(ui: &Ui, arguments: &FilterArguments, out: &Path) -> Result<Report, Failure> {
    if !arguments.dry_run {
        check_folder(out)?;
    }
    let recording = open_recording(ui, &arguments.source)?;
    let folder = tempfile::tempdir().map_err(|e| Failure::write(out, e))?;
    let exported = folder.path().join("exported");
    write_bundle(&recording, &exported).map_err(|e| Failure::write(&exported, e))?;
    let bundle = Bundle::open(&exported)?;
    let source = arguments.source.display();
    filtered(ui, arguments, out, &bundle, |file| {
        let name = file.file_name().unwrap_or_default().display();
        format!("{source}, exported as trials/{name}")
    })
}

/// `shown`: how a trial's file is called in an error and in the report.
fn filtered(
    ui: &Ui,
    arguments: &FilterArguments,
    out: &Path,
    bundle: &Bundle,
    shown: impl Fn(&Path) -> String,
) -> Result<Report, Failure> {
    let mut tables = Vec::new();
    for trial in &bundle.trials {
        let file = file_of(bundle, trial.number)?;
        let table = rows::read(&file)?;
        tables.push((file, table));
    }
    check_columns(arguments, &tables)?;
    let mut report = Report::new(arguments, out);
    for (file, table) in &mut tables {
        let there: Vec<&str> = table.names().collect();
        let asked = arguments.columns.iter().filter(|name| there.contains(&name.as_str())).cloned();
        let asked = asked.collect();
        let name = shown(file);
        let columns = match arguments.columns.is_empty() {
            true => rows::usable(ui, &name, table, rows::measured(table), arguments),
            false => asked,
        };
        if columns.is_empty() {
            ui.warn(format_args!("{name}: it has none of the columns and is copied as it is"));
        }
        let pipeline = arguments.pipeline();
        let done = rows::filter(&name, table, &arguments.time, &columns, &pipeline)?;
        report.add(name, columns, done);
    }
    if !arguments.dry_run {
        fill_folder(out, |new| write(new, bundle, &tables, &report))?;
    }
    Ok(report)
}

/// The file of a trial: its number may have any number of digits.
fn file_of(bundle: &Bundle, number: u32) -> Result<PathBuf, Failure> {
    let folder = bundle.path.join("trials");
    let failed = |e| Failure::input(format!("cannot read {}: {e}", folder.display()));
    let mut files =
        fs::read_dir(&folder).map_err(failed)?.filter_map(|entry| Some(entry.ok()?.path()));
    let is_it = |path: &PathBuf| {
        let stem = path.file_stem().and_then(|stem| stem.to_str());
        let is_csv = path.extension().is_some_and(|ending| ending == "csv");
        is_csv && stem.and_then(|stem| stem.parse().ok()) == Some(number)
    };
    files.find(is_it).ok_or_else(|| failed(io::ErrorKind::NotFound.into()))
}

/// Refuses a bundle without trials, without measurements, or without a column that is asked for.
fn check_columns(arguments: &FilterArguments, tables: &[(PathBuf, Table)]) -> Result<(), Failure> {
    let source = arguments.source.display();
    if tables.is_empty() {
        let message = format!("{source}: there are no trials, so there is nothing to filter");
        return Err(Failure::input(message + "\n  fix: add trials/000.csv"));
    }
    let names: Vec<&str> = tables.iter().flat_map(|(_, table)| table.names()).collect();
    let absent = arguments.columns.iter().filter(|own| !names.contains(&own.as_str()));
    let lines: Vec<String> = absent
        .map(|own| {
            let hint = nearest(own, &names).map(|near| format!("; did you mean `{near}`?"));
            format!("{source}: no trial has a column `{own}`{}", hint.unwrap_or_default())
        })
        .collect();
    if !lines.is_empty() {
        let fix = "\n  fix: `cathforce filter` without --column takes what was measured";
        return Err(Failure::new(Code::Input, lines.join("\n") + fix));
    }
    if tables
        .iter()
        .all(|(_, table)| rows::measured(table).is_empty() && arguments.columns.is_empty())
    {
        let message = format!(
            "{source}: no trial measures a force, a tip or a shape, so there is nothing to filter\n  \
             fix: add the columns of a sensor, such as fx_N, fy_N, fz_N"
        );
        return Err(Failure::input(message));
    }
    Ok(())
}

fn write(
    new: &Path,
    bundle: &Bundle,
    tables: &[(PathBuf, Table)],
    report: &Report,
) -> io::Result<()> {
    for file in std::iter::once("rig.toml").chain(VESSEL_FILES) {
        let from = bundle.path.join(file);
        if from.is_file() {
            fs::copy(from, new.join(file))?;
        }
    }
    fs::create_dir(new.join("trials"))?;
    for (file, table) in tables {
        let file = fs::File::create(new.join("trials").join(file.file_name().unwrap_or_default()))?;
        table.write(io::BufWriter::new(file))?;
    }
    let text = to_json(report).map_err(|failure| io::Error::other(failure.message))?;
    fs::write(new.join("filter.json"), text + "\n")?;
    let readme = format!(
        "# {}\n\n**Filtered**: `cathforce filter` made the trials of measured ones; filter.json says \
         how. The noise that rig.toml states is that of the measured ones, which is larger.\n",
        bundle.rig.name
    );
    fs::write(new.join("README.md"), readme)
}
