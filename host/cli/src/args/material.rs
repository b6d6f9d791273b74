//! Arguments of `cathforce material`.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

use super::{JsonFile, positive};

#[derive(Debug, Args)]
pub struct MaterialArguments {
    #[command(subcommand)]
    pub action: MaterialAction,
}

#[derive(Debug, Subcommand)]
pub enum MaterialAction {
    /// Fit the laws of a wall's material to a tensile test.
    Fit(MaterialFitArguments),
}

#[derive(Debug, Args)]
pub struct MaterialFitArguments {
    /// Tensile test: `stretch` or `strain` with `nominal_stress_MPa` or `true_stress_MPa`, or
    /// `extension_mm` with `force_N`.
    #[arg(value_name = "CURVE.csv")]
    pub curve: PathBuf,
    /// Fit only this law. May be repeated [default: all]
    #[arg(long = "law", value_enum)]
    pub laws: Vec<LawName>,
    /// Unloaded length that the extension belongs to.
    #[arg(long, value_name = "MM", value_parser = millimetres)]
    pub gauge_mm: Option<f64>,
    /// Unloaded cross-section of the specimen.
    #[arg(long, value_name = "MM2", value_parser = square_millimetres)]
    pub area_mm2: Option<f64>,
    /// Stress in a column that does not say it: over the unloaded or over the stretched area.
    #[arg(long, value_enum)]
    pub stress: Option<Stress>,
    /// Formulas of the laws: the stress of each law's energy, or those printed in Pescio et al. 2025,
    /// which set true stress equal to nominal.
    #[arg(long, value_enum, default_value_t)]
    pub form: FormName,
    #[command(flatten)]
    pub json_file: JsonFile,
}

/// A law of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LawName {
    Elastic,
    NeoHookean,
    MooneyRivlin,
    Ogden,
}

/// The area that a stress is related to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Stress {
    /// The unloaded area: engineering stress.
    Nominal,
    /// The stretched area: Cauchy stress.
    True,
}

/// How a law's formula meets the stress of a curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum FormName {
    /// The stress that follows from the law's energy.
    #[default]
    Consistent,
    /// As printed in Pescio et al. 2025, Table 2.
    Printed,
}

pub(super) fn millimetres(text: &str) -> Result<f64, String> {
    positive(text, "a number of millimetres above 0")
}

fn square_millimetres(text: &str) -> Result<f64, String> {
    positive(text, "a number of square millimetres above 0")
}
