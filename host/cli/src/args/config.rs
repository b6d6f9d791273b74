//! Arguments of `cathforce config`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::{Changes, setting};

#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct ConfigArguments {
    #[command(subcommand)]
    pub action: Option<ConfigAction>,
}

#[derive(Debug, Subcommand)]
pub enum ConfigAction {
    /// Make a settings file for a bundle, with every setting in it, as a comment.
    Init(ConfigInitArguments),
    /// Show what a device would be told about a bundle, or what it was told.
    Show(ConfigShowArguments),
    /// Print one value.
    Get(ConfigGetArguments),
    /// Change values in a settings file; comments stay.
    Set(ConfigSetArguments),
    /// Show what differs between two files, or a file and a device.
    Diff(ConfigDiffArguments),
    /// Check a settings file or a bundle, and say what looks like a slip.
    Validate(ConfigValidateArguments),
    /// Configure a device with a bundle and its settings, having shown what changes.
    Apply(ConfigApplyArguments),
    /// Write what a device uses into a settings file, and check that it gives the same again.
    Save(ConfigSaveArguments),
    /// As apply, from a file of an older version: what does not carry over is listed.
    Restore(ConfigApplyArguments),
    /// Take where the drives' positions stand in a master's frames from its DBC.
    ImportDbc(ConfigImportDbcArguments),
    /// Print the JSON schema of settings files.
    Schema(ConfigSchemaArguments),
    /// Write the device image of a bundle.
    Image(ConfigImageArguments),
}

#[derive(Debug, Args)]
pub struct ConfigInitArguments {
    pub bundle: PathBuf,
    /// File to make; must not be there yet.
    #[arg(value_name = "FILE.toml")]
    pub file: PathBuf,
}

/// Where values come from.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
pub struct ConfigSource {
    /// Trial bundle.
    pub bundle: Option<PathBuf>,
    /// Device behind this link.
    #[arg(long)]
    pub link: Option<String>,
}

#[derive(Debug, Args)]
pub struct ConfigShowArguments {
    #[command(flatten)]
    pub source: ConfigSource,
    /// Say of every value where it comes from.
    #[arg(long)]
    pub origin: bool,
    #[command(flatten)]
    pub changes: Changes,
}

#[derive(Debug, Args)]
pub struct ConfigGetArguments {
    /// Name, as `cathforce config` lists it.
    pub name: String,
    // As of `ConfigSource`, whose group would come before the name in the usage.
    /// Trial bundle, or settings file.
    #[arg(value_name = "BUNDLE|FILE.toml", required_unless_present = "link")]
    pub bundle: Option<PathBuf>,
    /// Device behind this link.
    #[arg(long, conflicts_with = "bundle")]
    pub link: Option<String>,
    #[command(flatten)]
    pub changes: Changes,
}

#[derive(Debug, Args)]
pub struct ConfigSetArguments {
    #[arg(value_name = "FILE.toml")]
    pub file: PathBuf,
    /// What to change.
    #[arg(required = true, value_name = "NAME=VALUE", value_parser = setting)]
    pub values: Vec<(String, f32)>,
}

#[derive(Debug, Args)]
pub struct ConfigDiffArguments {
    /// Settings file, or the link of a device.
    #[arg(value_name = "FILE|LINK")]
    pub first: String,
    /// The same; the defaults if not given.
    #[arg(value_name = "FILE|LINK")]
    pub second: Option<String>,
}

#[derive(Debug, Args)]
pub struct ConfigValidateArguments {
    /// Settings file, or trial bundle.
    #[arg(value_name = "FILE.toml|BUNDLE")]
    pub path: PathBuf,
}

#[derive(Debug, Args)]
pub struct ConfigApplyArguments {
    /// Settings file.
    #[arg(value_name = "FILE.toml")]
    pub file: PathBuf,
    pub bundle: PathBuf,
    /// Where the device is.
    #[arg(long)]
    pub link: String,
    /// Show what would change, and change nothing.
    #[arg(long)]
    pub dry_run: bool,
    /// Grid spacing of the vessel's wall; 1 mm if not given.
    #[arg(long, value_name = "MM", value_parser = super::lumen::cell_mm)]
    pub cell: Option<f64>,
}

#[derive(Debug, Args)]
pub struct ConfigSaveArguments {
    /// Bundle that the device was configured from.
    pub bundle: PathBuf,
    /// Settings file to write; an old one is replaced.
    #[arg(value_name = "FILE.toml")]
    pub file: PathBuf,
    /// Where the device is.
    #[arg(long)]
    pub link: String,
    /// Grid spacing that it was configured with; 1 mm if not given.
    #[arg(long, value_name = "MM", value_parser = super::lumen::cell_mm)]
    pub cell: Option<f64>,
}

/// Signals are named MESSAGE.SIGNAL; without any, those that there are are listed.
#[derive(Debug, Args)]
pub struct ConfigImportDbcArguments {
    #[arg(value_name = "FILE.dbc")]
    pub dbc: PathBuf,
    /// Settings file to write them into.
    #[arg(long, value_name = "FILE.toml", requires = "insertion")]
    pub settings: Option<PathBuf>,
    /// List messages and signals.
    #[arg(long)]
    pub list: bool,
    /// Feed of the catheter's drive.
    #[arg(long, value_name = "SIGNAL", requires = "rotation", requires = "settings")]
    pub insertion: Option<String>,
    /// Rotation of the catheter's drive.
    #[arg(long, value_name = "SIGNAL", requires = "insertion")]
    pub rotation: Option<String>,
    /// The catheter's button, if it has one; 1 while it is held.
    #[arg(long, value_name = "SIGNAL", requires = "insertion")]
    pub button: Option<String>,
    /// Whether the handle is gripped; from one half on it is.
    #[arg(long, value_name = "SIGNAL", requires = "insertion")]
    pub grip: Option<String>,
    /// Feed of the guidewire's drive.
    #[arg(long, value_name = "SIGNAL", requires = "guidewire_rotation")]
    pub guidewire_insertion: Option<String>,
    /// Rotation of the guidewire's drive.
    #[arg(long, value_name = "SIGNAL", requires = "guidewire_insertion")]
    pub guidewire_rotation: Option<String>,
    /// The guidewire's button; 1 while it is held.
    #[arg(long, value_name = "SIGNAL", requires = "guidewire_insertion")]
    pub guidewire_button: Option<String>,
}

#[derive(Debug, Args)]
pub struct ConfigSchemaArguments {
    /// Print docs/config.md instead.
    #[arg(long)]
    pub markdown: bool,
}

#[derive(Debug, Args)]
pub struct ConfigImageArguments {
    pub bundle: PathBuf,
    #[arg(long, value_name = "FILE.cfim")]
    pub out: PathBuf,
    #[command(flatten)]
    pub changes: Changes,
}
