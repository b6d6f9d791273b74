//! One table: its file, its columns, and what is wrong with them.

use std::path::Path;

use cathforce_bundle::bundle::columns;
use cathforce_bundle::nearest;
use cathforce_filter::{Done, Pipeline, Table, TableCause, TableError};

use crate::args::FilterArguments;
use crate::failure::{Code, Failure};
use crate::open::read_text;
use crate::ui::Ui;

/// Reads a table; its faults have its file and line.
pub fn read(path: &Path) -> Result<Table, Failure> {
    let text = read_text(path)?;
    Table::read(&text).map_err(|error| at(&path.display().to_string(), None, &[error]))
}

/// The columns that are asked for, or those that a trial's sensors measured.
pub fn columns(
    ui: &Ui,
    path: &Path,
    table: &Table,
    arguments: &FilterArguments,
) -> Result<Vec<String>, Failure> {
    if !arguments.columns.is_empty() {
        return Ok(arguments.columns.clone());
    }
    let found = measured(table);
    if found.is_empty() {
        let names = table.names().collect::<Vec<_>>().join(", ");
        let message = format!(
            "{}: no column has the name of a measured one of a trial, such as fx_N\n  fix: say which to \
             filter with --column; there are {names}",
            path.display()
        );
        return Err(Failure::new(Code::Usage, message));
    }
    Ok(usable(ui, &path.display().to_string(), table, found, arguments))
}

/// The columns without those that were measured now and then by a clock of their own; they stay as they
/// are, with a warning. Where no other is left all are given, and refused when they are filtered.
pub fn usable(
    ui: &Ui,
    shown: &str,
    table: &Table,
    columns: Vec<String>,
    arguments: &FilterArguments,
) -> Vec<String> {
    let pipeline = arguments.pipeline();
    let why = |name: &String| table.sparse_and_uneven(&arguments.time, name, &pipeline);
    let why: Vec<Option<TableError>> = columns.iter().map(why).collect();
    if why.iter().all(Option::is_some) {
        return columns;
    }
    for TableError { line, cause } in why.iter().flatten() {
        ui.warn(format_args!("{shown}:{line}: {cause}; the column stays as it was measured"));
    }
    columns.into_iter().zip(why).filter(|(_, why)| why.is_none()).map(|(name, _)| name).collect()
}

/// What sensors measured: neither times nor the encoders of drives, which are the inputs of the model.
pub fn measured(table: &Table) -> Vec<String> {
    let single = [
        &columns::FORCE[..],
        &[columns::DRIVE_FORCE, columns::GUIDEWIRE_DRIVE_FORCE, columns::COMMAND],
        &columns::TIP,
    ]
    .concat();
    let is_shape = |name: &str| {
        let digits = name.strip_prefix('p').and_then(|rest| rest.split_once('_'));
        digits.is_some_and(|(k, _)| {
            k.parse::<usize>().is_ok_and(|k| columns::shape_point(k).contains(&name.to_owned()))
        })
    };
    let names = table.names().filter(|name| single.contains(name) || is_shape(name));
    names.map(str::to_owned).collect()
}

/// Filters columns of a table. `shown`: how its file is called in an error.
pub fn filter(
    shown: &str,
    table: &mut Table,
    time: &str,
    columns: &[String],
    pipeline: &Pipeline,
) -> Result<Vec<Done>, Failure> {
    let done = table.filter(time, columns, pipeline);
    done.map_err(|errors| at(shown, Some(table), &errors))
}

/// All faults of a file, each with its line and its fix.
fn at(shown: &str, table: Option<&Table>, errors: &[TableError]) -> Failure {
    let fix = |cause: &TableCause| match (cause, table) {
        (TableCause::NoColumn(name), Some(table)) => {
            let names: Vec<&str> = table.names().collect();
            match nearest(name, &names) {
                Some(near) => format!("write `{near}` if you meant that"),
                None => format!("name one of {}", names.join(", ")),
            }
        }
        _ => cause.fix(),
    };
    let line = |TableError { line, cause }: &TableError| {
        format!("{shown}:{line}: {cause}\n  fix: {}", fix(cause))
    };
    Failure::input(errors.iter().map(line).collect::<Vec<_>>().join("\n"))
}
