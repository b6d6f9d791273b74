//! Settings of one rig, kept in a file: what `--set` takes, with where each comes from.

pub mod band;
pub mod master;
pub mod model;
pub mod parse;
pub mod slip;
mod staged;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use cathforce_config::master::Master;

use crate::failure::{Code, Failure};
use band::StatedBand;
use parse::{Parsed, Problem};
pub use staged::{Staged, replaceable};

/// Version of the file's layout and names that this program writes.
pub const SCHEMA_VERSION: u32 = 1;

/// The file, in TOML.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SettingsFile {
    /// Name of the rig that they are for.
    pub rig: String,
    /// By name, as `--set` takes them.
    pub set: BTreeMap<String, Setting>,
    /// Where the drives' positions stand in the master's frames.
    pub master: Master,
    /// How far the forces may be off, as a diagnosis has found.
    pub band: Option<StatedBand>,
}

/// One setting: a number, or a number with where it comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Setting {
    ByHand(f32),
    Diagnosed {
        value: f32,
        /// The effect.
        effect: String,
    },
}

impl Setting {
    pub fn value(&self) -> f32 {
        match self {
            Self::ByHand(value) | Self::Diagnosed { value, .. } => *value,
        }
    }
}

impl SettingsFile {
    /// Reads a file in which every name and value must be one.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let parsed = parse_file(path)?;
        let problems = parsed.entries.iter().filter_map(parse::problem).collect::<Vec<_>>();
        if problems.is_empty() { Ok(parsed.into()) } else { Err(refused(path, &problems)) }
    }

    /// Refuses the settings of another rig.
    pub fn check_rig(&self, path: &Path, rig: &str) -> Result<(), Failure> {
        if self.rig == rig {
            return Ok(());
        }
        Err(Failure::input(format!(
            "{}: these are settings of the rig `{}`, not of `{rig}`\n  fix: give the file of this \
             rig",
            path.display(),
            self.rig
        )))
    }

    /// Names of what somebody set by hand and makes another model of the rig.
    pub fn by_hand(&self) -> Vec<String> {
        let by_hand = self.set.iter().filter(|(_, setting)| matches!(setting, Setting::ByHand(_)));
        by_hand.map(|(name, _)| name).filter(|name| model::is_of_model(name)).cloned().collect()
    }

    /// As TOML. Numbers are written so that they read back to the bit.
    pub fn text(&self) -> String {
        let mut text = format!(
            "# Settings of cathforce for one rig: `--settings` takes this file, `cathforce config` \
             explains names.\nschema_version = {SCHEMA_VERSION}\nrig = {}\n\n[set]\n",
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

    /// Writes the file whole or not at all: a new one takes the place of the old one only after
    /// it has been read back and found the same.
    pub fn write(&self, path: &Path) -> Result<Staged, Failure> {
        let staged = Staged::new(path, &self.text())?;
        if Self::read(staged.written())? != *self {
            let message = format!("{}: what was written reads back differently", path.display());
            return Err(Failure::new(Code::Failed, message));
        }
        Ok(staged)
    }
}

/// Where a master's own frames have the drives' positions, as a file says; ours without a file.
pub fn master_of(path: Option<&Path>) -> Result<Master, Failure> {
    Ok(path.map(SettingsFile::read).transpose()?.map_or_else(Master::default, |file| file.master))
}

/// What a file says, whether its names and values are any or not.
pub fn parse_file(path: &Path) -> Result<Parsed, Failure> {
    if path.is_dir() {
        let path = path.display();
        return Err(Failure::input(format!(
            "{path} is a folder, and a file of settings is one file\n  fix: give the file; \
             `cathforce config init {path} S.toml` makes one of a bundle"
        )));
    }
    let text = std::fs::read_to_string(path).map_err(|e| {
        let path = path.display();
        Failure::input(format!(
            "cannot read {path}: {e}\n  fix: check the path, or make a file of settings: \
             `cathforce config init BUNDLE {path}`"
        ))
    })?;
    parse::parse(&text).map_err(|problem| refused(path, &[problem]))
}

impl From<Parsed> for SettingsFile {
    fn from(parsed: Parsed) -> Self {
        let set = parsed.entries.into_iter().map(|entry| (entry.name, entry.setting)).collect();
        Self { rig: parsed.rig, set, master: parsed.master, band: parsed.band }
    }
}

/// What is wrong with a file, line by line.
pub fn refused(path: &Path, problems: &[Problem]) -> Failure {
    let line = |Problem { line, message, fix }: &Problem| {
        format!("{}:{line}: {message}\n  fix: {fix}", path.display())
    };
    Failure::input(problems.iter().map(line).collect::<Vec<_>>().join("\n"))
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
        assert!(error.message.contains("not of `b`"), "{}", error.message);
        std::fs::write(&path, "rig = \"a\"\n\n[set]\nforce_gain = \"two\"\n").unwrap();
        let error = SettingsFile::read(&path).unwrap_err();
        assert!(error.message.contains("s.toml:4: "), "{}", error.message);
    }
}
