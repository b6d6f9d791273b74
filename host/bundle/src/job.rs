//! Builds the lumen of an STL file or a bundle and measures it against its surface and facets.

use std::path::Path;

use crate::bundle::{Bundle, read_mesh};
use crate::geometry::{Mesh, MeshWall, SurfaceModel};
use crate::lumen::{BuiltLumen, LumenOptions, measure_against};
use crate::place::{Place, Warning};
use crate::vessel::{LumenBuildError, LumenReport, QUALITY_POINTS, Vessel};

/// Outer diameter of the instrument that is assumed for a mesh without a bundle \[m\].
const DIAMETER_M: f64 = 3e-3;

/// How to build a lumen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LumenJob {
    /// Grid spacing \[m\].
    pub cell_m: f64,
    /// Outer diameter of the instrument \[m\]; that of the bundle, or 3 mm, when `None`.
    pub outer_diameter_m: Option<f64>,
    pub surface: SurfaceModel,
}

impl LumenJob {
    /// Builds the lumen of an STL file, or of a bundle if `path` is a folder. Adds what looks wrong
    /// to `warnings`, also on failure.
    pub fn run(
        &self,
        path: &Path,
        warnings: &mut Vec<Warning>,
    ) -> Result<(BuiltLumen, LumenReport), LumenBuildError> {
        let (vessel, mesh, bundles_own_m) = if path.is_dir() {
            let bundle = Bundle::open(path)?;
            warnings.extend_from_slice(&bundle.warnings);
            let vessel = Vessel::from_bundle(&bundle, self.surface)?;
            let diameter_m = bundle.catheter().map(|rig| rig.instrument.outer_diameter_m);
            (vessel, bundle.mesh.map(|mesh| mesh.mesh), diameter_m)
        } else {
            let mesh = read_mesh(path, warnings)?.mesh;
            (Vessel::from_mesh(&mesh, self.surface), Some(mesh), None)
        };
        let diameter_m = self.outer_diameter_m.or(bundles_own_m).unwrap_or(DIAMETER_M);
        let options = LumenOptions::for_instrument(0.5 * diameter_m, self.cell_m);
        let (built, mut report) = vessel.lumen(options)?;
        if let Some(mesh) = mesh {
            compare_with_facets(&built, &vessel, mesh, &options, &mut report);
        }
        warnings.extend(report.doubts().into_iter().map(|message| Warning {
            file: path.to_path_buf(),
            place: Place::Whole,
            message,
        }));
        Ok((built, report))
    }
}

/// The wall of an STL file, or of a bundle if `path` is a folder. Adds what looks wrong to `warnings`.
pub fn open_vessel(
    path: &Path,
    surface: SurfaceModel,
    warnings: &mut Vec<Warning>,
) -> Result<Vessel, LumenBuildError> {
    if path.is_dir() {
        let bundle = Bundle::open(path)?;
        warnings.extend_from_slice(&bundle.warnings);
        return Vessel::from_bundle(&bundle, surface);
    }
    Ok(Vessel::from_mesh(&read_mesh(path, warnings)?.mesh, surface))
}

/// Compares with the mesh as it is in the file; the stored surface may be a smooth one.
fn compare_with_facets(
    built: &BuiltLumen,
    vessel: &Vessel,
    mesh: Mesh,
    options: &LumenOptions,
    report: &mut LumenReport,
) {
    let facets = MeshWall::new(mesh, SurfaceModel::Faceted);
    let measured = measure_against(built, vessel.wall(), &facets, options, QUALITY_POINTS);
    (report.facets_m, report.surface_to_facets_m) = measured.unzip();
}
