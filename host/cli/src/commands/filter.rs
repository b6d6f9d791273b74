//! `cathforce filter`: outliers and noise of a table, of the trials of a bundle, or of a recording.

mod bundle;
mod report;
mod rows;

use std::path::{Path, PathBuf};

use cathforce_recording::{is_recording, write_whole};

use crate::args::FilterArguments;
use crate::failure::{Code, Failure};
use crate::output::{Kind, check_again, check_new, write_again};
use crate::ui::{Ui, to_json};
use report::Report;

pub fn run(ui: &Ui, arguments: &FilterArguments) -> Result<(), Failure> {
    let source = &arguments.source;
    let out = arguments.out.clone().unwrap_or_else(|| beside(source));
    let report = match () {
        () if source.is_dir() => bundle::of_folder(ui, arguments, &out)?,
        () if is_recording(source) => bundle::of_recording(ui, arguments, &out)?,
        () => table(ui, arguments, &out)?,
    };
    if arguments.causal {
        ui.say("causal: every value depends on rows up to its own, and is late by what is stated");
    }
    ui.data(&report, report.text())
}

/// The name of a source with `-filtered`, in its folder; of a recording it is that of a folder.
fn beside(source: &Path) -> PathBuf {
    let whole = if source.is_dir() { source.canonicalize().ok() } else { None };
    let whole = whole.as_deref().unwrap_or(source);
    let mut name = whole.file_stem().unwrap_or_default().to_owned();
    if whole.is_dir() {
        name = whole.file_name().unwrap_or_default().to_owned();
    }
    name.push("-filtered");
    if !whole.is_dir() && !is_recording(whole) {
        name.push(".csv");
    }
    whole.with_file_name(name)
}

/// A table of any kind.
fn table(ui: &Ui, arguments: &FilterArguments, out: &Path) -> Result<Report, Failure> {
    let source = &arguments.source;
    let said = out.with_extension("filter.json");
    if !arguments.dry_run {
        if out.extension().is_some_and(|ending| ending == "json") {
            let message = format!(
                "{}: a filtered table is CSV\n  fix: name a .csv file; what was done is written beside it",
                out.display()
            );
            return Err(Failure::new(Code::Usage, message));
        }
        check_new(out)?;
        check_again(&said, Kind::Json)?;
    }
    let mut table = rows::read(source)?;
    let columns = rows::columns(ui, source, &table, arguments)?;
    let shown = source.display().to_string();
    let done = rows::filter(&shown, &mut table, &arguments.time, &columns, &arguments.pipeline())?;
    let mut report = Report::new(arguments, out);
    report.add(shown, columns, done);
    if !arguments.dry_run {
        write_whole(out, |file| table.write(file)).map_err(|e| Failure::write(out, e))?;
        write_again(&said, Kind::Json, to_json(&report)? + "\n")?;
    }
    Ok(report)
}
