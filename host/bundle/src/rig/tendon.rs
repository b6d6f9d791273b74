//! Table `[tendon]`: what bends the tip of a steerable instrument.

use std::f64::consts::TAU;

use super::instrument::RigInstrument;
use super::toml_reader::TableReader;

/// Table `[tendon]`. It is anchored at the tip and held at the handle, pulled by the same length in
/// all trials.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigTendon {
    /// From where it is taut in the straight instrument.
    pub pull_m: f64,
    pub stiffness_n_per_m: f64,
    /// From the centre line.
    pub offset_m: f64,
    /// Length that it bends, from the tip backwards.
    pub length_m: f64,
    /// Where it lies: 0 at `up`, a quarter turn at `direction × up`.
    pub angle_rad: f64,
}

const TENDON_KEYS: [&str; 5] = ["pull_m", "stiffness_N_per_m", "offset_m", "length_m", "angle_rad"];
/// The most that the device's settings `tendon.*` may be.
const LONGEST_PULL_M: f64 = 0.05;
const STIFFEST_N_PER_M: f64 = 1e5;

/// The tendon, if there is one.
pub(super) fn read_tendon(root: &TableReader<'_>, instrument: &RigInstrument) -> Option<RigTendon> {
    let table = root.optional_table("tendon", &TENDON_KEYS)?;
    let above_0 = f64::MIN_POSITIVE;
    let angle = table.optional_number_in("angle_rad", -TAU..=TAU, "between -2 pi and 2 pi");
    Some(RigTendon {
        pull_m: table.number_in("pull_m", 0.0..=LONGEST_PULL_M, "between 0 and 0.05 m"),
        stiffness_n_per_m: table.number_in(
            "stiffness_N_per_m",
            above_0..=STIFFEST_N_PER_M,
            "above 0 and at most 100000 N/m",
        ),
        offset_m: table.number_in(
            "offset_m",
            above_0..=0.5 * instrument.outer_diameter_m,
            "above 0 and at most the instrument's outer radius, within which it runs",
        ),
        length_m: table.number_in(
            "length_m",
            above_0..=instrument.length_m,
            "above 0 and at most the instrument's length",
        ),
        angle_rad: angle.unwrap_or(0.0),
    })
}
