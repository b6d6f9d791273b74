//! Table `[priors]`: how well the rig is known.

use super::drive::refuse_other_axis;
use super::keys::PlantKind;
use super::toml_reader::{POSITIVE, TableReader};
use crate::axis::Axis;

/// Table `[priors]`: standard deviations of the nuisance parameters of every trial. A value that is not
/// stated is `None`; the diagnosis then uses its own.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RigPriors {
    /// Of the zero of every axis of the force sensor; of a drive, of its command.
    pub force_bias_sd_n: Option<f64>,
    /// Between encoders and force.
    pub time_shift_sd_s: Option<f64>,
    /// Of the length inside when a trial begins.
    pub insertion_offset_sd_m: Option<f64>,
    /// Of where the phantom stands, along each axis.
    pub registration_sd_m: Option<f64>,
    /// Of how it is turned, about each axis.
    pub registration_sd_rad: Option<f64>,
    /// Of where the wall is, against the mesh.
    pub wall_sd_m: Option<f64>,
    /// How much farther the wall may be off where it bends into the lumen, as where a vessel divides.
    pub wall_at_junctions_sd_m: Option<f64>,
    /// Of the zero of a transmission's output, in its unit.
    pub output_zero_sd: Option<f64>,
}

const CATHETER_KEYS: [&str; 7] = [
    "force_bias_sd_N",
    "time_shift_sd_s",
    "insertion_offset_sd_m",
    "registration_sd_m",
    "registration_sd_rad",
    "wall_sd_m",
    "wall_at_junctions_sd_m",
];
/// A drive on its own touches nothing, so it has no priors of vessel or wall.
const DRIVE_KEYS: [&str; 3] = ["force_bias_sd_N", "time_shift_sd_s", "torque_bias_sd_Nm"];

const TRANSMISSION_KEYS: [&str; 3] = ["output_zero_sd_m", "output_zero_sd_rad", "time_shift_sd_s"];

/// The keys that a rig may have.
pub(super) const fn prior_keys(plant: PlantKind) -> &'static [&'static str] {
    match plant {
        PlantKind::Catheter => &CATHETER_KEYS,
        PlantKind::Drive => &DRIVE_KEYS,
        PlantKind::Transmission => &TRANSMISSION_KEYS,
    }
}

/// Reads the priors that are stated.
///
/// `axis`: of a drive on its own.
pub(super) fn read_priors(root: &TableReader<'_>, axis: Option<Axis>) -> RigPriors {
    let plant = if axis.is_some() { PlantKind::Drive } else { PlantKind::Catheter };
    let Some(table) = root.optional_table("priors", prior_keys(plant)) else {
        return RigPriors::default();
    };
    let bias = match axis {
        Some(Axis::Rotary) => "torque_bias_sd_Nm",
        _ => "force_bias_sd_N",
    };
    if axis.is_some() {
        refuse_other_axis(&table, axis, &["force_bias_sd_N"], &["torque_bias_sd_Nm"]);
    }
    let number = |key| table.optional_number_in(key, POSITIVE, "above 0");
    RigPriors {
        force_bias_sd_n: number(bias),
        time_shift_sd_s: number("time_shift_sd_s"),
        insertion_offset_sd_m: number("insertion_offset_sd_m"),
        registration_sd_m: number("registration_sd_m"),
        registration_sd_rad: number("registration_sd_rad"),
        wall_sd_m: number("wall_sd_m"),
        wall_at_junctions_sd_m: number("wall_at_junctions_sd_m"),
        output_zero_sd: None,
    }
}
