//! What `rig.toml` says, in numbers: SI units, vectors in the right-handed frame of the vessel.

use super::drive::DriveRig;
use super::driven_tendons::RigDrivenTendon;
use super::instrument::RigInstrument;
use super::priors::RigPriors;
use super::tendon::RigTendon;
use super::transmission::TransmissionRig;

/// Table `[entry]`; `direction` and `up` are orthonormal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigEntry {
    pub position_m: [f64; 3],
    pub direction: [f64; 3],
    pub up: [f64; 3],
    pub guide_length_m: Option<f64>,
}

/// Part of a wall, within a sphere, that is stiffer or softer than the rest, like a plaque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallRegion {
    pub centre_m: [f64; 3],
    pub radius_m: f64,
    /// Ratio to the stiffness that `[vessel]` states.
    pub stiffness_ratio: f64,
}

/// Table `[vessel]`.
#[derive(Clone, Debug, PartialEq)]
pub struct RigVessel {
    pub friction_coefficient: f64,
    /// Stiffness at one contact point, which stands for a length of `wall_contact_spacing_m`.
    pub wall_stiffness_n_per_m: f64,
    pub wall_contact_spacing_m: f64,
    pub wall_tangential_ratio: Option<f64>,
    /// Where regions overlap, the last one applies.
    pub wall_regions: Vec<WallRegion>,
}

impl RigVessel {
    /// Line stiffness of the wall \[N/m²\].
    pub fn line_stiffness_n_per_m2(&self) -> f64 {
        self.wall_stiffness_n_per_m / self.wall_contact_spacing_m
    }

    /// Line stiffness of the stiffest region \[N/m²\].
    pub fn stiffest_n_per_m2(&self) -> f64 {
        let ratios = self.wall_regions.iter().map(|region| region.stiffness_ratio);
        self.line_stiffness_n_per_m2() * ratios.fold(1.0, f64::max)
    }
}

/// The fluid that surrounds the instrument.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fluid {
    pub density_kg_per_m3: f64,
    pub viscosity_pa_s: f64,
}

/// Table `[environment]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigEnvironment {
    pub gravity_m_per_s2: [f64; 3],
    pub fluid: Option<Fluid>,
}

/// Table `[sensor]`; values that are not stated are `None`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RigSensor {
    pub force_noise_sd_n: Option<f64>,
    pub force_rate_hz: Option<f64>,
    pub tip_noise_sd_m: Option<f64>,
    pub drive_noise_sd_n: Option<f64>,
    pub shape_noise_sd_m: Option<f64>,
    pub insertion_resolution_m: Option<f64>,
    pub rotation_resolution_rad: Option<f64>,
    /// Of a drive's position, and of a transmission's input.
    pub position_noise_sd_m: Option<f64>,
    /// Of a transmission's output, in its unit.
    pub output_noise_sd: Option<f64>,
}

/// A catheter, or a guidewire on its own, in a vessel.
#[derive(Clone, Debug, PartialEq)]
pub struct CatheterRig {
    pub instrument: RigInstrument,
    /// Inside the catheter, with its own drive.
    pub guidewire: Option<RigInstrument>,
    /// Of a steerable instrument, with a fixed pull.
    pub tendon: Option<RigTendon>,
    /// Those whose drives are recorded, in the order of their columns.
    pub tendons: Vec<RigDrivenTendon>,
    pub entry: RigEntry,
    pub vessel: RigVessel,
    pub environment: RigEnvironment,
}

/// The kind of rig.
#[derive(Clone, Debug, PartialEq)]
pub enum Plant {
    Catheter(Box<CatheterRig>),
    Drive(DriveRig),
    Transmission(TransmissionRig),
}

/// All of `rig.toml`.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    pub name: String,
    pub plant: Plant,
    pub sensor: RigSensor,
    pub priors: RigPriors,
    /// Free text of `[nominal]`.
    pub note: Option<String>,
}
