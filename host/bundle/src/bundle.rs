//! Trial bundles: a rig, its vessel and what was measured on it.
//!
//! | file | what it holds |
//! | --- | --- |
//! | `rig.toml` | what was set up, and the nominal parameters: [`Rig`] |
//! | `vessel.stl` | lumen surface, closed but for its openings, in millimetres |
//! | `centreline.csv` | `branch,s_m,x_m,y_m,z_m,radius_m`; one of the two vessels must be there, the mesh goes first |
//! | `trials/NNN.csv` | one trial a file, a row a sample, missing values empty: [`Trial`] |
//!
//! Columns of a catheter's trial: `t_s`, `insertion_m`, `rotation_rad`; optionally `fx_N`,
//! `fy_N`, `fz_N`, `drive_fx_N`, `tip_x_m`, `tip_y_m`, `tip_z_m` and `p00_x_m`, `p00_y_m`,
//! `p00_z_m`, `p01_x_m` … from the tip; with a guidewire `guidewire_insertion_m` and
//! `guidewire_rotation_rad`, optionally `guidewire_drive_fx_N`; with tendons that drives pull
//! `tendon_1_m` and so on. Of a drive's: `t_s`, `position_m`, `drive_command_N`; optionally
//! `setpoint_m` and `load_N`; of a rotary one with `rad` and `Nm`; `motor_current_A` or
//! `motor_voltage_V` may stand for the command. Of a transmission's: `t_s`, `input_m` or `input_rad`, `output_m`
//! or `output_rad`; optionally `load_N` or `load_Nm`, and `bend_rad`. Units are SI unless a name ends in another; positions, directions
//! and forces are given in the right-handed frame of the vessel.

use std::path::{Path, PathBuf};

pub use crate::axis::{Axis, CommandKind};
pub use crate::driven::Driven;
pub use crate::rig::{
    BeyondModel, CatheterRig, DriveRig, FORMAT, Fluid, Plant, Rig, RigBoucWen, RigCarried,
    RigCause, RigDrivenTendon, RigEntry, RigEnvironment, RigInstrument, RigMotor, RigPendulum,
    RigPrandtlIshlinskii, RigPriors, RigSection, RigSensor, RigSheath, RigTendon, RigVessel,
    TipPiece, TransmissionRig, WallRegion,
};
pub use crate::trial::{
    CatheterTrial, ColumnMap, DriveTrial, EncoderReading, Foreign, ForeignCause, GuidewireTrial,
    Holes, LONGEST_GAP_S, LeftOut, Rush, TransmissionTrial, Trial, TrialCause, TrialData,
    VectorColumn, columns, read_foreign,
};

use crate::error::{BundleError, Cause, read_bytes, read_text};
use crate::geometry::{
    Branch, Crossing, Mesh, MeshRepairs, NonManifold, read_centreline, read_stl,
};
use crate::place::{Place, Warning};
use crate::rig::RigWarning;
use crate::trial::{self, Parsed};
use crate::unit::unit_hint;

/// The surface of `vessel.stl`.
#[derive(Clone, Debug)]
pub struct VesselMesh {
    pub mesh: Mesh,
    pub repairs: MeshRepairs,
}

/// A bundle, read whole and found well formed.
#[derive(Clone, Debug)]
pub struct Bundle {
    /// The folder.
    pub path: PathBuf,
    pub rig: Rig,
    /// `vessel.stl`, when there is one.
    pub mesh: Option<VesselMesh>,
    /// `centreline.csv`, when there is one; else empty.
    pub centreline: Vec<Branch>,
    /// By number.
    pub trials: Vec<Trial>,
    /// What looks wrong but does not prevent anything.
    pub warnings: Vec<Warning>,
}

impl Bundle {
    /// Reads a bundle whole. It is refused with every fault of its rig.toml, or with the first fault
    /// of another file.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, BundleError> {
        let path = path.as_ref();
        let rig_file = path.join("rig.toml");
        let (rig, rig_warnings) = read_rig(&rig_file, &read_text(&rig_file)?)?;
        let mut warnings: Vec<_> = rig_warnings
            .into_iter()
            .map(|(place, message)| Warning { file: rig_file.clone(), place, message })
            .collect();
        let (mut mesh, mut centreline) = (None, Vec::new());
        if matches!(rig.plant, Plant::Catheter(_)) {
            let (stl, csv) = (path.join("vessel.stl"), path.join("centreline.csv"));
            if stl.exists() {
                mesh = Some(read_mesh(&stl, &mut warnings)?);
            }
            if csv.exists() {
                let remarks;
                (centreline, remarks) = read_centreline(&read_text(&csv)?)
                    .map_err(|(place, cause)| BundleError::new(&csv, place, cause))?;
                let warning = |(place, message)| Warning { file: csv.clone(), place, message };
                warnings.extend(remarks.into_iter().map(warning));
                check_radii(&csv, &centreline, &mut warnings);
            }
            if mesh.is_none() && centreline.is_empty() {
                return Err(BundleError::new(path, Place::Whole, Cause::NoVessel));
            }
        }
        let trials = read_trials(&path.join("trials"), &rig, &mut warnings)?;
        Ok(Self { path: path.to_path_buf(), rig, mesh, centreline, trials, warnings })
    }

    /// A bundle of a rig and trials that do not come from a folder; it has no vessel.
    ///
    /// `file`: their origin, used in messages and as the bundle's path.
    pub fn without_vessel(
        file: &Path,
        rig_toml: &str,
        trials: Vec<Trial>,
    ) -> Result<Self, BundleError> {
        let (rig, rig_warnings) = read_rig(file, rig_toml)?;
        let warning = |(place, message)| Warning { file: file.to_path_buf(), place, message };
        Ok(Self {
            path: file.to_path_buf(),
            rig,
            mesh: None,
            centreline: Vec::new(),
            trials,
            warnings: rig_warnings.into_iter().map(warning).collect(),
        })
    }

    /// The rig of a catheter; `None` for a drive and for a transmission.
    pub fn catheter(&self) -> Option<&CatheterRig> {
        match &self.rig.plant {
            Plant::Catheter(catheter) => Some(catheter),
            Plant::Drive(_) | Plant::Transmission(_) => None,
        }
    }

    /// The trial of this number.
    pub fn trial(&self, number: u32) -> Option<&Trial> {
        self.trials.iter().find(|trial| trial.number == number)
    }

    /// The largest insertion of any trial, the guidewire's included \[m\]; `None` without a
    /// catheter's trial.
    pub fn largest_insertion_m(&self) -> Option<f64> {
        let trials = self.trials.iter().filter_map(Trial::catheter);
        let columns = trials.flat_map(|trial| {
            let wire = trial.guidewire.iter().flat_map(|wire| &wire.insertion_m);
            trial.insertion_m.iter().chain(wire)
        });
        columns.copied().max_by(f64::total_cmp)
    }
}

fn read_rig(file: &Path, text: &str) -> Result<(Rig, Vec<RigWarning>), BundleError> {
    Rig::parse(text).map_err(|(first, others)| BundleError::of_all(file, first, others))
}

/// Reads an STL file as the surface of a lumen; adds what looks wrong to `warnings`.
pub(crate) fn read_mesh(
    file: &Path,
    warnings: &mut Vec<Warning>,
) -> Result<VesselMesh, BundleError> {
    let triangles = read_stl(&read_bytes(file)?)
        .map_err(|(place, cause)| BundleError::new(file, place, cause))?;
    let (mesh, repairs) = Mesh::from_triangles(&triangles)
        .map_err(|cause| BundleError::new(file, Place::Whole, cause))?;
    warnings.extend(mesh_doubts(&repairs).into_iter().map(|message| Warning {
        file: file.to_path_buf(),
        place: Place::Whole,
        message,
    }));
    Ok(VesselMesh { mesh, repairs })
}

/// Warnings about the size of a mesh, its repairs and its pieces.
pub fn mesh_doubts(repairs: &MeshRepairs) -> Vec<String> {
    // The unit comes first: what else looks wrong may follow from it.
    let mut doubts = unit_hint(&repairs.figure).into_iter().collect::<Vec<_>>();
    if repairs.degenerate > 0 {
        doubts.push(format!("{} triangles without area were left out", repairs.degenerate));
    }
    if repairs.flipped > 0 {
        doubts.push(format!("{} triangles faced the wrong way and were turned", repairs.flipped));
    }
    if repairs.inside_out > 0 {
        doubts.push(format!(
            "the surface is inside out: {} triangles face the lumen, and not away from it; the lumen is taken \
             where the surface encloses it",
            repairs.inside_out
        ));
    }
    if repairs.split > 0 {
        doubts.push(format!(
            "corners of facets lay on the edges of others, which were split there ({})",
            repairs.split
        ));
    }
    if repairs.pieces > 1 {
        doubts.push(format!("the surface is in {} pieces; a lumen is one", repairs.pieces));
    }
    if let Some([x, y, z]) = repairs.doubts.overlap_mm {
        doubts.push(format!(
            "a piece of the surface reaches into another at ({x:.1}, {y:.1}, {z:.1}) mm, and stands \
             as a wall in its lumen; unite them (a boolean union) and export again"
        ));
    }
    if let Some(NonManifold { edges, facets, at_mm: [x, y, z] }) = repairs.left_out {
        doubts.push(format!(
            "more than two triangles share {edges} edges, the first at ({x:.1}, {y:.1}, {z:.1}) mm: \
             {facets} triangles of fins, membranes or doubles were left out there"
        ));
    }
    if let Some(Crossing { pairs, at_mm: [x, y, z] }) = repairs.crossing {
        doubts.push(format!(
            "the surface crosses itself: {pairs} pairs of triangles run through each other, around \
             ({x:.1}, {y:.1}, {z:.1}) mm; distances are wrong there: unite the parts (a boolean union) \
             and export again"
        ));
    }
    let channels = repairs.doubts.channels;
    match repairs.figure.is_phantom() {
        _ if channels == 0 => {}
        true => doubts.push(format!(
            "the surface is closed around channels ({channels}), as the wall of a phantom is: its \
             material is taken for the lumen; export the inner surface only, open at its ends"
        )),
        false => doubts.push(format!(
            "the lumen is closed and goes round in {channels} loops, as a circle of Willis does; the \
             instrument enters only where it is open"
        )),
    }
    if repairs.figure.caps > 0 {
        let places = repairs.figure.named_caps_mm().iter();
        let places = places.map(|[x, y, z]| format!("({x:.1}, {y:.1}, {z:.1})"));
        doubts.push(format!(
            "the surface is capped at {} flat ends, at {} mm: an instrument cannot enter it; cut the \
             caps off, at least where it enters",
            repairs.figure.caps,
            places.collect::<Vec<_>>().join(", ")
        ));
    }
    doubts
}

fn check_radii(file: &Path, branches: &[Branch], warnings: &mut Vec<Warning>) {
    for branch in branches {
        let radii = branch.stations.iter().map(|station| station.radius_m);
        let widest = radii.clone().fold(0.0, f64::max);
        let narrowest = radii.fold(f64::INFINITY, f64::min);
        let says = if widest > 0.04 {
            format!("is {:.0} mm wide, wider than a hand: millimetres for metres?", 2e3 * widest)
        } else if narrowest < 0.2e-3 {
            format!("is {:.4} mm wide, narrower than any instrument", 2e3 * narrowest)
        } else {
            continue;
        };
        let message = format!("branch `{}` {says}", branch.name);
        warnings.push(Warning { file: file.to_path_buf(), place: Place::Whole, message });
    }
}

fn read_trials(
    folder: &Path,
    rig: &Rig,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<Trial>, BundleError> {
    if !folder.exists() {
        warnings.push(no_trials(folder));
        return Ok(Vec::new());
    }
    let io = |error| BundleError::new(folder, Place::Whole, Cause::Io(error));
    let mut trials = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(io)? {
        let file = entry.map_err(io)?.path();
        let stem = file.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
        // Files that a file system or an editor leaves beside others begin with a point.
        if file.extension().is_none_or(|ending| ending != "csv") || stem.starts_with('.') {
            let message = "not a trial; it is not read".to_owned();
            warnings.push(Warning { file, place: Place::Whole, message });
            continue;
        }
        let digits = stem.bytes().all(|byte| byte.is_ascii_digit());
        let number = stem.parse::<u32>().ok().filter(|_| digits);
        let number =
            number.ok_or_else(|| BundleError::new(&file, Place::Whole, Cause::TrialName))?;
        if trials.iter().any(|trial: &Trial| trial.number == number) {
            return Err(BundleError::new(&file, Place::Whole, Cause::TrialTwice(number)));
        }
        let text = read_text(&file)?;
        let trial = match &rig.plant {
            Plant::Catheter(rig) => {
                let has_guidewire = rig.guidewire.is_some();
                Trial::parse_catheter(number, &text, has_guidewire, rig.tendons.len())
            }
            Plant::Drive(rig) => Trial::parse_drive(number, &text, rig),
            Plant::Transmission(rig) => Trial::parse_transmission(number, &text, rig),
        };
        let Parsed { trial, remarks } =
            trial.map_err(|(place, cause)| BundleError::new(&file, place, cause))?;
        let warning = |message| Warning { file: file.clone(), place: Place::Whole, message };
        warnings.extend(remarks.into_iter().map(warning));
        trial::warn_of_units(&file, &trial, rig, warnings);
        trials.push(trial);
    }
    if trials.is_empty() {
        warnings.push(no_trials(folder));
    }
    trials.sort_by_key(|trial| trial.number);
    Ok(trials)
}

fn no_trials(folder: &Path) -> Warning {
    let message = "there are no trials; only the rig can be used".to_owned();
    Warning { file: folder.to_path_buf(), place: Place::Whole, message }
}
