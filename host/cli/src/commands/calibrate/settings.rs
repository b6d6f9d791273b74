//! The result as settings, which `cathforce config apply` takes.

use std::path::Path;

use cathforce_config::{Key, keys};
use serde::Serialize;

use super::data::Data;
use crate::args::CalibrateArguments;
use crate::commands::gap::apply::described;
use crate::failure::{Code, Failure};
use crate::settings::units::unit;
use crate::settings::{Setting, SettingsFile, replaceable};

/// A setting that changes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Change {
    pub name: String,
    /// What the file said, or rig.toml.
    pub old: f32,
    pub new: f32,
    pub unit: &'static str,
}

impl Change {
    pub fn text(&self) -> String {
        let unit = Key::find(&self.name).map_or(String::new(), unit);
        format!("{}: {} -> {}{unit}", self.name, self.old, self.new)
    }
}

/// What the settings file holds already. Refuses, before the work, one that cannot be written.
pub fn known(arguments: &CalibrateArguments, data: &Data) -> Result<SettingsFile, Failure> {
    let rigs = data.rigs();
    let new = SettingsFile { rig: rigs[0].to_owned(), ..SettingsFile::default() };
    let Some(path) = &arguments.settings else { return Ok(new) };
    if let Some(other) = rigs.iter().find(|rig| **rig != rigs[0]) {
        let message = format!(
            "a settings file is for one rig, and the bundles are of `{}` and `{other}`\n  fix: leave \
             --settings out, and set the values for each rig with `cathforce config set`",
            rigs[0]
        );
        return Err(Failure::new(Code::Usage, message));
    }
    replaceable(path)?;
    if !path.exists() {
        return Ok(new);
    }
    let file = SettingsFile::read(path)?;
    file.check_rig(path, rigs[0])?;
    Ok(file)
}

/// What changes, in the order of the settings.
pub fn changes(
    data: &Data,
    old: &SettingsFile,
    values: &[(&str, f32)],
) -> Result<Vec<Change>, Failure> {
    let description = described(&data.first().bundle, old)?;
    let change = |key: Key| {
        let (name, new) = values.iter().find(|(name, _)| *name == key.name())?;
        let old = description.parameter(name)?;
        let (name, new) = ((*name).to_owned(), *new);
        (old != new).then_some(Change { name, old, new, unit: key.unit() })
    };
    Ok(keys().filter_map(change).collect())
}

/// Writes the values into the file, whole or not at all.
pub fn write(path: &Path, old: &SettingsFile, values: &[(&str, f32)]) -> Result<(), Failure> {
    let mut new = old.clone();
    for (name, value) in values {
        new.set.insert((*name).to_owned(), Setting::ByHand(*value));
    }
    new.write(path)?.commit()
}
