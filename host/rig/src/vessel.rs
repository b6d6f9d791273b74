//! A bundle's vessel as a wall, and as the lumen that the device reads.

use cathforce_mechanics::LumenHeader;
use nalgebra::Vector3;
use thiserror::Error;

use crate::bundle::{Bundle, CatheterRig, WallRegion};
use crate::error::{BundleError, Place};
use crate::geometry::{GAP_M, Mesh, MeshWall, Opening, RegionalWall, SurfaceModel, TubeWall, Wall};
use crate::lumen::{
    BuiltLumen, DEVICE_LUMEN_BYTES, LumenOptions, LumenQuality, Spread, build_lumen, measure,
};

/// Grid spacing unless another is asked for \[m\].
pub const CELL_M: f64 = 1e-3;
/// Points at which a lumen is compared with the exact wall.
pub(crate) const QUALITY_POINTS: usize = 20_000;

/// Grid spacings that are tried to say which would fit \[m\].
const COARSER_M: [f64; 9] =
    [0.3e-3, 0.4e-3, 0.5e-3, 0.6e-3, 0.8e-3, 1.0e-3, 1.25e-3, 1.5e-3, 2.0e-3];

/// What a lumen became.
#[derive(Clone, Debug, PartialEq)]
pub struct LumenReport {
    /// Where the wall came from.
    pub source: WallSource,
    /// Of directory and bricks.
    pub bytes: usize,
    /// Bricks stored.
    pub bricks: usize,
    /// In the place of how many there are eight of half the spacing, and how many there was no
    /// room for.
    pub fine: [usize; 2],
    /// Grid spacing \[m\].
    pub cell_m: f64,
    /// Where the surface of a mesh ends; empty for a centreline.
    pub openings: Vec<Opening>,
    /// Gaps in a mesh that were closed.
    pub gaps: usize,
    /// Against the surface that is stored.
    pub quality: LumenQuality,
    /// Against the flat facets of the mesh \[m\], when that was asked for.
    pub facets_m: Option<Spread>,
    /// From the surface to the flat facets of its mesh \[m\], when that was asked for.
    pub surface_to_facets_m: Option<Spread>,
    /// When the device has no room for it.
    pub too_large: Option<LumenTooLarge>,
}

impl LumenReport {
    /// What is wrong with the openings of a mesh, for an instrument of this radius \[m\].
    pub fn doubtful_openings(&self, outer_radius_m: f64) -> Option<String> {
        if !matches!(self.source, WallSource::Mesh { .. }) {
            return None;
        }
        let diameter_mm = 2e3 * outer_radius_m;
        let narrow = self.openings.iter().filter(|o| o.radius_m < outer_radius_m).count();
        match (narrow, self.openings.len()) {
            (_, 0) => Some(format!(
                "the surface has no opening of more than {:.1} mm: an instrument cannot enter it",
                2e3 * GAP_M
            )),
            (0, _) => None,
            (narrow, all) if narrow == all => {
                Some(format!("no opening is as wide as the instrument of {diameter_mm:.2} mm"))
            }
            (narrow, all) => Some(format!(
                "{narrow} of {all} openings are narrower than the instrument of \
                 {diameter_mm:.2} mm: holes in the surface?"
            )),
        }
    }
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
    /// A mesh of so many triangles in the file; openings extended and refined in so many
    /// rounds it has `triangles`.
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
}

/// Why a vessel and an entry do not belong together.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum VesselCause {
    #[error(
        "the entry ({:.1}, {:.1}, {:.1}) mm is {distance_mm:.1} mm from the wall, farther than any \
         vessel is wide", entry_mm[0], entry_mm[1], entry_mm[2]
    )]
    EntryFarFromWall { entry_mm: [f64; 3], distance_mm: f64 },
    #[error(
        "the surface has no opening near the entry: the nearest rim is {rim_mm:.1} mm away, so a \
         wall closes the vessel in front of the instrument"
    )]
    NoOpeningAtEntry { rim_mm: f64 },
    #[error(
        "the wall is {distance_mm:.2} mm from the axis of the entry, the instrument's radius is \
         {radius_mm:.2} mm: it cannot enter"
    )]
    EntryTooNarrow { distance_mm: f64, radius_mm: f64 },
    #[error(
        "[vessel] wall_regions[{index}] holds no wall: the nearest is {distance_mm:.1} mm from its \
         centre, its radius is {radius_mm:.1} mm"
    )]
    RegionWithoutWall { index: usize, distance_mm: f64, radius_mm: f64 },
    #[error("the vessel lies behind the entry plane: `direction` of [entry] leads out of it")]
    EntryLeadsOut,
}

impl VesselCause {
    pub(crate) fn fix(&self) -> String {
        match self {
            VesselCause::EntryFarFromWall { .. } | VesselCause::EntryTooNarrow { .. } => {
                "vessel and [entry] position_m do not belong together: STL is in millimetres, \
                 everything else in metres, all in the vessel's frame"
                    .into()
            }
            VesselCause::RegionWithoutWall { .. } => {
                "move centre_m to the wall, widen radius_m, or take the region out; both are in \
                 metres, in the vessel's frame"
                    .into()
            }
            VesselCause::NoOpeningAtEntry { .. } => {
                "cut the vessel open where the instrument enters, or correct [entry] position_m"
                    .into()
            }
            VesselCause::EntryLeadsOut => {
                "turn the signs of [entry] direction, or correct position_m: the instrument goes \
                 along direction, in the vessel's frame"
                    .into()
            }
        }
    }
}

/// No vessel has its wall farther from the entry than this \[m\].
const FARTHEST_WALL_M: f64 = 0.06;
/// The entry plane and the rim of its opening are no farther apart than this \[m\].
const FARTHEST_RIM_M: f64 = 0.01;

/// So far ahead of the entry plane and behind it is looked where the vessel is \[m\].
const FACING_M: f64 = 5e-3;

/// A wall of either kind.
pub struct Vessel {
    wall: Box<dyn Wall>,
    source: WallSource,
    openings: Vec<Opening>,
    gaps: usize,
}

impl Vessel {
    /// The wall of a bundle's vessel: from the mesh when there is one, else from the
    /// centreline. Checks that the instrument can enter.
    pub fn from_bundle(bundle: &Bundle, model: SurfaceModel) -> Result<Self, LumenBuildError> {
        let rig = catheter(bundle)?;
        let position = Vector3::from(rig.entry.position_m);
        // Just past the entry plane, where the mesh is sure to be beside and not behind.
        let direction = Vector3::from(rig.entry.direction);
        let inside = position + direction * 1e-3;
        let (vessel, file, rim_m) = match &bundle.mesh {
            Some(mesh) => {
                let wall = MeshWall::new(mesh.mesh.clone(), model, Some(&inside));
                let rim_m = wall.rim_distance_m(&position);
                (Self::from_wall(wall, mesh.mesh.len()), "vessel.stl", rim_m)
            }
            None => {
                let source = WallSource::Centreline { branches: bundle.centreline.len() };
                let wall = Box::new(TubeWall::new(&bundle.centreline));
                (Self { wall, source, openings: Vec::new(), gaps: 0 }, "centreline.csv", 0.0)
            }
        };
        let nearest = vessel.wall.sample(&inside);
        let distance_m = nearest.distance_m.hypot(nearest.beyond_m);
        let beyond_m =
            |ahead_m: f64| vessel.wall.sample(&(position + direction * ahead_m)).beyond_m;
        let radius_m = 0.5 * rig.instrument.outer_diameter_m;
        let refused = |file: &str, cause| {
            Err(BundleError::new(&bundle.path.join(file), Place::Whole, cause).into())
        };
        let cause = if distance_m > FARTHEST_WALL_M {
            let entry_mm = (position * 1e3).into();
            VesselCause::EntryFarFromWall { entry_mm, distance_mm: distance_m * 1e3 }
        } else if rim_m > (4.0 * nearest.distance_m).max(FARTHEST_RIM_M) {
            VesselCause::NoOpeningAtEntry { rim_mm: rim_m * 1e3 }
        } else if beyond_m(FACING_M) > beyond_m(-FACING_M) + 0.5 * FACING_M {
            VesselCause::EntryLeadsOut
        } else if nearest.distance_m < radius_m {
            let distance_mm = nearest.distance_m * 1e3;
            VesselCause::EntryTooNarrow { distance_mm, radius_mm: radius_m * 1e3 }
        } else if let Some(cause) = vessel.region_without_wall(&rig.vessel.wall_regions) {
            return refused("rig.toml", cause);
        } else {
            return Ok(vessel.with_regions(&rig.vessel.wall_regions));
        };
        refused(file, cause)
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

    /// The wall of a mesh on its own; the volume that it encloses tells its inner side.
    pub fn from_mesh(mesh: &Mesh, model: SurfaceModel) -> Self {
        Self::from_wall(MeshWall::new(mesh.clone(), model, None), mesh.len())
    }

    fn from_wall(mut wall: MeshWall, read: usize) -> Self {
        let source = WallSource::Mesh { read, triangles: wall.triangles(), rounds: wall.rounds };
        let (openings, gaps) = (std::mem::take(&mut wall.openings), wall.gaps);
        Self { wall: Box::new(wall), source, openings, gaps }
    }

    /// The wall itself.
    pub fn wall(&self) -> &dyn Wall {
        &*self.wall
    }

    /// Samples the wall on a grid and says what that cost.
    pub fn lumen(
        &self,
        options: LumenOptions,
    ) -> Result<(BuiltLumen, LumenReport), LumenBuildError> {
        let built = build_lumen(self.wall(), options).ok_or_else(|| {
            let (low, high) = self.wall.bounds_m();
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
        let report = LumenReport {
            source: self.source,
            bytes,
            bricks: usize::from(built.header.stored),
            fine: built.fine,
            cell_m: options.cell_m,
            openings: self.openings.clone(),
            gaps: self.gaps,
            quality: measure(&built, self.wall(), &options, QUALITY_POINTS),
            facets_m: None,
            surface_to_facets_m: None,
            too_large,
        };
        Ok((built, report))
    }

    /// The finest coarser grid that fits the device, with its bytes. `bytes`: on the grid of
    /// `options`.
    fn fitting(&self, options: LumenOptions, bytes: usize) -> Option<(f64, usize)> {
        // Bricks lie along a surface: their number falls by the square. The directory, which
        // falls faster, is what makes this too high a guess.
        let hopeful = |cell_m: f64| {
            bytes == usize::MAX
                || bytes as f64 * (options.cell_m / cell_m).powi(3) < DEVICE_LUMEN_BYTES as f64
        };
        let coarser = COARSER_M.into_iter().filter(|&cell_m| cell_m > options.cell_m);
        coarser
            .filter(|&cell_m| hopeful(cell_m))
            .map(|cell_m| (cell_m, LumenOptions { cell_m, ..options }))
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
