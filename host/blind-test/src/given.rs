//! Rigs, motions and noise of somebody else's trial bundles. Where another simulator made one, a
//! reality without any effect shows what two realities of one rig differ by, and realities with
//! effects are what a stranger's data are like.
//!
//! Bundles are read here and not by `cathforce-bundle`, which rests on the device's model.

use std::fs;
use std::path::{Path, PathBuf};

use cathforce_reference_solver::{Drive, Schedule, Station};
use nalgebra::Vector3;
use serde::Deserialize;
use thiserror::Error;

use crate::rigs::{CONTACT_SPACING_M, Instrument, Rig};
use crate::stand::{Accuracy, Stand};

/// Why no cases can be played on a bundle's rig.
#[derive(Debug, Error)]
pub enum GivenError {
    #[error("{}: {error}", path.display())]
    File { path: PathBuf, error: std::io::Error },
    #[error("{}: {error}", path.display())]
    Rig { path: PathBuf, error: Box<toml::de::Error> },
    #[error("{}: {error}", path.display())]
    Table { path: PathBuf, error: csv::Error },
    #[error("{}: {what}\n  fix: {fix}", path.display())]
    Unfit { path: PathBuf, what: &'static str, fix: &'static str },
}

#[derive(Deserialize)]
struct RigFile {
    instrument: InstrumentTable,
    entry: EntryTable,
    vessel: VesselTable,
    sensor: SensorTable,
    tendon: Option<toml::Value>,
    tendons: Option<toml::Value>,
}

#[derive(Deserialize)]
struct InstrumentTable {
    outer_diameter_m: f64,
    inner_diameter_m: f64,
    density_kg_per_m3: f64,
    poissons_ratio: f64,
    sections: Vec<SectionTable>,
    #[serde(default)]
    tip_precurve: Vec<CurveTable>,
}

#[derive(Deserialize)]
struct SectionTable {
    length_m: f64,
    #[serde(rename = "youngs_modulus_Pa")]
    youngs_modulus_pa: f64,
}

#[derive(Deserialize)]
struct CurveTable {
    length_m: f64,
    curvature_per_m: f64,
}

#[derive(Deserialize)]
struct EntryTable {
    position_m: [f64; 3],
    direction: [f64; 3],
    up: [f64; 3],
}

#[derive(Deserialize)]
struct VesselTable {
    friction_coefficient: f64,
    #[serde(rename = "wall_stiffness_N_per_m")]
    wall_stiffness_n_per_m: f64,
    wall_contact_spacing_m: f64,
    #[serde(default)]
    wall_regions: Vec<toml::Value>,
}

#[derive(Deserialize)]
struct SensorTable {
    #[serde(rename = "force_noise_sd_N")]
    force_noise_sd_n: f64,
    tip_noise_sd_m: Option<f64>,
    #[serde(rename = "drive_noise_sd_N")]
    drive_noise_sd_n: Option<f64>,
    shape_noise_sd_m: Option<f64>,
}

#[derive(Deserialize)]
struct CentreRow {
    branch: String,
    x_m: f64,
    y_m: f64,
    z_m: f64,
    radius_m: f64,
}

#[derive(Deserialize)]
struct DriveRow {
    t_s: f64,
    insertion_m: f64,
    rotation_rad: f64,
}

/// Where branches meet, edges are rounded over this share of the vessel's smallest radius: by the
/// distance of the corners of the practice bundles' meshes from the union of the branches.
const BLEND: f64 = 0.45;
/// The withheld trial goes like the first, turned by this \[rad\].
const WITHHELD_TURN_RAD: f64 = 0.2;
/// Noise that rig.toml does not state: drive force over force, tip, shape \[m\]; that of the
/// practice bundles.
const DRIVE_OVER_FORCE: f64 = 2.0;
const TIP_NOISE_M: f64 = 3e-4;
const SHAPE_NOISE_M: f64 = 5e-4;
/// Rows between two of the tip: 31 a second.
const TIP_EVERY: usize = 8;

impl Stand {
    /// The rig, the motions and the noise of a bundle whose vessel has a centre line; the vessel is
    /// the union of its branches. The motion of its first trial, turned a little, comes once more
    /// at the end, as the one that is withheld.
    pub fn of_bundle(bundle: &Path) -> Result<Self, GivenError> {
        let path = bundle.join("rig.toml");
        let text = fs::read_to_string(&path)
            .map_err(|error| GivenError::File { path: path.clone(), error })?;
        if is_drive(&text) {
            return Err(GivenError::Unfit {
                path,
                what: "a drive on its own has no instrument, and realities are of catheters",
                fix: "name the bundle of a catheter",
            });
        }
        let file: RigFile = toml::from_str(&text)
            .map_err(|error| GivenError::Rig { path: path.clone(), error: Box::new(error) })?;
        let mut motions = motions(bundle)?;
        let first = motions.first().ok_or_else(|| GivenError::Unfit {
            path: bundle.join("trials"),
            what: "there is no trial, so that nobody knows what the drive does",
            fix: "name a bundle with trials",
        })?;
        motions.push(first.turned(WITHHELD_TURN_RAD));
        let accuracy = Accuracy {
            force_n: file.sensor.force_noise_sd_n,
            drive_n: (file.sensor.drive_noise_sd_n)
                .unwrap_or(DRIVE_OVER_FORCE * file.sensor.force_noise_sd_n),
            tip_m: file.sensor.tip_noise_sd_m.unwrap_or(TIP_NOISE_M),
            shape_m: Some(file.sensor.shape_noise_sd_m.unwrap_or(SHAPE_NOISE_M)),
            tip_every: TIP_EVERY,
        };
        Ok(Self { rig: rig(bundle, &file)?, motions, accuracy, given: Some(bundle.to_owned()) })
    }
}

/// Whether a rig is a drive on its own, which has none of the tables of [`RigFile`].
fn is_drive(rig: &str) -> bool {
    #[derive(Deserialize)]
    struct Kind {
        plant: String,
    }
    toml::from_str(rig).is_ok_and(|kind: Kind| kind.plant == "drive")
}

fn rig(bundle: &Path, file: &RigFile) -> Result<Rig, GivenError> {
    let unfit = |what, fix| GivenError::Unfit { path: bundle.join("rig.toml"), what, fix };
    if file.entry.position_m != [0.0; 3] || file.entry.direction != [1.0, 0.0, 0.0] {
        return Err(unfit(
            "the entry is not at the origin along x, where realities have it",
            "state the rig in the frame of its entry",
        ));
    }
    if file.tendon.is_some() || file.tendons.is_some() {
        return Err(unfit(
            "it is steered by a tendon, which the instrument of a reality has not",
            "take [tendon] and [[tendons]] out",
        ));
    }
    if !file.vessel.wall_regions.is_empty() {
        return Err(unfit(
            "its wall has regions of another stiffness, which the wall of a reality has not",
            "take wall_regions out of [vessel]",
        ));
    }
    let branches = branches(bundle)?;
    let radii = branches.iter().flatten().map(|station| station.radius_m);
    let blend_m = BLEND * radii.fold(f64::INFINITY, f64::min);
    let i = &file.instrument;
    let piece = |s: &SectionTable| (s.length_m, s.youngs_modulus_pa);
    let sections = match &i.sections[..] {
        // Its pre-curved end is what a label calls its tip.
        [only] => {
            let curved_m = i.tip_precurve.iter().map(|piece| piece.length_m).sum::<f64>();
            [(only.length_m - curved_m), curved_m].map(|length| (length, only.youngs_modulus_pa))
        }
        [base, tip] => [piece(base), piece(tip)],
        _ => {
            return Err(unfit(
                "a reality's instrument has one section or two",
                "name a bundle whose instrument has",
            ));
        }
    };
    let spacing = CONTACT_SPACING_M / file.vessel.wall_contact_spacing_m;
    Ok(Rig {
        name: bundle.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        instrument: Instrument {
            name: "instrument",
            outer_diameter_m: i.outer_diameter_m,
            inner_diameter_m: i.inner_diameter_m,
            density_kg_per_m3: i.density_kg_per_m3,
            poissons_ratio: i.poissons_ratio,
            sections,
            precurve: i.tip_precurve.iter().map(|c| (c.length_m, c.curvature_per_m)).collect(),
            wall_stiffness_n_per_m: file.vessel.wall_stiffness_n_per_m * spacing,
        },
        branches,
        blend_m,
        up: Vector3::from(file.entry.up),
        friction_coefficient: file.vessel.friction_coefficient,
        start_m: 0.0,
    })
}

/// Centre line and radius of each branch, in the order of the file.
fn branches(bundle: &Path) -> Result<Vec<Vec<Station>>, GivenError> {
    let path = bundle.join("centreline.csv");
    let mut branches: Vec<(String, Vec<Station>)> = Vec::new();
    for row in rows::<CentreRow>(&path)? {
        let position_m = Vector3::new(row.x_m, row.y_m, row.z_m);
        let station = Station { position_m, radius_m: row.radius_m };
        match branches.last_mut().filter(|(name, _)| *name == row.branch) {
            Some((_, stations)) => stations.push(station),
            None => branches.push((row.branch, vec![station])),
        }
    }
    Ok(branches.into_iter().map(|(_, stations)| stations).collect())
}

fn motions(bundle: &Path) -> Result<Vec<Schedule>, GivenError> {
    let folder = bundle.join("trials");
    let file = |error| GivenError::File { path: folder.clone(), error };
    let entries = fs::read_dir(&folder).map_err(file)?;
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<Result<_, _>>()
        .map_err(file)?;
    files.sort();
    let motion = |path: &PathBuf| {
        let drive = |row: DriveRow| {
            let drive = Drive { insertion_m: row.insertion_m, rotation_rad: row.rotation_rad };
            (row.t_s, drive)
        };
        Schedule::samples(rows(path)?.into_iter().map(drive).collect()).ok_or_else(|| {
            GivenError::Unfit {
                path: path.clone(),
                what: "its time does not grow from row to row",
                fix: "`cathforce gap diagnose` on the bundle says where",
            }
        })
    };
    files.iter().map(motion).collect()
}

fn rows<T: for<'a> Deserialize<'a>>(path: &Path) -> Result<Vec<T>, GivenError> {
    let read = || csv::Reader::from_path(path)?.into_deserialize().collect::<Result<_, _>>();
    read().map_err(|error| GivenError::Table { path: path.to_owned(), error })
}
