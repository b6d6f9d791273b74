//! Keys of the tables of `rig.toml` that are read in more than one place.

/// As `plant` names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PlantKind {
    Catheter,
    Drive,
    Transmission,
}

impl PlantKind {
    pub(super) const ALL: [Self; 3] = [Self::Catheter, Self::Drive, Self::Transmission];

    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Catheter => "catheter",
            Self::Drive => "drive",
            Self::Transmission => "transmission",
        }
    }
}

pub(super) const ENTRY_KEYS: [&str; 4] = ["position_m", "direction", "up", "guide_length_m"];

pub(super) const VESSEL_KEYS: [&str; 5] = [
    "friction_coefficient",
    "wall_stiffness_N_per_m",
    "wall_contact_spacing_m",
    "wall_tangential_ratio",
    WALL_REGIONS,
];

pub(super) const WALL_REGIONS: &str = "wall_regions";

pub(super) const ENVIRONMENT_KEYS: [&str; 6] = [
    "gravity_m_per_s2",
    "fluid",
    "fluid_density_kg_per_m3",
    "fluid_viscosity_Pa_s",
    "density_kg_per_m3",
    "viscosity_Pa_s",
];

pub(super) const SENSOR_KEYS: [&str; 10] = [
    "force_noise_sd_N",
    "force_rate_hz",
    "tip_noise_sd_m",
    "drive_noise_sd_N",
    "shape_noise_sd_m",
    "insertion_resolution_m",
    "rotation_resolution_rad",
    "position_noise_sd_m",
    "position_noise_sd_rad",
    "drive_noise_sd_Nm",
];
