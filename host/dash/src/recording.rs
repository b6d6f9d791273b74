//! A recording as a source: everything that its views draw, in one answer.

use base64::{Engine as _, engine::general_purpose::STANDARD};
use cathforce_config::image;
use cathforce_control::{Fault, Mode};
use cathforce_recording::latency::stages;
use cathforce_recording::{Analysis, Recording, Summary, TickEstimate, trial_time_s};
use serde_json::{Value, json};

/// Most points of a line: more than any screen has, and all ticks of a minute. Of the ticks of a longer
/// recording that share a point, the one with the largest force is drawn.
const MOST_POINTS: usize = 60_000;

/// What the views draw. Arrays are little endian `f32` in base64, NaN where nothing is known.
pub fn data(recording: &Recording, analysis: &Analysis) -> Value {
    let ticks = drawn(&analysis.track.ticks);
    let at = |tick: &TickEstimate| trial_time_s(recording, tick.at_ns);
    let column = |value: &dyn Fn(&TickEstimate) -> Option<f32>| {
        floats(ticks.iter().map(|tick| value(tick).unwrap_or(f32::NAN)))
    };
    let force = |k: usize| column(&move |tick| tick.force_n.map(|force_n| force_n[k]));
    let width = |k: usize| column(&move |tick| stated(tick, tick.force_half_width_n.map(|w| w[k])));
    let rows = &recording.trial.rows;
    let measured =
        |k: usize| floats(rows.iter().map(|row| row.force_n.map_or(f32::NAN, |f| f[k] as f32)));
    let summary = Summary::of(recording, analysis);
    let stages = stages(
        &recording.frames,
        &recording.arrived_ns,
        &recording.logged_ns,
        recording.info.lock_step,
        recording.master(),
    );
    json!({
        "title": format!("{} · trial {}", recording.info.rig, recording.info.trial),
        "provenance": recording.info.provenance,
        "complete": recording.completeness(),
        "lock_step": recording.info.lock_step,
        "rows": summary.rows(),
        "t_s": floats(ticks.iter().map(|tick| at(tick) as f32)),
        "tick": ticks.iter().map(|tick| tick.tick).collect::<Vec<_>>(),
        "mode": ticks.iter().map(|tick| tick.mode).collect::<Vec<_>>(),
        "modes": (0..=7).map(mode_name).collect::<Vec<_>>(),
        "forces": [
            force(0),
            force(1),
            force(2),
            column(&|tick| tick.drive_force_n),
            column(&|tick| tick.drive_torque_n_m),
        ],
        "bands": [width(0), width(1), width(2), column(&|tick| stated(tick, tick.drive_force_half_width_n))],
        "insertion_m": column(&|tick| tick.insertion_m),
        "rotation_rad": column(&|tick| tick.rotation_rad),
        "age_ticks": column(&|tick| tick.encoder_age_ticks.map(f32::from)),
        "measured": {
            "t_s": floats(rows.iter().map(|row| row.t_s as f32)),
            "forces": [
                measured(0),
                measured(1),
                measured(2),
                floats(rows.iter().map(|row| row.drive_force_n.map_or(f32::NAN, |f| f as f32))),
            ],
        },
        "shape": shapes(recording, analysis),
        "faults": faults(recording, &analysis.track.ticks),
        "dropouts": recording.dropouts.iter().map(|lost| json!({
            "cause": lost.cause.to_string(),
            "frames": lost.frames,
            "t_s": trial_time_s(recording, lost.from_ns),
        })).collect::<Vec<_>>(),
        "stages": stages.iter().map(|stage| json!({
            "name": stage.name,
            "what": stage.what,
            "p50_ms": 1e3 * stage.times.p50_s,
            "p99_ms": 1e3 * stage.times.p99_s,
            "max_ms": 1e3 * stage.times.max_s,
        })).collect::<Vec<_>>(),
        "result": recording.result.map(|result| json!({
            "missed_ticks": result.missed_ticks,
            "worst_instructions": result.worst_instructions,
            "worst_tick": result.worst_tick,
            "stack_used_bytes": result.stack_used_bytes,
        })),
    })
}

/// What `GET /api/state` says of a recording: its last tick.
pub fn state(analysis: &Analysis) -> Value {
    let last = analysis.track.ticks.last();
    let force = analysis.track.ticks.iter().rev().find_map(|tick| tick.force_n);
    let axis = |k: usize| force.map(|force_n| force_n[k]);
    let drive = analysis.track.ticks.iter().rev().find_map(|tick| tick.drive_force_n);
    json!({
        "source": "recording",
        "mode": last.map(|tick| mode_name(tick.mode)),
        "tick": last.map(|tick| tick.tick),
        "age_ms": null,
        "forces": {
            "fx_N": axis(0),
            "fy_N": axis(1),
            "fz_N": axis(2),
            "norm_N": force.map(|f| f.iter().map(|x| x * x).sum::<f32>().sqrt()),
            "drive_fx_N": drive,
        },
    })
}

/// The vessel of a device image, and the radii of the instruments.
pub fn scene(image: &[u8]) -> Result<Value, String> {
    let config = image::decode(image).map_err(|error| error.to_string())?;
    let description = config.model.description();
    let entry_m = description.entry.position_m.map(f64::from);
    Ok(json!({
        "vessel": cathforce_pages::vessel_data(&config.lumen, entry_m),
        "radius_mm": 1e3 * description.instrument.outer_radius_m,
        "guidewire_radius_mm": description.guidewire.as_ref().map(|wire| 1e3 * wire.outer_radius_m),
    }))
}

/// A half width; below 0 where the device said that it knows none, nothing where it said nothing.
fn stated(tick: &TickEstimate, width_n: Option<f32>) -> Option<f32> {
    tick.has_band.then(|| width_n.unwrap_or(-1.0))
}

fn drawn(ticks: &[TickEstimate]) -> Vec<TickEstimate> {
    let size = |tick: &TickEstimate| {
        tick.force_n.map_or(-1.0, |force_n| force_n.iter().map(|x| x * x).sum::<f32>())
    };
    let share = ticks.len().div_ceil(MOST_POINTS).max(1);
    let largest =
        |part: &[TickEstimate]| part.iter().copied().max_by(|a, b| size(a).total_cmp(&size(b)));
    ticks.chunks(share).filter_map(largest).collect()
}

fn mode_name(code: u8) -> &'static str {
    let fault = if code == 6 { Fault::EncoderLost.code() } else { 0 };
    Mode::from_codes(code, fault).map_or("not configured", Mode::name)
}

/// All shapes: time, number of nodes, positions from the entry in 20 µm, forces on the vessel in 0.1 mN.
fn shapes(recording: &Recording, analysis: &Analysis) -> Value {
    let shapes = &analysis.track.shapes;
    let nodes = || shapes.iter().flat_map(|shape| &shape.nodes);
    // A float that does not fit becomes the nearest number that does.
    let code = |x: f32, unit: f32| ((x / unit).round() as i16).to_le_bytes();
    let pack = |bytes: Vec<u8>| json!(STANDARD.encode(bytes));
    json!({
        "t_s": floats(shapes.iter().map(|shape| trial_time_s(recording, shape.at_ns) as f32)),
        "count": pack(shapes.iter().flat_map(|s| (s.nodes.len() as u16).to_le_bytes()).collect()),
        "position": pack(nodes().flat_map(|n| n.position_m).flat_map(|x| code(x, 20e-6)).collect()),
        "force": pack(nodes().flat_map(|n| n.force_n).flat_map(|x| code(x, 1e-4)).collect()),
    })
}

/// Each fault that the device had: first, last, how often it began.
fn faults(recording: &Recording, ticks: &[TickEstimate]) -> Value {
    let mut seen: Vec<(Fault, f64, f64, u32)> = Vec::new();
    let mut before = None;
    for tick in ticks {
        let now = Mode::from_codes(tick.mode, tick.fault).and_then(Mode::fault);
        if let Some(fault) = now {
            let t_s = trial_time_s(recording, tick.at_ns);
            match seen.iter_mut().find(|(known, ..)| *known == fault) {
                Some((_, _, last_s, count)) => {
                    *last_s = t_s;
                    *count += u32::from(before != now);
                }
                None => seen.push((fault, t_s, t_s, 1)),
            }
        }
        before = now;
    }
    let fault = |(fault, first_s, last_s, count): &(Fault, f64, f64, u32)| {
        json!({
            "name": fault.name(),
            "code": fault.code(),
            "cause": fault.cause(),
            "next": fault.next_step(),
            "first_s": first_s,
            "last_s": last_s,
            "count": count,
        })
    };
    seen.iter().map(fault).collect()
}

fn floats(values: impl Iterator<Item = f32>) -> Value {
    json!(STANDARD.encode(values.flat_map(f32::to_le_bytes).collect::<Vec<u8>>()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A peak of one tick in ten minutes is drawn.
    #[test]
    fn a_peak_of_one_tick_is_drawn_of_a_long_recording() {
        let tick = |i: u64| TickEstimate {
            tick: i,
            force_n: Some(if i == 123_457 { [3.0, 0.0, 0.0] } else { [0.1, 0.0, 0.0] }),
            ..TickEstimate::default()
        };
        let ticks = (0..600_000).map(tick).collect::<Vec<_>>();
        let drawn = drawn(&ticks);
        assert_eq!(drawn.len(), MOST_POINTS);
        assert!(drawn.iter().any(|tick| tick.tick == 123_457));
        assert!(drawn.windows(2).all(|pair| pair[0].tick < pair[1].tick));
    }

    #[test]
    fn every_mode_has_its_name() {
        let names = (0..=7).map(mode_name).collect::<Vec<_>>();
        assert_eq!(names[4..], ["armed", "ramp", "fault", "not configured"]);
    }
}
