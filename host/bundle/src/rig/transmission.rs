//! What carries a motion from where it is driven to where it is used.

use crate::axis::Axis;

/// A transmission as it is believed to be. Lengths of slack and hysteresis are in the unit of the input, a
/// compliance is in that of the output for each N or N·m of the load at the output.
#[derive(Clone, Debug, PartialEq)]
pub struct TransmissionRig {
    pub input: Axis,
    pub output: Axis,
    /// Output for each unit of the input; negative where the two run against each other.
    pub gain: f64,
    /// Input that a reversal takes up before the output follows, and share of the motion that passes meanwhile.
    pub dead_zone: f64,
    pub dead_zone_follows: f64,
    pub compliance: f64,
    pub time_constant_s: f64,
    pub sheath: Option<RigSheath>,
    pub bouc_wen: Option<RigBoucWen>,
    pub prandtl_ishlinskii: Option<RigPrandtlIshlinskii>,
}

/// Table `[transmission.sheath]`: a tendon in a bent sheath.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigSheath {
    /// Sum of the angles by which the sheath bends, unless a trial records it.
    pub bend_rad: f64,
    pub friction_coefficient: f64,
    /// Tension of the far end where the input is 0 \[N\], and the spring that it pulls against there.
    pub pull_n: f64,
    pub return_n_per_m: f64,
    pub tendon_n_per_m: f64,
}

/// Table `[transmission.bouc_wen]`: motion that is lost after a reversal and grows to `height` over about `length`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigBoucWen {
    pub height: f64,
    pub length: f64,
    /// Exponent of the model.
    pub sharpness: f64,
}

/// Table `[transmission.prandtl_ishlinskii]`: stops of equal weight with radii of 0 to `radius`, which lose
/// `height` together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigPrandtlIshlinskii {
    pub height: f64,
    pub radius: f64,
}
