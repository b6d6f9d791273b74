//! The columns of a recording's ticks, which every export has under the same names.
//!
//! A channel of a trial bundle has its name here too: `fx_N`, `drive_fx_N`, `tip_x_m`,
//! `guidewire_insertion_m` and so on.

use cathforce_control::Mode;

use crate::analysis::estimates::trial_time_s;
use crate::decoding::tick::{GuidewireEstimate, TickEstimate};
use crate::reading::reader::Recording;

/// The values of one column; `None` is a value that is not known.
#[derive(Clone, Debug, PartialEq)]
pub enum Column {
    Integer(Vec<Option<i32>>),
    Long(Vec<i64>),
    Flag(Vec<Option<bool>>),
    Single(Vec<Option<f32>>),
    Double(Vec<f64>),
    Text(Vec<String>),
}

impl Column {
    /// A value as CSV has it: a flag is 0 or 1, and an unknown value is empty.
    pub(crate) fn text(&self, row: usize) -> String {
        fn known<T: ToString>(value: Option<T>) -> String {
            value.map_or(String::new(), |value| value.to_string())
        }
        match self {
            Self::Integer(rows) => known(rows[row]),
            Self::Long(rows) => rows[row].to_string(),
            Self::Flag(rows) => known(rows[row].map(u8::from)),
            Self::Single(rows) => known(rows[row]),
            // Times: a tick of a millisecond has three decimals, its place on the bus three more.
            Self::Double(rows) => format!("{:.6}", rows[row]),
            Self::Text(rows) => rows[row].clone(),
        }
    }
}

/// Names and values of the ticks, one row a tick.
///
/// `entry_m`: position of the entry, vessel frame \[m\].
pub fn tick_columns(
    recording: &Recording,
    ticks: &[TickEstimate],
    entry_m: [f32; 3],
) -> Vec<(&'static str, Column)> {
    let single =
        |of: &dyn Fn(&TickEstimate) -> Option<f32>| Column::Single(ticks.iter().map(of).collect());
    let integer =
        |of: &dyn Fn(&TickEstimate) -> Option<i32>| Column::Integer(ticks.iter().map(of).collect());
    let flag =
        |of: &dyn Fn(&TickEstimate) -> Option<bool>| Column::Flag(ticks.iter().map(of).collect());
    let wire = |of: fn(GuidewireEstimate) -> Option<f32>| single(&|t| of(t.guidewire?));
    let tendon = |k: usize| single(&move |t| t.tendons_m[k]);
    let tension = |k: usize| single(&move |t| t.tendon_tensions_n[k]);
    let force = |k: usize| single(&move |t| Some(t.force_n?[k]));
    let half_width = |k: usize| single(&move |t| Some(t.force_half_width_n?[k]));
    let tip = |k: usize| single(&move |t| Some(entry_m[k] + t.tip_from_entry_m?[k]));
    vec![
        ("tick", Column::Long(ticks.iter().map(|t| t.tick as i64).collect())),
        ("t_s", Column::Double(ticks.iter().map(|t| trial_time_s(recording, t.at_ns)).collect())),
        ("mode", Column::Text(ticks.iter().map(mode_name).collect())),
        ("fault", integer(&|t| Some(t.fault.into()))),
        ("unresolved", flag(&|t| Some(t.unresolved))),
        ("limited", flag(&|t| Some(t.limited))),
        ("insertion_m", single(&|t| t.insertion_m)),
        ("rotation_rad", single(&|t| t.rotation_rad)),
        ("haptic_force_N", single(&|t| Some(t.haptic_force_n))),
        ("haptic_torque_N_m", single(&|t| Some(t.haptic_torque_n_m))),
        ("fx_N", force(0)),
        ("fy_N", force(1)),
        ("fz_N", force(2)),
        ("drive_fx_N", single(&|t| t.drive_force_n)),
        ("drive_torque_N_m", single(&|t| t.drive_torque_n_m)),
        ("peak_contact_force_N", single(&|t| t.peak_contact_force_n)),
        ("peak_node", integer(&|t| t.peak_node.map(i32::from))),
        ("tip_x_m", tip(0)),
        ("tip_y_m", tip(1)),
        ("tip_z_m", tip(2)),
        ("guidewire_insertion_m", wire(|w| Some(w.insertion_m))),
        ("guidewire_rotation_rad", wire(|w| Some(w.rotation_rad))),
        ("guidewire_drive_fx_N", wire(|w| w.drive_force_n)),
        ("guidewire_drive_torque_N_m", wire(|w| w.drive_torque_n_m)),
        ("guidewire_felt", flag(&|t| t.guidewire?.felt)),
        ("tendon_1_m", tendon(0)),
        ("tendon_2_m", tendon(1)),
        ("tendon_3_m", tendon(2)),
        ("tendon_4_m", tendon(3)),
        ("tendon_1_tension_N", tension(0)),
        ("tendon_2_tension_N", tension(1)),
        ("tendon_3_tension_N", tension(2)),
        ("tendon_4_tension_N", tension(3)),
        ("fx_half_width_N", half_width(0)),
        ("fy_half_width_N", half_width(1)),
        ("fz_half_width_N", half_width(2)),
        ("drive_fx_half_width_N", single(&|t| t.drive_force_half_width_n)),
    ]
}

/// The mode's name, or its code if it has none.
fn mode_name(tick: &TickEstimate) -> String {
    let mode = Mode::from_codes(tick.mode, tick.fault);
    mode.map_or_else(|| tick.mode.to_string(), |mode| mode.name().to_owned())
}
