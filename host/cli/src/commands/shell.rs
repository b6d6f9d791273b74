//! `cathforce completions` and `cathforce man`: made from the arguments themselves.

use std::path::Path;

use clap::CommandFactory;
use serde_json::json;

use crate::args::{Arguments, CompletionsArguments, ManArguments};
use crate::failure::Failure;
use crate::output::shown;
use crate::ui::Ui;

const NAME: &str = "cathforce";

pub fn completions(ui: &Ui, arguments: &CompletionsArguments) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Arguments::command(), NAME, &mut script);
    let script = String::from_utf8_lossy(&script);
    ui.data(&json!({ "shell": arguments.shell.to_string(), "script": script }), &script)
}

pub fn man(ui: &Ui, arguments: &ManArguments) -> Result<(), Failure> {
    let folder: &Path = &arguments.folder;
    let failed = |e: std::io::Error| Failure::write(folder, e);
    std::fs::create_dir_all(folder).map_err(failed)?;
    clap_mangen::generate_to(Arguments::command(), folder).map_err(failed)?;
    let first = folder.join(format!("{NAME}.1"));
    ui.data(
        &json!({ "path": shown(folder) }),
        format_args!(
            "pages: {}\nread the first with `man {}`\n",
            folder.display(),
            first.display()
        ),
    )
}
