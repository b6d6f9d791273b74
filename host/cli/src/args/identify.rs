//! Arguments of `cathforce identify`.

use std::path::PathBuf;

use cathforce_identification::Kind;
use clap::{Args, Subcommand, ValueEnum};

use super::JsonFile;

#[derive(Debug, Args)]
pub struct IdentifyArguments {
    #[command(subcommand)]
    pub action: IdentifyAction,
}

#[derive(Debug, Subcommand)]
pub enum IdentifyAction {
    /// Find a catheter's parameters with which simulated experiments are like the recorded ones.
    Fit(IdentifyFitArguments),
    /// Write a description and made records of a catheter that is known.
    Example(IdentifyExampleArguments),
}

#[derive(Debug, Args)]
pub struct IdentifyFitArguments {
    /// Catheter, experiment, records, noise of the sensor and bounds of the parameters.
    #[arg(value_name = "DESCRIPTION.toml")]
    pub description: PathBuf,
    #[command(flatten)]
    pub json_file: JsonFile,
}

#[derive(Debug, Args)]
pub struct IdentifyExampleArguments {
    /// Experiment.
    #[arg(value_enum)]
    pub kind: KindName,
    /// Write the description and the records into this new folder.
    #[arg(value_name = "FOLDER")]
    pub out: PathBuf,
}

/// An experiment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum KindName {
    /// A weight at the tip is cut off.
    WeightRelease,
    /// A tendon is pulled back and forth.
    TendonHysteresis,
    /// The tip moves in a pulsating flow.
    PulsatileFlow,
}

impl KindName {
    pub fn kind(self) -> Kind {
        match self {
            Self::WeightRelease => Kind::WeightRelease,
            Self::TendonHysteresis => Kind::TendonHysteresis,
            Self::PulsatileFlow => Kind::PulsatileFlow,
        }
    }
}
