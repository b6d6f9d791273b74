//! Arguments of `cathforce lumen`.

use std::path::PathBuf;

use cathforce_bundle::geometry::SurfaceModel;
use clap::{Args, ValueEnum};

#[derive(Debug, Args)]
pub struct LumenArguments {
    /// Surface mesh (STL, in millimetres) or trial bundle.
    #[arg(value_name = "MESH|BUNDLE")]
    pub path: PathBuf,
    /// Grid spacing [default: 1]
    #[arg(long, value_name = "MM", value_parser = cell_mm)]
    pub cell: Option<f64>,
    /// Outer diameter of the instrument [default: that of the bundle, or 3 for a mesh]
    #[arg(long, value_name = "MM", value_parser = diameter_mm)]
    pub diameter: Option<f64>,
    /// Shape of the wall between the vertices of a mesh.
    #[arg(long, value_enum, default_value_t)]
    pub surface: Surface,
    /// Write the field into this file, in the format that the device reads.
    #[arg(long, value_name = "FILE.bin")]
    pub out: Option<PathBuf>,
}

/// The wall between the vertices of a mesh.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub enum Surface {
    /// Curved through the vertices, so that the edges of a coarse mesh are not felt.
    #[default]
    Smooth,
    /// Flat facets, as in the file.
    Flat,
}

impl From<Surface> for SurfaceModel {
    fn from(surface: Surface) -> Self {
        match surface {
            Surface::Smooth => Self::Smooth,
            Surface::Flat => Self::Faceted,
        }
    }
}

pub(super) fn cell_mm(text: &str) -> Result<f64, String> {
    between(text, 0.1, 3.0)
}

fn diameter_mm(text: &str) -> Result<f64, String> {
    between(text, 0.1, 12.0)
}

fn between(text: &str, low_mm: f64, high_mm: f64) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|x| (low_mm..=high_mm).contains(x));
    value.ok_or_else(|| format!("give millimetres from {low_mm} to {high_mm}"))
}
