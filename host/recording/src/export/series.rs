//! Ticks on the trial's time, and as CSV.

use std::io;

use cathforce_control::Mode;

use crate::decoding::tick::{NodePass, TickEstimate};
use crate::format::trial::Estimate;
use crate::reading::reader::Recording;
use crate::replay::Track;

/// Time of the trial at a time of the bus \[s\]; negative before the trial began.
pub fn trial_time_s(recording: &Recording, at_ns: u64) -> f64 {
    let start = recording.trial_start_ns.unwrap_or(0);
    (i128::from(at_ns) - i128::from(start)) as f64 * 1e-9
}

/// The ticks from the trial's beginning on, in the form that [`crate::compare()`] takes.
///
/// `entry_m`: position of the entry, vessel frame.
pub fn estimates(recording: &Recording, track: &Track, entry_m: [f64; 3]) -> Vec<Estimate> {
    let wide = |x: [f32; 3]| x.map(f64::from);
    track
        .ticks
        .iter()
        .filter_map(|tick| {
            let t_s = trial_time_s(recording, tick.at_ns);
            (recording.trial_start_ns.is_some() && t_s >= 0.0).then_some(Estimate {
                t_s,
                force_n: wide(tick.force_n?),
                drive_force_n: tick.drive_force_n.map(f64::from),
                guidewire_force_n: tick
                    .guidewire
                    .and_then(|wire| wire.drive_force_n.map(f64::from)),
                tip_m: tick.tip_from_entry_m.map(|tip| {
                    let tip = wide(tip);
                    std::array::from_fn(|k| entry_m[k] + tip[k])
                }),
                force_half_width_n: tick.force_half_width_n.map(wide),
                drive_force_half_width_n: tick.drive_force_half_width_n.map(f64::from),
                unresolved: tick.unresolved,
            })
        })
        .collect()
}

const TICK_COLUMNS: [&str; 17] = [
    "tick",
    "t_s",
    "mode",
    "fault",
    "unresolved",
    "limited",
    "insertion_m",
    "rotation_rad",
    "haptic_force_n",
    "haptic_torque_n_m",
    "fx_n",
    "fy_n",
    "fz_n",
    "drive_force_n",
    "drive_torque_n_m",
    "peak_contact_force_n",
    "peak_node",
];
const GUIDEWIRE_COLUMNS: [&str; 5] = [
    "guidewire_insertion_m",
    "guidewire_rotation_rad",
    "guidewire_force_n",
    "guidewire_torque_n_m",
    "guidewire_felt",
];

/// Half widths of the band in which nine of ten true forces lie.
const BAND_COLUMNS: [&str; 4] =
    ["fx_half_width_n", "fy_half_width_n", "fz_half_width_n", "drive_force_half_width_n"];

/// One row a tick. A value that is not known is an empty field; the columns of the guidewire and
/// of the band are there if these are.
pub fn write_ticks_csv(
    recording: &Recording,
    ticks: &[TickEstimate],
    out: impl io::Write,
) -> io::Result<()> {
    ticks_csv(recording, ticks, out).map_err(io_error)
}

/// The I/O error within an error of the CSV writer, so that a closed pipe is recognised.
pub(crate) fn io_error(error: csv::Error) -> io::Error {
    let text = error.to_string();
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        _ => io::Error::other(text),
    }
}

fn ticks_csv(
    recording: &Recording,
    ticks: &[TickEstimate],
    out: impl io::Write,
) -> csv::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    let has_guidewire = ticks.iter().any(|tick| tick.guidewire.is_some());
    let has_band = ticks.iter().any(|tick| tick.has_band);
    let wire_header = GUIDEWIRE_COLUMNS.iter().filter(|_| has_guidewire);
    let band_header = BAND_COLUMNS.iter().filter(|_| has_band);
    csv.write_record(TICK_COLUMNS.iter().chain(wire_header).chain(band_header))?;
    for tick in ticks {
        let number = |x: Option<f32>| x.map_or(String::new(), |x| x.to_string());
        let force = |k: usize| number(tick.force_n.map(|force_n| force_n[k]));
        let row: [String; TICK_COLUMNS.len()] = [
            tick.tick.to_string(),
            format!("{:.6}", trial_time_s(recording, tick.at_ns)),
            mode_name(tick),
            tick.fault.to_string(),
            u8::from(tick.unresolved).to_string(),
            u8::from(tick.limited).to_string(),
            number(tick.insertion_m),
            number(tick.rotation_rad),
            tick.haptic_force_n.to_string(),
            tick.haptic_torque_n_m.to_string(),
            force(0),
            force(1),
            force(2),
            number(tick.drive_force_n),
            number(tick.drive_torque_n_m),
            number(tick.peak_contact_force_n),
            tick.peak_node.map_or(String::new(), |node| node.to_string()),
        ];
        let wire = tick.guidewire;
        let wire: [String; GUIDEWIRE_COLUMNS.len()] = [
            number(wire.map(|wire| wire.insertion_m)),
            number(wire.map(|wire| wire.rotation_rad)),
            number(wire.and_then(|wire| wire.drive_force_n)),
            number(wire.and_then(|wire| wire.drive_torque_n_m)),
            wire.and_then(|wire| wire.felt)
                .map_or(String::new(), |felt| u8::from(felt).to_string()),
        ];
        let half_width = |k: usize| number(tick.force_half_width_n.map(|widths_n| widths_n[k]));
        let band: [String; BAND_COLUMNS.len()] =
            [half_width(0), half_width(1), half_width(2), number(tick.drive_force_half_width_n)];
        let wire = wire.iter().filter(|_| has_guidewire);
        csv.write_record(row.iter().chain(wire).chain(band.iter().filter(|_| has_band)))?;
    }
    Ok(csv.flush()?)
}

/// The mode's name, or its code if it is unknown.
pub(crate) fn mode_name(tick: &TickEstimate) -> String {
    let mode = Mode::from_codes(tick.mode, tick.fault);
    mode.map_or_else(|| tick.mode.to_string(), |mode| mode.name().to_owned())
}

/// Writes one row for each node and shape; positions are from the entry, in the vessel frame.
pub fn write_nodes_csv(
    recording: &Recording,
    shapes: &[NodePass],
    out: impl io::Write,
) -> io::Result<()> {
    nodes_csv(recording, shapes, out).map_err(io_error)
}

fn nodes_csv(recording: &Recording, shapes: &[NodePass], out: impl io::Write) -> csv::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    csv.write_record(["t_s", "node", "x_m", "y_m", "z_m", "fx_n", "fy_n", "fz_n"])?;
    for shape in shapes {
        let t_s = format!("{:.6}", trial_time_s(recording, shape.at_ns));
        for node in &shape.nodes {
            let numbers = node.position_m.into_iter().chain(node.force_n).map(|x| x.to_string());
            let row = [t_s.clone(), node.node.to_string()].into_iter().chain(numbers);
            csv.write_record(row)?;
        }
    }
    Ok(csv.flush()?)
}
