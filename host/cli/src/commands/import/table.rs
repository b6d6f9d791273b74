//! `cathforce import csv`.

use cathforce_recording::import::{ImportedTable, read_csv};
use serde_json::json;

use super::trial::{at, open, warn_all, write};
use crate::args::ImportCsvArguments;
use crate::failure::Failure;
use crate::output::{check_new, shown};
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &ImportCsvArguments) -> Result<(), Failure> {
    let (path, out) = (&arguments.table, &arguments.out);
    check_new(out)?;
    let ImportedTable { trial, remarks } =
        read_csv(open(path)?, &arguments.columns).map_err(|e| at(path, &e))?;
    warn_all(ui, path, &remarks);
    let rows = trial.rows();
    let json = json!({ "path": shown(out), "rows": rows, "left_out": 0 });
    let out = (!arguments.dry_run).then_some(&**out);
    write(ui, out, &trial, &json, &format!("{rows} rows"))
}
