//! Why a trial is refused.

use thiserror::Error;

use crate::table::TableCause;

/// Largest time \[s\]: three hundred years after 1970. Its nanoseconds can still be counted.
pub(super) const LATEST_S: f64 = 1e10;

/// Longest gap over which an encoder is interpolated \[s\], be it of empty fields or of missing rows.
pub const LONGEST_GAP_S: f64 = 0.25;

/// Why a trial is refused.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum TrialCause {
    #[error(transparent)]
    Table(#[from] TableCause),
    #[error("the trial has no rows")]
    Empty,
    #[error("t_s goes back: {now} s after {before} s")]
    TimeNotRising { before: f64, now: f64 },
    #[error("t_s is {0}, beyond the time of any clock")]
    Time(f64),
    #[error("no row for {:.3} s, from t_s = {before} to {now}: what the drive did there is not known", now - before)]
    Hole { before: f64, now: f64 },
    #[error("column `{column}` has no value for {gap_s:.3} s from here on")]
    EncoderGap { column: &'static str, gap_s: f64 },
    #[error("{column} is {value}; the length inside the vessel cannot be negative")]
    NegativeInsertion { column: &'static str, value: f64 },
    #[error("column `{0}` is missing; rig.toml has a [guidewire], whose drive it is")]
    GuidewireMissing(&'static str),
    #[error("column `{0}` is of a guidewire's drive, but rig.toml has no [guidewire]")]
    NoGuidewire(&'static str),
    #[error("column `{column}` is missing; rig.toml has {tendons} [[tendons]], of which it is one")]
    TendonMissing { column: &'static str, tendons: usize },
    #[error("column `{column}` is of a tendon, but rig.toml has {tendons} [[tendons]]")]
    NoTendon { column: &'static str, tendons: usize },
    #[error("`{missing}` has no value in this row, but `{given}` has one")]
    HalfVector { missing: String, given: String },
    #[error("the shape points leave out p{0:02}")]
    ShapeGap(usize),
    #[error("column `{column}` is of a {other} axis, but by [drive] of rig.toml this one is {own}")]
    OtherAxis { column: &'static str, own: &'static str, other: &'static str },
    #[error("column `{column}` is not in the unit of `{position}`, which stands beside it")]
    MixedAxes { column: &'static str, position: &'static str },
    #[error("columns `{column}` and `{beside}` both say what drives the axis")]
    TwoCommands { column: &'static str, beside: &'static str },
    #[error("column `{0}` is of a motor, but rig.toml has no [drive.motor]")]
    NoMotor(&'static str),
    #[error(
        "column `{column}` is not in {own}, the unit that the key of the gain in [transmission] has for it"
    )]
    OtherGain { column: &'static str, own: &'static str },
    #[error("columns `{column}` and `{beside}` are the same position in two units")]
    Same { column: &'static str, beside: &'static str },
    #[error("column `{column}` is not the load of this output, which is `{load}`")]
    OtherLoad { column: &'static str, load: &'static str },
    #[error("column `{0}` is of a sheath, but rig.toml has no [transmission.sheath]")]
    NoSheath(&'static str),
    #[error("column `{0}` is negative; it is a sum of angles without their signs")]
    NegativeBend(&'static str),
    #[error("column `{0}` is in volts, but [drive.motor] of rig.toml has no resistance_ohm")]
    NoResistance(&'static str),
}

impl TrialCause {
    /// What to do about it.
    pub fn fix(&self) -> String {
        match self {
            TrialCause::Table(cause) => cause.fix(),
            TrialCause::Empty => "record the trial again, or take the file out".into(),
            TrialCause::TimeNotRising { .. } => {
                "sort the rows by t_s; where the clock was set back, cut the trial in two there".into()
            }
            TrialCause::Time(_) => "give seconds since the trial began, or since 1970".into(),
            TrialCause::Hole { .. } => format!(
                "rows are at most {LONGEST_GAP_S} s apart: write t_s in seconds, mend a clock that jumps, or \
                 cut the trial in two here"
            ),
            TrialCause::EncoderGap { .. } => format!(
                "an encoder is interpolated over gaps of {} s at most: give it in more rows, or take \
                 out the rows in the gap",
                LONGEST_GAP_S
            ),
            TrialCause::NegativeInsertion { .. } => {
                "give the unstretched length past the entry plane, not the feed since the start"
                    .into()
            }
            TrialCause::GuidewireMissing(_) => {
                "add the column; a wire that is withdrawn to the entry plane is at 0".into()
            }
            TrialCause::NoGuidewire(_) => {
                "describe the wire in the table [guidewire], with the keys of [instrument], or take \
                 the column out"
                    .into()
            }
            TrialCause::TendonMissing { .. } => {
                "add the displacement of its drive from where the tendon is taut in the straight \
                 instrument, positive when pulling, or take the tendon out of rig.toml"
                    .into()
            }
            TrialCause::NoTendon { .. } => {
                "describe the tendon in a table [[tendons]] with offset_m and stiffness_N_per_m, or take \
                 the column out"
                    .into()
            }
            TrialCause::HalfVector { .. } => {
                "a vector has three components: give all of them, or leave all three empty".into()
            }
            TrialCause::OtherAxis { own: "linear", .. } => {
                "give moving_inertia_kg_m2 in place of moving_mass_kg, or record metres".into()
            }
            TrialCause::OtherAxis { .. } => {
                "give moving_mass_kg in place of moving_inertia_kg_m2, or record radians".into()
            }
            TrialCause::MixedAxes { .. } => {
                "a linear axis has position_m, drive_command_N, setpoint_m and load_N; a rotary one has \
                 position_rad, drive_command_Nm, setpoint_rad and load_Nm"
                    .into()
            }
            TrialCause::TwoCommands { .. } => "keep the one that is known best".into(),
            TrialCause::NoMotor(_) => {
                "add the table [drive.motor] with torque_constant_Nm_per_A, or force_constant_N_per_A of a \
                 linear motor; its gear is gear_ratio or lead_m_per_turn"
                    .into()
            }
            TrialCause::NoResistance(_) => {
                "add resistance_ohm of the winding; back_emf_V_s_per_rad is the torque constant unless \
                 it is stated"
                    .into()
            }
            TrialCause::OtherGain { .. } => {
                "write gain_m_per_m, gain_rad_per_m, gain_m_per_rad or gain_rad_per_rad: output per input"
                    .into()
            }
            TrialCause::Same { .. } => "keep the one in the unit of the gain".into(),
            TrialCause::OtherLoad { .. } => {
                "give newtons for an output in metres, newton metres for one in radians".into()
            }
            TrialCause::NoSheath(_) => {
                "add the table [transmission.sheath] with friction_coefficient, bend_rad, pull_N and \
                 tendon_N_per_m, or take the column out"
                    .into()
            }
            TrialCause::NegativeBend(_) => "add up the sizes of the angles".into(),
            TrialCause::ShapeGap(_) => {
                "number the shape points without gaps, tip first, each with _x_m, _y_m, _z_m".into()
            }
        }
    }
}
