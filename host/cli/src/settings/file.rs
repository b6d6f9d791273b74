//! A settings file as a whole.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use cathforce_config::master::Master;

use super::band::{self, StatedBand};
use super::entry::{Setting, problem};
use super::parse::{self, Parsed};
use super::problem::refused;
use super::staged::Staged;
use super::{SCHEMA_VERSION, master, model};
use crate::failure::{Code, Failure};

/// The file, in TOML.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SettingsFile {
    /// Name of the rig that they are for.
    pub rig: String,
    /// Settings by name, as `--set` takes them.
    pub set: BTreeMap<String, Setting>,
    /// Where the drives' positions stand in the master's frames.
    pub master: Master,
    /// The uncertainty of the forces, from a diagnosis.
    pub band: Option<StatedBand>,
}

impl SettingsFile {
    /// Reads a file; refuses it with everything that is wrong with it.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let parsed = parse_file(path)?;
        let problems = parsed.entries.iter().filter_map(problem).collect::<Vec<_>>();
        if problems.is_empty() { Ok(parsed.into()) } else { Err(refused(path, &problems)) }
    }

    /// Refuses the settings of another rig.
    pub fn check_rig(&self, path: &Path, rig: &str) -> Result<(), Failure> {
        if self.rig == rig {
            return Ok(());
        }
        Err(Failure::input(format!(
            "{}: these settings are for the rig `{}`, not for `{rig}`\n  fix: give the file of this \
             rig",
            path.display(),
            self.rig
        )))
    }

    /// Names of the settings that were set by hand and change the model of the rig.
    pub fn by_hand(&self) -> Vec<String> {
        let by_hand = self.set.iter().filter(|(_, setting)| matches!(setting, Setting::ByHand(_)));
        by_hand.map(|(name, _)| name).filter(|name| model::is_of_model(name)).cloned().collect()
    }

    /// The file as TOML. Numbers are written so that they read back to the bit.
    pub fn text(&self) -> String {
        let mut text = format!(
            "# Settings of cathforce for one rig. `--settings` takes this file; `cathforce config list` \
             explains the names.\nschema_version = {SCHEMA_VERSION}\nrig = {}\n\n[set]\n",
            toml::Value::from(self.rig.as_str())
        );
        for (name, setting) in &self.set {
            // Writing to a string does not fail.
            let _ = match setting {
                Setting::ByHand(value) => writeln!(text, "\"{name}\" = {value:?}"),
                Setting::Diagnosed { value, effect } => {
                    writeln!(text, "\"{name}\" = {{ value = {value:?}, effect = \"{effect}\" }}")
                }
            };
        }
        text += &master::text(&self.master);
        text += &self.band.as_ref().map(band::text).unwrap_or_default();
        text
    }

    /// Writes the file whole or not at all: the new one replaces the old one only after it was read
    /// back and found equal.
    pub fn write(&self, path: &Path) -> Result<Staged, Failure> {
        let staged = Staged::new(path, &self.text())?;
        if Self::read(staged.written())? != *self {
            let message = format!("{}: the written file reads back differently", path.display());
            return Err(Failure::new(Code::Failed, message));
        }
        Ok(staged)
    }
}

/// Where a master's own frames have the drives' positions, as a file says; without a file, those of
/// cathforce.
pub fn master_of(path: Option<&Path>) -> Result<Master, Failure> {
    Ok(path.map(SettingsFile::read).transpose()?.map_or_else(Master::default, |file| file.master))
}

/// Reads a file whose names and values need not be right.
pub fn parse_file(path: &Path) -> Result<Parsed, Failure> {
    if path.is_dir() {
        let path = path.display();
        return Err(Failure::input(format!(
            "{path} is a folder, not a settings file\n  fix: give a settings file; `cathforce config \
             init {path} S.toml` makes one for a bundle"
        )));
    }
    let text = std::fs::read_to_string(path).map_err(|e| {
        let path = path.display();
        Failure::input(format!(
            "cannot read {path}: {e}\n  fix: check the path, or make a settings file with `cathforce \
             config init BUNDLE {path}`"
        ))
    })?;
    parse::parse(&text).map_err(|problems| refused(path, &problems))
}

impl From<Parsed> for SettingsFile {
    fn from(parsed: Parsed) -> Self {
        let set = parsed.entries.into_iter().map(|entry| (entry.name, entry.setting)).collect();
        Self { rig: parsed.rig, set, master: parsed.master, band: parsed.band }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> SettingsFile {
        let diagnosed = |value, effect: &str| Setting::Diagnosed { value, effect: effect.into() };
        let set = [
            ("force_gain", Setting::ByHand(2.0)),
            ("wall.friction_coefficient", diagnosed(0.460_000_13, "contact.friction")),
            ("effects.wall.narrowing.depth_m", diagnosed(1.234_567_9e-7, "wall.narrowing")),
        ];
        let set = set.map(|(name, setting)| (name.to_owned(), setting)).into();
        SettingsFile { rig: "a \"rig\"".into(), set, ..SettingsFile::default() }
    }

    #[test]
    fn a_file_reads_back_to_the_bit_and_replaces_the_old_one_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rig.toml");
        std::fs::write(&path, "rig = \"old\"\n").unwrap();
        let staged = example().write(&path).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "rig = \"old\"\n");
        staged.commit().unwrap();
        assert_eq!(SettingsFile::read(&path).unwrap(), example());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        drop(example().write(&path).unwrap());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left");
    }

    #[test]
    fn another_rig_and_another_layout_are_refused_with_their_place() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.toml");
        let error = example().check_rig(&path, "b").unwrap_err();
        assert!(error.message.contains("not for `b`"), "{}", error.message);
        std::fs::write(&path, "rig = \"a\"\n\n[set]\nforce_gain = \"two\"\n").unwrap();
        let error = SettingsFile::read(&path).unwrap_err();
        assert!(error.message.contains("s.toml:4: "), "{}", error.message);
    }
}
