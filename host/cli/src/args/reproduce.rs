//! Arguments of `cathforce reproduce`.

use std::path::{Path, PathBuf};

use cathforce_reproduce::{SYSTEMS, System};
use clap::{ArgMatches, Args};

use super::names;
use crate::output::JsonFile;

#[derive(Debug, Args)]
pub struct ReproduceArguments {
    /// Published systems to compute: pescio, li, cathbot, ice, ultrasound [default: all of them]
    #[arg(value_name = "NAME")]
    pub systems: Vec<String>,
    #[command(flatten)]
    pub json_file: JsonFile,
    /// Write a web page with the table and the drawings into this file.
    #[arg(long, value_name = "FILE.html")]
    pub html: Option<PathBuf>,
    /// Write the table as a page in Markdown into this file.
    #[arg(long, value_name = "FILE.md")]
    pub page: Option<PathBuf>,
}

impl ReproduceArguments {
    /// `reproduce --json FILE.json` is a published spelling of `--json --out FILE.json`.
    pub fn take_file_of_json(&mut self, matches: &ArgMatches) {
        let after = matches.index_of("json").map(|index| index + 1);
        let mut indices = matches.indices_of("systems").into_iter().flatten();
        let Some(at) = after.and_then(|after| indices.position(|index| index == after)) else {
            return;
        };
        let path = Path::new(&self.systems[at]);
        if self.json_file.out.is_none() && path.extension().is_some_and(|ending| ending == "json") {
            self.json_file.out = Some(PathBuf::from(self.systems.remove(at)));
        }
    }

    /// The systems that are asked for, each once, in the order of the table.
    pub fn chosen(&self) -> Result<Vec<&'static System>, String> {
        let known: Vec<&str> = SYSTEMS.iter().map(|system| system.name).collect();
        if let Some(name) = self.systems.iter().find(|name| System::find(name).is_none()) {
            return Err(names::unknown(
                "published system",
                name,
                &known,
                "cathforce reproduce --help",
            ));
        }
        let is_chosen = |system: &&System| {
            self.systems.is_empty() || self.systems.iter().any(|name| name == system.name)
        };
        Ok(SYSTEMS.iter().filter(is_chosen).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chosen(names: &[&str]) -> Result<Vec<&'static str>, String> {
        let arguments = ReproduceArguments {
            systems: names.iter().map(|name| (*name).to_owned()).collect(),
            json_file: JsonFile::default(),
            html: None,
            page: None,
        };
        Ok(arguments.chosen()?.iter().map(|system| system.name).collect())
    }

    #[test]
    fn systems_are_chosen_by_name_and_near_misses_are_named() {
        assert_eq!(chosen(&[]).unwrap().len(), SYSTEMS.len());
        assert_eq!(chosen(&["cathbot", "li", "li"]).unwrap(), ["li", "cathbot"]);
        let error = chosen(&["catbot"]).unwrap_err();
        assert!(error.contains("did you mean `cathbot`?"), "{error}");
    }
}
