//! `--out FILE.json` of the commands whose result is worth keeping.

use std::fmt::Display;
use std::io::{Write as _, stdout};
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::{Kind, check_again, write_again};
use crate::failure::Failure;
use crate::ui::{Ui, to_json};

/// Where a copy of the result goes.
#[derive(Clone, Debug, Default, Args)]
pub struct JsonFile {
    /// Write the result as JSON into this file.
    #[arg(long, value_name = "FILE.json")]
    pub out: Option<PathBuf>,
}

impl JsonFile {
    /// Says before the work, rather than after it, that the file cannot be written.
    pub fn check(&self) -> Result<(), Failure> {
        self.out.as_deref().map_or(Ok(()), |path| check_again(path, Kind::Json))
    }

    /// Writes the result into the file and prints its text.
    ///
    /// The text goes to stdout; with `--json` as well it goes to stderr, so that a script reads
    /// nothing but JSON. Without a file this is [`Ui::data`].
    pub fn write(
        &self,
        ui: &Ui,
        value: &impl Serialize,
        text: impl Display,
    ) -> Result<(), Failure> {
        let Some(path) = &self.out else { return ui.data(value, text) };
        if ui.json {
            ui.say(text.to_string().trim_end());
        } else {
            ui.data(value, text)?;
        }
        let json = to_json(value)? + "\n";
        write_again(path, Kind::Json, &json).inspect_err(|_| {
            // A result that took minutes is not lost with its file.
            let _ = write!(stdout(), "{json}");
        })
    }
}
