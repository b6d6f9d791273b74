//! A lumen from an STL file or a bundle, measured against its surface and its facets.

use std::path::Path;

use crate::bundle::{Bundle, read_mesh};
use crate::error::{Place, Warning};
use crate::geometry::{Mesh, MeshWall, SLEEVE_M, SurfaceModel};
use crate::lumen::{BuiltLumen, LumenOptions, measure_against};
use crate::vessel::{LumenBuildError, LumenReport, QUALITY_POINTS, Vessel};

/// Outer diameter of the instrument that a mesh on its own is meant for \[m\].
const DIAMETER_M: f64 = 3e-3;
/// A stored distance that errs by more is worth a finer grid \[m\].
const LARGEST_ERROR_M: f64 = 50e-6;

/// What to build.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LumenJob {
    /// Grid spacing \[m\].
    pub cell_m: f64,
    /// Outer diameter of the instrument \[m\]; that of the bundle, or 3 mm, when `None`.
    pub outer_diameter_m: Option<f64>,
    pub surface: SurfaceModel,
}

impl LumenJob {
    /// Builds the lumen of an STL file, or of a bundle when `path` is a folder. What looks
    /// wrong is added to `warnings`, whether there is a lumen or not.
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
        let doubts = doubts(&report, &options);
        warnings.extend(doubts.into_iter().map(|message| Warning {
            file: path.to_path_buf(),
            place: Place::Whole,
            message,
        }));
        Ok((built, report))
    }
}

/// What is wrong with a lumen that could be built.
fn doubts(report: &LumenReport, options: &LumenOptions) -> Vec<String> {
    let mut doubts = Vec::new();
    let quality = &report.quality;
    let worst_m = quality.distance_m.max;
    let diameter_mm = 2e3 * options.outer_radius_m;
    if quality.points == 0 {
        doubts.push(format!("nowhere is room for an instrument of {diameter_mm:.2} mm"));
    } else if worst_m > LARGEST_ERROR_M {
        let [x, y, z] = quality.worst_at_m.map(|x| 1e3 * x);
        let finer_mm = 1e3 * options.cell_m * LARGEST_ERROR_M / worst_m;
        doubts.push(format!(
            "the stored distance errs by {:.0} µm at ({x:.1}, {y:.1}, {z:.1}) mm; for less than \
             {:.0} µm take a grid of about {finer_mm:.2} mm (--cell)",
            1e6 * worst_m,
            1e6 * LARGEST_ERROR_M
        ));
    }
    doubts.extend(report.doubtful_openings(options.outer_radius_m));
    for opening in report.openings.iter().filter(|opening| opening.sleeve_m < SLEEVE_M) {
        let [x, y, z]: [f64; 3] = (1e3 * opening.centre_m).into();
        doubts.push(format!(
            "past the opening at ({x:.1}, {y:.1}, {z:.1}) mm the wall goes on for {:.1} mm only: \
             another part of the vessel lies there; cut the vessel farther from it",
            1e3 * opening.sleeve_m
        ));
    }
    doubts
}

/// Against the mesh as it is in the file, beside what is stored: a smooth surface.
fn compare_with_facets(
    built: &BuiltLumen,
    vessel: &Vessel,
    mesh: Mesh,
    options: &LumenOptions,
    report: &mut LumenReport,
) {
    let facets = MeshWall::new(mesh, SurfaceModel::Faceted, None);
    let (stored_m, surface_m) =
        measure_against(built, vessel.wall(), &facets, options, QUALITY_POINTS);
    report.facets_m = Some(stored_m);
    report.surface_to_facets_m = Some(surface_m);
}
