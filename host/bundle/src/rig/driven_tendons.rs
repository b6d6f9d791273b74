//! Array of tables `[[tendons]]`: tendons whose drives are recorded.

use std::f64::consts::TAU;

use cathforce_mechanics::MAX_TENDONS;

use super::cause::RigCause;
use super::instrument::RigInstrument;
use super::toml_reader::TableReader;

/// One table of `[[tendons]]`, anchored at the catheter and pulled by a drive of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigDrivenTendon {
    /// Where it lies: 0 at `up`, a quarter turn at `direction × up`.
    pub angle_rad: f64,
    /// From the centre line.
    pub offset_m: f64,
    /// Arc from the tip to its anchor.
    pub anchor_m: f64,
    /// Of the whole tendon, along itself.
    pub stiffness_n_per_m: f64,
    /// Displacement that takes up slack before it pulls.
    pub slack_m: f64,
    /// Friction coefficients in its lumen while its drive holds still, and while it moves.
    pub static_friction: f64,
    pub sliding_friction: f64,
    /// Angle by which its lumen is bent between the drive and the entry plane.
    pub bend_behind_rad: f64,
}

pub(super) const TENDONS: &str = "tendons";
const TENDONS_KEYS: [&str; 8] = [
    "angle_rad",
    "offset_m",
    "anchor_m",
    "stiffness_N_per_m",
    "slack_m",
    "static_friction",
    "sliding_friction",
    "bend_behind_rad",
];
/// What the model takes (`Description::validate`).
const STIFFNESSES_N_PER_M: std::ops::RangeInclusive<f64> = 1.0..=1e6;
const LONGEST_SLACK_M: f64 = 0.02;
const MOST_BEHIND_RAD: f64 = 30.0;
/// Largest friction coefficient times bend behind the entry plane.
const MOST_WRAP: f64 = 4.0;

/// The tendons, in the order of their columns.
pub(super) fn read_driven_tendons(
    root: &TableReader<'_>,
    instrument: &RigInstrument,
) -> Vec<RigDrivenTendon> {
    let tables = root.tables(TENDONS, &TENDONS_KEYS);
    if tables.len() > MAX_TENDONS {
        let cause = RigCause::TooManyTendons { found: tables.len(), most: MAX_TENDONS };
        root.report(root.place_of(TENDONS), cause);
    }
    if !tables.is_empty() && root.has("tendon") {
        root.report(root.place_of("tendon"), RigCause::BothTendons);
    }
    tables.iter().map(|table| read(table, instrument)).collect()
}

fn read(table: &TableReader<'_>, instrument: &RigInstrument) -> RigDrivenTendon {
    let optional = |key, range, meaning| table.optional_number_in(key, range, meaning);
    let within_radius = "above 0 and at most the instrument's outer radius, within which it runs";
    let on_instrument =
        "at least 0 and less than the instrument's length: it ends on the instrument";
    let offset_m = table.number_in(
        "offset_m",
        f64::MIN_POSITIVE..=0.5 * instrument.outer_diameter_m,
        within_radius,
    );
    let anchor_m = optional("anchor_m", 0.0..=0.999 * instrument.length_m, on_instrument);
    let stiffness_n_per_m =
        table.number_in("stiffness_N_per_m", STIFFNESSES_N_PER_M, "between 1 and 1000000 N/m");
    let static_friction = optional("static_friction", 0.0..=2.0, "between 0 and 2");
    let at_most = static_friction.unwrap_or(2.0);
    let below_static = "at least 0 and at most static_friction";
    let sliding_friction = optional("sliding_friction", 0.0..=at_most, below_static);
    // One of them stands for both.
    let friction = |own: Option<f64>, other: Option<f64>| own.or(other).unwrap_or(0.0);
    let static_friction_or = friction(static_friction, sliding_friction);
    let most_rad = if static_friction_or > 0.0 {
        (MOST_WRAP / static_friction_or).min(MOST_BEHIND_RAD)
    } else {
        MOST_BEHIND_RAD
    };
    let behind = "between 0 and 30 rad, and at most 4 over static_friction";
    RigDrivenTendon {
        angle_rad: optional("angle_rad", -TAU..=TAU, "between -2 pi and 2 pi").unwrap_or(0.0),
        offset_m,
        anchor_m: anchor_m.unwrap_or(0.0),
        stiffness_n_per_m,
        slack_m: optional("slack_m", 0.0..=LONGEST_SLACK_M, "between 0 and 0.02 m").unwrap_or(0.0),
        static_friction: static_friction_or,
        sliding_friction: friction(sliding_friction, static_friction),
        bend_behind_rad: optional("bend_behind_rad", 0.0..=most_rad, behind).unwrap_or(0.0),
    }
}
