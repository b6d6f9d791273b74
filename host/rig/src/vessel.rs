//! A bundle's vessel as a wall, and as the lumen that the device reads.

use std::fmt;

use cathforce_mechanics::LumenHeader;
use nalgebra::Vector3;
use thiserror::Error;

use crate::bundle::{Bundle, CatheterRig};
use crate::error::{BundleError, Place};
use crate::geometry::{MeshWall, SurfaceModel, TubeWall, Wall};
use crate::lumen::{BuiltLumen, LumenOptions, LumenQuality, Spread, build_lumen, measure};

/// Grid spacing unless another is asked for \[m\].
pub const CELL_M: f64 = 1e-3;
/// Bytes of lumen that the device has room for.
pub const DEVICE_LUMEN_BYTES: usize = 2 << 20;
/// Points at which a lumen is compared with the exact wall.
const QUALITY_POINTS: usize = 20_000;

/// What a lumen became.
#[derive(Clone, Debug, PartialEq)]
pub struct LumenReport {
    /// Where the wall came from.
    pub source: WallSource,
    /// Of directory and bricks.
    pub bytes: usize,
    /// Bricks stored.
    pub bricks: usize,
    /// Grid spacing \[m\].
    pub cell_m: f64,
    pub quality: LumenQuality,
}

/// Where a wall came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WallSource {
    /// `vessel.stl`, with so many triangles after this many rounds of refinement.
    Mesh { triangles: usize, rounds: usize },
    /// `centreline.csv`.
    Centreline { branches: usize },
}

impl fmt::Display for LumenReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.source {
            WallSource::Mesh { triangles, rounds } => {
                writeln!(f, "wall      vessel.stl, {triangles} triangles after {rounds} rounds")?;
            }
            WallSource::Centreline { branches } => {
                writeln!(f, "wall      centreline.csv, {branches} branches")?;
            }
        }
        let percent = 100.0 * self.bytes as f64 / DEVICE_LUMEN_BYTES as f64;
        let (cell_mm, bricks) = (1e3 * self.cell_m, self.bricks);
        writeln!(f, "grid      {cell_mm:.2} mm, {bricks} bricks")?;
        writeln!(f, "size      {} bytes, {percent:.0} % of the device's room", self.bytes)?;
        let micrometres = |f: &mut fmt::Formatter<'_>, name, spread: &Spread| {
            let [p50, p99, max] = [spread.p50, spread.p99, spread.max].map(|x| 1e6 * x);
            writeln!(f, "{name} {p50:.2} / {p99:.2} / {max:.1} µm (median / 99 % / largest)")
        };
        let quality = &self.quality;
        micrometres(f, "distance ", &quality.distance_m)?;
        micrometres(f, "trilinear", &quality.trilinear_m)?;
        let Spread { p50, p99, max } = quality.normal_rad;
        let [p50, p99, max] = [p50, p99, max].map(f64::to_degrees);
        writeln!(f, "normal    {p50:.2} / {p99:.2} / {max:.1}°")?;
        let [x, y, z] = quality.worst_at_m.map(|x| 1e3 * x);
        write!(f, "          {} points; worst at ({x:.2}, {y:.2}, {z:.2}) mm", quality.points)
    }
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
        "a grid of {cell_mm} mm around a vessel of {:.0} × {:.0} × {:.0} mm has too many bricks\n  \
         fix: choose a coarser one, or cut the vessel to the part that the instrument reaches",
        size_mm[0], size_mm[1], size_mm[2]
    )]
    TooManyBricks { cell_mm: f64, size_mm: [f64; 3] },
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
}

impl VesselCause {
    pub(crate) fn fix(&self) -> String {
        match self {
            VesselCause::EntryFarFromWall { .. } | VesselCause::EntryTooNarrow { .. } => {
                "vessel and [entry] position_m do not belong together: STL is in millimetres, \
                 everything else in metres, all in the vessel's frame"
                    .into()
            }
            VesselCause::NoOpeningAtEntry { .. } => {
                "cut the vessel open where the instrument enters, or correct [entry] position_m"
                    .into()
            }
        }
    }
}

/// No vessel has its wall farther from the entry than this \[m\].
const FARTHEST_WALL_M: f64 = 0.06;
/// The entry plane and the rim of its opening are no farther apart than this \[m\].
const FARTHEST_RIM_M: f64 = 0.01;

/// A wall of either kind.
pub struct Vessel {
    wall: Box<dyn Wall>,
    source: WallSource,
}

impl Vessel {
    /// The wall of a bundle's vessel: from the mesh when there is one, else from the
    /// centreline. Checks that the instrument can enter.
    pub fn from_bundle(bundle: &Bundle, model: SurfaceModel) -> Result<Self, LumenBuildError> {
        let rig = catheter(bundle)?;
        let position = Vector3::from(rig.entry.position_m);
        // Just past the entry plane, where the mesh is sure to be beside and not behind.
        let inside = position + Vector3::from(rig.entry.direction) * 1e-3;
        let (wall, source, file, rim_m): (Box<dyn Wall>, _, _, _) = match &bundle.mesh {
            Some(mesh) => {
                let wall = MeshWall::new(mesh.mesh.clone(), model, &inside);
                let source = WallSource::Mesh { triangles: wall.triangles(), rounds: wall.rounds };
                let rim_m = wall.rim_distance_m(&position);
                (Box::new(wall), source, "vessel.stl", rim_m)
            }
            None => {
                let source = WallSource::Centreline { branches: bundle.centreline.len() };
                (Box::new(TubeWall::new(&bundle.centreline)), source, "centreline.csv", 0.0)
            }
        };
        let nearest = wall.sample(&inside);
        let distance_m = nearest.distance_m.hypot(nearest.beyond_m);
        let radius_m = 0.5 * rig.instrument.outer_diameter_m;
        let cause = if distance_m > FARTHEST_WALL_M {
            let entry_mm = (position * 1e3).into();
            VesselCause::EntryFarFromWall { entry_mm, distance_mm: distance_m * 1e3 }
        } else if rim_m > (4.0 * nearest.distance_m).max(FARTHEST_RIM_M) {
            VesselCause::NoOpeningAtEntry { rim_mm: rim_m * 1e3 }
        } else if nearest.distance_m < radius_m {
            let distance_mm = nearest.distance_m * 1e3;
            VesselCause::EntryTooNarrow { distance_mm, radius_mm: radius_m * 1e3 }
        } else {
            return Ok(Self { wall, source });
        };
        Err(BundleError::new(&bundle.path.join(file), Place::Whole, cause).into())
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
            LumenBuildError::TooManyBricks { cell_mm: options.cell_m * 1e3, size_mm }
        })?;
        let report = LumenReport {
            source: self.source,
            bytes: built.bytes.len(),
            bricks: usize::from(built.header.stored),
            cell_m: options.cell_m,
            quality: measure(&built, self.wall(), &options, QUALITY_POINTS),
        };
        Ok((built, report))
    }

    /// Bytes of the lumen on another grid; `None` when it has too many bricks.
    pub(crate) fn lumen_bytes(&self, options: LumenOptions) -> Option<usize> {
        build_lumen(self.wall(), options).map(|lumen| lumen.bytes.len())
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
