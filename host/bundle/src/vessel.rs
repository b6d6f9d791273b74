//! A bundle's vessel as a wall, and as the lumen that the device reads.

use cathforce_mechanics::LumenHeader;
use nalgebra::Vector3;
use thiserror::Error;

use crate::bundle::Bundle;
use crate::entry::{VesselCause, no_entry};
use crate::error::BundleError;
use crate::geometry::{Mesh, MeshWall, Opening, RegionalWall, SurfaceModel, TubeWall, Wall};
use crate::lumen::{
    BuiltLumen, DEVICE_LUMEN_BYTES, LumenOptions, LumenQuality, Spread, build_lumen, may_fit,
    measure, widest_m,
};
use crate::place::Place;
use crate::rig::{CatheterRig, WallRegion};

/// Grid spacing unless another is asked for \[m\].
pub const CELL_M: f64 = 1e-3;
/// Points at which a lumen is compared with the exact wall.
pub(crate) const QUALITY_POINTS: usize = 20_000;

/// Grid spacings that are tried for advice when a lumen does not fit \[m\].
const COARSER_M: [f64; 9] =
    [0.3e-3, 0.4e-3, 0.5e-3, 0.6e-3, 0.8e-3, 1.0e-3, 1.25e-3, 1.5e-3, 2.0e-3];

/// Properties of a lumen that was built.
#[derive(Clone, Debug, PartialEq)]
pub struct LumenReport {
    /// Where the wall came from.
    pub source: WallSource,
    /// Size of directory and bricks.
    pub bytes: usize,
    /// Bricks stored.
    pub bricks: usize,
    /// Bricks that were replaced by eight of half the spacing, and bricks that had no room for that.
    pub fine: [usize; 2],
    /// Grid spacing \[m\].
    pub cell_m: f64,
    /// Outer radius of the instrument that it is made for \[m\].
    pub outer_radius_m: f64,
    /// Where the surface of a mesh ends; empty for a centreline.
    pub openings: Vec<Opening>,
    /// Gaps in a mesh that were closed.
    pub gaps: usize,
    /// Largest distance of a smooth surface from the facets of its mesh, and the place \[m\].
    pub off_facets: Option<(f64, Vector3<f64>)>,
    /// Radius of the widest of a few hundred sampled places \[m\].
    pub widest_m: f64,
    /// Diagonal of the box around the wall \[m\].
    pub span_m: f64,
    /// Errors against the surface that is stored.
    pub quality: LumenQuality,
    /// Errors against the flat facets of the mesh \[m\], if asked for.
    pub facets_m: Option<Spread>,
    /// Distance of the surface from the flat facets of its mesh \[m\], if asked for.
    pub surface_to_facets_m: Option<Spread>,
    /// Set if the device has no room for it.
    pub too_large: Option<LumenTooLarge>,
}

/// A lumen that the device has no room for.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error(
    "the lumen takes {bytes} bytes on a grid of {:.2} mm; the device has room for \
     {DEVICE_LUMEN_BYTES}\n  fix: {}", 1e3 * .cell_m, coarser(.fitting)
)]
pub struct LumenTooLarge {
    pub bytes: usize,
    /// Grid spacing \[m\].
    pub cell_m: f64,
    /// The finest of a few coarser grids that fits \[m\], with its bytes.
    pub fitting: Option<(f64, usize)>,
}

fn coarser(fitting: &Option<(f64, usize)>) -> String {
    let cut = "cut the vessel to the part that the instrument reaches";
    match fitting {
        Some((cell_m, bytes)) => {
            format!("choose a grid of {:.2} mm ({bytes} bytes), or {cut}", 1e3 * cell_m)
        }
        None => cut.into(),
    }
}

/// Where a wall came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WallSource {
    /// A mesh: triangles in the file, triangles after openings were extended and the surface was
    /// refined, and the rounds of refinement.
    Mesh { read: usize, triangles: usize, rounds: usize },
    /// `centreline.csv`.
    Centreline { branches: usize },
}

/// Why there is no lumen.
#[derive(Debug, Error)]
pub enum LumenBuildError {
    #[error(
        "`{0}` is a drive without a vessel\n  fix: use a bundle of a catheter; a drive's is only for \
         diagnosis"
    )]
    NoCatheter(String),
    #[error(transparent)]
    Bundle(#[from] BundleError),
    #[error(
        "a grid of {:.2} mm around a vessel of {:.0} × {:.0} × {:.0} mm has too many bricks\n  \
         fix: {}", 1e3 * .cell_m, size_mm[0], size_mm[1], size_mm[2], coarser(.fitting)
    )]
    TooManyBricks { cell_m: f64, size_mm: [f64; 3], fitting: Option<(f64, usize)> },
    #[error(
        "the vessel reaches to ({:.1}, {:.1}, {:.1}) mm; a device takes one that lies within \
         {:.0} mm of the origin of its frame\n  fix: move the vessel to the origin, and in a bundle \
         all that is given in its frame with it", at_mm[0], at_mm[1], at_mm[2], 1e3 * FARTHEST_ORIGIN_M
    )]
    TooFarOff { at_mm: [f64; 3] },
}

impl LumenBuildError {
    /// Whether the vessel may be good, but the device has no room for it.
    pub fn is_about_room(&self) -> bool {
        matches!(self, LumenBuildError::TooManyBricks { .. })
    }
}

/// Largest distance along an axis from the origin of its frame at which the device accepts the
/// start of a grid \[m\]: `cathforce_mechanics::LumenHeader`.
const FARTHEST_ORIGIN_M: f64 = 10.0;

/// A wall of either kind.
pub struct Vessel {
    wall: Box<dyn Wall>,
    source: WallSource,
    openings: Vec<Opening>,
    gaps: usize,
    off_facets: Option<(f64, Vector3<f64>)>,
}

impl Vessel {
    /// The wall of a bundle's vessel: from the mesh when there is one, else from the
    /// centreline. Checks that the instrument can enter.
    pub fn from_bundle(bundle: &Bundle, model: SurfaceModel) -> Result<Self, LumenBuildError> {
        let rig = catheter(bundle)?;
        let (vessel, file) = match &bundle.mesh {
            Some(mesh) => (Self::from_mesh(&mesh.mesh, model), "vessel.stl"),
            None => {
                let source = WallSource::Centreline { branches: bundle.centreline.len() };
                let wall = Box::new(TubeWall::new(&bundle.centreline));
                let (openings, gaps, off_facets) = (Vec::new(), 0, None);
                (Self { wall, source, openings, gaps, off_facets }, "centreline.csv")
            }
        };
        let openings = bundle.mesh.is_some().then_some(&vessel.openings[..]);
        let refused = |file: &str, cause| {
            Err(BundleError::new(&bundle.path.join(file), Place::Whole, cause).into())
        };
        if let Some(cause) = no_entry(vessel.wall(), openings, rig) {
            return refused(if cause.is_of_rig() { "rig.toml" } else { file }, cause);
        }
        match vessel.region_without_wall(&rig.vessel.wall_regions) {
            Some(cause) => refused("rig.toml", cause),
            None => Ok(vessel.with_regions(&rig.vessel.wall_regions)),
        }
    }

    fn region_without_wall(&self, regions: &[WallRegion]) -> Option<VesselCause> {
        regions.iter().enumerate().find_map(|(index, region)| {
            let distance_m = self.wall.sample(&region.centre_m.into()).distance_m.abs();
            (distance_m > region.radius_m).then_some(VesselCause::RegionWithoutWall {
                index,
                distance_mm: distance_m * 1e3,
                radius_mm: region.radius_m * 1e3,
            })
        })
    }

    fn with_regions(mut self, regions: &[WallRegion]) -> Self {
        if !regions.is_empty() {
            self.wall = Box::new(RegionalWall { wall: self.wall, regions: regions.to_vec() });
        }
        self
    }

    /// The wall of a mesh without a bundle; the enclosed volume tells its inner side.
    pub fn from_mesh(mesh: &Mesh, model: SurfaceModel) -> Self {
        let mut wall = MeshWall::new(mesh.clone(), model);
        let (triangles, rounds) = (wall.triangles(), wall.rounds);
        let source = WallSource::Mesh { read: mesh.len(), triangles, rounds };
        let (openings, gaps) = (std::mem::take(&mut wall.openings), wall.gaps);
        let off_facets = wall.off_facets;
        Self { wall: Box::new(wall), source, openings, gaps, off_facets }
    }

    /// The wall itself.
    pub fn wall(&self) -> &dyn Wall {
        &*self.wall
    }

    /// Samples the wall on a grid and reports size and errors.
    pub fn lumen(
        &self,
        options: LumenOptions,
    ) -> Result<(BuiltLumen, LumenReport), LumenBuildError> {
        let (low, high) = self.wall.bounds_m();
        let margin_m = options.outside_m + 2.0 * options.cell_m;
        // The device checks where a grid begins, not where it ends.
        let is_too_far = |x: f64| (x - margin_m).abs() > FARTHEST_ORIGIN_M;
        if low.iter().any(|&x| is_too_far(x)) {
            return Err(LumenBuildError::TooFarOff { at_mm: (low * 1e3).into() });
        }
        let built = build_lumen(self.wall(), options).ok_or_else(|| {
            let size_mm = ((high - low) * 1e3).into();
            let fitting = self.fitting(options, usize::MAX);
            LumenBuildError::TooManyBricks { cell_m: options.cell_m, size_mm, fitting }
        })?;
        let (bytes, cell_m) = (built.bytes.len(), options.cell_m);
        let too_large = (bytes > DEVICE_LUMEN_BYTES).then(|| LumenTooLarge {
            bytes,
            cell_m,
            fitting: self.fitting(options, bytes),
        });
        let quality = measure(&built, self.wall(), &options, QUALITY_POINTS);
        let report = LumenReport {
            source: self.source,
            bytes,
            bricks: usize::from(built.header.stored),
            fine: built.fine,
            cell_m: options.cell_m,
            outer_radius_m: options.outer_radius_m,
            openings: self.openings.clone(),
            gaps: self.gaps,
            off_facets: self.off_facets,
            widest_m: widest_m(self.wall()),
            span_m: (high - low).norm(),
            quality,
            facets_m: None,
            surface_to_facets_m: None,
            too_large,
        };
        Ok((built, report))
    }

    /// The finest coarser grid that fits the device, with its bytes. `bytes`: on the grid of
    /// `options`.
    fn fitting(&self, options: LumenOptions, bytes: usize) -> Option<(f64, usize)> {
        // Bricks lie along a surface, so their number falls with the square of the spacing; only
        // the directory falls with the cube. The cube is optimistic: no grid that fits is skipped.
        let hopeful = |cell_m: f64| {
            bytes == usize::MAX
                || bytes as f64 * (options.cell_m / cell_m).powi(3) < DEVICE_LUMEN_BYTES as f64
        };
        let coarser = COARSER_M.into_iter().filter(|&cell_m| cell_m > options.cell_m);
        coarser
            .filter(|&cell_m| hopeful(cell_m))
            .map(|cell_m| (cell_m, LumenOptions { cell_m, ..options }))
            .filter(|(_, options)| may_fit(self.wall(), options))
            .filter_map(|(cell_m, options)| Some((cell_m, build_lumen(self.wall(), options)?)))
            .map(|(cell_m, lumen)| (cell_m, lumen.bytes.len()))
            .find(|&(_, bytes)| bytes <= DEVICE_LUMEN_BYTES)
    }
}

fn catheter(bundle: &Bundle) -> Result<&CatheterRig, LumenBuildError> {
    bundle.catheter().ok_or_else(|| LumenBuildError::NoCatheter(bundle.rig.name.clone()))
}

/// Header and bytes of the lumen of a bundle's vessel, for `cathforce_mechanics::Lumen::new`.
///
/// `cell_m`: grid spacing, usually [`CELL_M`].
pub fn lumen_from_bundle(
    bundle: &Bundle,
    cell_m: f64,
) -> Result<(LumenHeader, Vec<u8>, LumenReport), LumenBuildError> {
    let outer_radius_m = 0.5 * catheter(bundle)?.instrument.outer_diameter_m;
    let vessel = Vessel::from_bundle(bundle, SurfaceModel::default())?;
    let (built, report) = vessel.lumen(LumenOptions::for_instrument(outer_radius_m, cell_m))?;
    Ok((built.header, built.bytes, report))
}
