//! Arguments of `cathforce ultrasound`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::wall::poissons_ratio;
use super::{JsonFile, positive};

#[derive(Debug, Args)]
pub struct UltrasoundArguments {
    #[command(subcommand)]
    pub action: UltrasoundAction,
}

#[derive(Debug, Subcommand)]
pub enum UltrasoundAction {
    /// Find the stiffness of tissue with which a vessel's cross-sections overlap best with the masks of
    /// ultrasound images.
    Fit(UltrasoundFitArguments),
    /// Write the masks that a known stiffness would give.
    Render(UltrasoundRenderArguments),
}

#[derive(Debug, Args)]
pub struct UltrasoundFitArguments {
    /// Block, vessel, probe, poses, forces, masks and bounds.
    #[arg(value_name = "DESCRIPTION.toml")]
    pub description: PathBuf,
    #[command(flatten)]
    pub json_file: JsonFile,
}

#[derive(Debug, Args)]
pub struct UltrasoundRenderArguments {
    /// Block, vessel, probe, poses and forces; the masks that it names need not be there.
    #[arg(value_name = "DESCRIPTION.toml")]
    pub description: PathBuf,
    /// Young's modulus of the tissue in kPa.
    #[arg(long, value_name = "KPA", value_parser = kilopascals)]
    pub youngs_modulus_kpa: f64,
    /// Poisson's ratio of the tissue.
    #[arg(long, value_name = "NU", value_parser = poissons_ratio)]
    pub poissons_ratio: f64,
    /// Write the masks and the description into this new folder.
    #[arg(long, value_name = "FOLDER")]
    pub out: PathBuf,
    /// Add blur, speckle, and an error of registration.
    #[arg(long)]
    pub noise: bool,
    /// Take other noise; the same number gives the same noise.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "noise")]
    pub seed: u64,
}

fn kilopascals(text: &str) -> Result<f64, String> {
    positive(text, "a number of kilopascals above 0")
}
