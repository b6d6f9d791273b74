//! Arguments of `cathforce config`.

use std::path::PathBuf;

use cathforce_config::Key;
use clap::{Args, Subcommand};

use super::{Changes, JsonFile, lead, link, lumen, setting};

#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct ConfigArguments {
    #[command(subcommand)]
    pub action: Option<ConfigAction>,
}

#[derive(Debug, Subcommand)]
pub enum ConfigAction {
    /// List every setting with its default, range and meaning; `cathforce config` alone does too.
    List(ConfigListArguments),
    /// Make a settings file for a bundle that holds every setting as a comment.
    Init(ConfigInitArguments),
    /// Show the values that a bundle gives, or that a device uses.
    Show(ConfigShowArguments),
    /// Print one value.
    Get(ConfigGetArguments),
    /// Change values in a settings file; comments stay.
    Set(ConfigSetArguments),
    /// Compare two settings files, or a settings file with a device.
    Diff(ConfigDiffArguments),
    /// Check a settings file or a bundle, and warn of values in the wrong unit.
    Validate(ConfigValidateArguments),
    /// Configure a device with a bundle and a settings file, and say what changes.
    Apply(ConfigApplyArguments),
    /// Let a device keep what it uses over a reset, or write it into a settings file that reproduces it.
    Save(ConfigSaveArguments),
    /// Configure a device with a file of an older version, and list what is left out.
    Restore(ConfigApplyArguments),
    /// Read from a master's DBC where its frames hold the drives' positions.
    ImportDbc(ConfigImportDbcArguments),
    /// Print the JSON schema of settings files.
    Schema(JsonFile),
    /// Write the device image of a bundle.
    Image(ConfigImageArguments),
}

#[derive(Debug, Default, Args)]
pub struct ConfigListArguments {
    /// List only the settings whose name contains this.
    #[arg(value_name = "NAME")]
    pub name: Option<String>,
    #[command(flatten)]
    pub json_file: JsonFile,
}

#[derive(Debug, Args)]
pub struct ConfigInitArguments {
    /// Trial bundle.
    pub bundle: PathBuf,
    /// New settings file.
    #[arg(value_name = "FILE.toml")]
    pub file: PathBuf,
}

/// Where values come from.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
pub struct ConfigSource {
    /// Trial bundle.
    pub bundle: Option<PathBuf>,
    /// Ask the device behind this link.
    #[arg(long, value_parser = link::address)]
    pub link: Option<String>,
}

#[derive(Debug, Args)]
pub struct ConfigShowArguments {
    #[command(flatten)]
    pub source: ConfigSource,
    /// Say where each value comes from.
    #[arg(long)]
    pub origin: bool,
    #[command(flatten)]
    pub changes: Changes,
    #[command(flatten)]
    pub json_file: JsonFile,
}

#[derive(Debug, Args)]
#[command(allow_missing_positional = true)]
pub struct ConfigGetArguments {
    /// Trial bundle or settings file.
    #[arg(value_name = "BUNDLE|FILE.toml", required_unless_present = "link")]
    pub source: Option<PathBuf>,
    /// Name of the setting; `cathforce config list` lists them.
    #[arg(required = true)]
    pub name: String,
    /// Ask the device behind this link.
    #[arg(long, conflicts_with = "source", value_parser = link::address)]
    pub link: Option<String>,
    #[command(flatten)]
    pub changes: Changes,
}

impl ConfigGetArguments {
    /// Source and name. Earlier versions took the name first, which is understood as well.
    pub fn source_and_name(&self) -> (Option<PathBuf>, String) {
        let first = self.source.as_ref().and_then(|path| path.to_str());
        match first {
            Some(first) if Key::find(first).is_some() && Key::find(&self.name).is_none() => {
                (Some(PathBuf::from(&self.name)), first.to_owned())
            }
            _ => (self.source.clone(), self.name.clone()),
        }
    }
}

#[derive(Debug, Args)]
pub struct ConfigSetArguments {
    /// Settings file to change.
    #[arg(value_name = "FILE.toml")]
    pub file: PathBuf,
    /// Settings and their new values.
    #[arg(required = true, value_name = "NAME=VALUE", value_parser = setting)]
    pub values: Vec<(String, f32)>,
}

#[derive(Debug, Args)]
pub struct ConfigDiffArguments {
    /// Settings file, or link of a device.
    #[arg(value_name = "FILE|LINK")]
    pub first: String,
    /// Settings file or link to compare it with [default: the default values]
    #[arg(value_name = "FILE|LINK")]
    pub second: Option<String>,
    #[command(flatten)]
    pub json_file: JsonFile,
}

#[derive(Debug, Args)]
pub struct ConfigValidateArguments {
    /// Settings file or trial bundle.
    #[arg(value_name = "FILE.toml|BUNDLE")]
    pub path: PathBuf,
}

#[derive(Debug, Args)]
pub struct ConfigApplyArguments {
    /// Trial bundle.
    pub bundle: PathBuf,
    /// Settings file.
    #[arg(value_name = "FILE.toml")]
    pub file: PathBuf,
    /// Link of the device.
    #[arg(long, value_parser = link::address)]
    pub link: String,
    /// Show what would change, and change nothing.
    #[arg(long)]
    pub dry_run: bool,
    /// List every value, also for a device that has no configuration yet.
    #[arg(long)]
    pub all: bool,
    /// Grid spacing of the vessel's wall [default: 1]
    #[arg(long, value_name = "MM", value_parser = lumen::cell_mm)]
    pub cell: Option<f64>,
}

impl ConfigApplyArguments {
    /// Bundle and file. Earlier versions took the file first; a bundle is a folder, so both orders
    /// are understood.
    pub fn bundle_and_file(&self) -> (&PathBuf, &PathBuf) {
        match self.file.is_dir() && !self.bundle.is_dir() {
            true => (&self.file, &self.bundle),
            false => (&self.bundle, &self.file),
        }
    }
}

#[derive(Debug, Args)]
pub struct ConfigSaveArguments {
    /// Trial bundle that the device was configured from. Without it the device saves its image in its flash.
    #[arg(requires = "file")]
    pub bundle: Option<PathBuf>,
    /// Settings file to write; an existing settings file is replaced.
    #[arg(value_name = "FILE.toml")]
    pub file: Option<PathBuf>,
    /// Link of the device.
    #[arg(long, value_parser = link::address)]
    pub link: String,
    /// Grid spacing that the device was configured with [default: 1]
    #[arg(long, value_name = "MM", value_parser = lumen::cell_mm, requires = "bundle")]
    pub cell: Option<f64>,
}

/// Without signals, this lists the signals of the DBC. A signal is named MESSAGE.SIGNAL.
#[derive(Debug, Args)]
pub struct ConfigImportDbcArguments {
    /// DBC of the master's bus.
    #[arg(value_name = "FILE.dbc")]
    pub dbc: PathBuf,
    /// Settings file to write the signals into.
    #[arg(long, value_name = "FILE.toml", requires = "insertion")]
    pub settings: Option<PathBuf>,
    /// List messages and signals, and write nothing.
    #[arg(long)]
    pub list: bool,
    /// Insertion of the catheter's drive.
    #[arg(long, value_name = "SIGNAL", requires = "rotation", requires = "settings")]
    pub insertion: Option<String>,
    /// Rotation of the catheter's drive.
    #[arg(long, value_name = "SIGNAL", requires = "insertion")]
    pub rotation: Option<String>,
    /// Button of the catheter, if it has one; the signal is 1 while it is held.
    #[arg(long, value_name = "SIGNAL", requires = "insertion")]
    pub button: Option<String>,
    /// Our identifiers were moved to 29 bits, so that a drive of CANopen may be on the bus.
    #[arg(long)]
    pub id_moved: bool,
    /// Millimetres of feed in one turn, for drives whose feed is counted in revolutions.
    #[arg(long, value_name = "MM", value_parser = lead, allow_negative_numbers = true)]
    pub lead: Option<f64>,
    /// Grip of the handle; a value of one half or more means gripped.
    #[arg(long, value_name = "SIGNAL", requires = "insertion")]
    pub grip: Option<String>,
    /// Insertion of the guidewire's drive.
    #[arg(long, value_name = "SIGNAL", requires = "guidewire_rotation")]
    pub guidewire_insertion: Option<String>,
    /// Rotation of the guidewire's drive.
    #[arg(long, value_name = "SIGNAL", requires = "guidewire_insertion")]
    pub guidewire_rotation: Option<String>,
    /// Button of the guidewire; the signal is 1 while it is held.
    #[arg(long, value_name = "SIGNAL", requires = "guidewire_insertion")]
    pub guidewire_button: Option<String>,
}

#[derive(Debug, Args)]
pub struct ConfigImageArguments {
    /// Trial bundle.
    pub bundle: PathBuf,
    /// Device image to write; an existing image is replaced.
    #[arg(long, value_name = "FILE.cfim")]
    pub out: PathBuf,
    #[command(flatten)]
    pub changes: Changes,
}
