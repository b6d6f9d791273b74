//! The device's estimates on the trial's time.

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
