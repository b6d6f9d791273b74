//! Arguments of `cathforce bundle`.

use std::path::PathBuf;

use cathforce_bundle::TemplatePlant;
use clap::{Args, Subcommand, ValueEnum};

#[derive(Debug, Args)]
pub struct BundleArguments {
    #[command(subcommand)]
    pub action: BundleAction,
}

#[derive(Debug, Subcommand)]
pub enum BundleAction {
    /// Write a bundle to begin with: every key of rig.toml explained, a vessel and a trial.
    Init(BundleInitArguments),
}

#[derive(Debug, Args)]
pub struct BundleInitArguments {
    /// Folder to write into. It is made; one that is there must be empty.
    #[arg(value_name = "FOLDER")]
    pub folder: PathBuf,
    /// What the rig has: an instrument in a vessel, one axis on its own, or a transmission.
    #[arg(long, value_enum, default_value_t = Plant::Catheter)]
    pub plant: Plant,
}

/// As `plant` in rig.toml.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Plant {
    Catheter,
    Drive,
    Transmission,
}

impl From<Plant> for TemplatePlant {
    fn from(plant: Plant) -> Self {
        match plant {
            Plant::Catheter => Self::Catheter,
            Plant::Drive => Self::Drive,
            Plant::Transmission => Self::Transmission,
        }
    }
}
