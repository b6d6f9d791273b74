//! Arrays of the page: packed, little endian, in base64.

use base64::{Engine, engine::general_purpose::STANDARD};
use cathforce_recording::{Analysis, GuidewireEstimate, Recording, Trial, estimates, trial_time_s};
use serde_json::{Value, json};

use super::surface::Surface;

/// Most points of a line; more cannot be seen.
pub const MOST_POINTS: usize = 6000;

fn pack<const N: usize>(bytes: impl Iterator<Item = [u8; N]>) -> Value {
    json!(STANDARD.encode(bytes.flatten().collect::<Vec<u8>>()))
}

pub fn floats(values: impl Iterator<Item = f64>) -> Value {
    pack(values.map(|x| (x as f32).to_le_bytes()))
}

/// Time \[s\]; fx, fy, fz, drive \[mN\], insertion \[mm\], rotation \[°\]; with a guidewire its
/// drive \[mN\], insertion \[mm\], rotation \[°\]. NaN where unknown.
pub fn estimated(recording: &Recording, analysis: &Analysis) -> Value {
    let ticks = &analysis.track.ticks;
    let shown = ticks.iter().filter(|tick| trial_time_s(recording, tick.at_ns) >= 0.0);
    let shown = shown.collect::<Vec<_>>();
    let shown = || shown.iter().step_by(shown.len().div_ceil(MOST_POINTS).max(1));
    let force = |k: usize| {
        let axis = move |f: Option<[f32; 3]>| f.map_or(f64::NAN, |f| 1e3 * f64::from(f[k]));
        floats(shown().map(move |tick| axis(tick.force_n)))
    };
    let scaled = |x: Option<f32>, scale: f64| x.map_or(f64::NAN, |x| scale * f64::from(x));
    let degrees = 180.0 / std::f64::consts::PI;
    let mut y = vec![
        force(0),
        force(1),
        force(2),
        floats(shown().map(|tick| scaled(tick.drive_force_n, 1e3))),
        floats(shown().map(|tick| scaled(tick.insertion_m, 1e3))),
        floats(shown().map(|tick| scaled(tick.rotation_rad, degrees))),
    ];
    if analysis.guidewire_radius_m.is_some() {
        let wire = |value: fn(GuidewireEstimate) -> Option<f32>, scale| {
            floats(shown().map(move |tick| scaled(tick.guidewire.and_then(value), scale)))
        };
        y.push(wire(|wire| wire.drive_force_n, 1e3));
        y.push(wire(|wire| Some(wire.insertion_m), 1e3));
        y.push(wire(|wire| Some(wire.rotation_rad), degrees));
    }
    json!({ "t": floats(shown().map(|tick| trial_time_s(recording, tick.at_ns))), "y": y })
}

/// Time \[s\]; channels as of [`estimated`], null where nothing measures them; drive forces are
/// NaN where there is none. Null without rows.
pub fn measured(trial: &Trial) -> Value {
    if trial.rows.is_empty() {
        return Value::Null;
    }
    let rows = || trial.rows.iter().step_by(trial.rows.len().div_ceil(MOST_POINTS));
    let force = |k: usize| floats(rows().map(move |r| r.force_n.map_or(f64::NAN, |f| 1e3 * f[k])));
    let drive = floats(rows().map(|r| r.drive_force_n.map_or(f64::NAN, |f| 1e3 * f)));
    let wire = rows().map(|r| r.guidewire.and_then(|wire| wire.drive_force_n));
    let wire = floats(wire.map(|f| f.map_or(f64::NAN, |f| 1e3 * f)));
    json!({
        "t": floats(rows().map(|r| r.t_s)),
        "y": [force(0), force(1), force(2), drive, null, null, wire],
    })
}

/// Norm of (estimated − measured) \[mN\] at the rows with a force and an estimate.
pub fn error(recording: &Recording, analysis: &Analysis) -> Value {
    let estimates = estimates(recording, &analysis.track, analysis.entry_m);
    let points = recording.trial.rows.iter().filter_map(|row| {
        let after = estimates.partition_point(|e| e.t_s < row.t_s - 1e-9);
        let estimate = estimates.get(after).filter(|e| e.t_s - row.t_s < 2e-3)?;
        let measured = row.force_n?;
        let square = |k: usize| (estimate.force_n[k] - measured[k]).powi(2);
        Some((row.t_s, 1e3 * (square(0) + square(1) + square(2)).sqrt()))
    });
    let points = points.collect::<Vec<_>>();
    json!({
        "t": floats(points.iter().map(|(t_s, _)| *t_s)),
        "y": floats(points.iter().map(|(_, error_mn)| *error_mn)),
    })
}

/// From, to, and whether it is a snap \[s\].
pub fn unscored(analysis: &Analysis) -> Value {
    let Some(c) = &analysis.comparison else { return json!([]) };
    let last_s = c.scored_from_s.min(1e6);
    let mut bands = vec![json!([0.0, last_s, false])];
    bands.extend(c.snaps.iter().map(|pair| {
        let [from, to] = pair.measured.span_s;
        let guard_s = cathforce_recording::SNAP_GUARD_S;
        json!([from - guard_s, to + guard_s, true])
    }));
    json!(bands)
}

/// All shapes of the trial: time, nodes, positions from the entry in 20 µm, forces in 0.1 mN;
/// with a guidewire how far it is ahead of the catheter, in nodes.
pub fn shapes(recording: &Recording, analysis: &Analysis) -> Value {
    let shapes = analysis.track.shapes.iter();
    let shapes = shapes.filter(|shape| trial_time_s(recording, shape.at_ns) >= 0.0);
    let shapes = shapes.collect::<Vec<_>>();
    let nodes = || shapes.iter().flat_map(|shape| &shape.nodes);
    let norm_mn = |f: [f32; 3]| 1e3 * f.iter().map(|x| x * x).sum::<f32>().sqrt();
    let mut forces = nodes().map(|node| norm_mn(node.force_n)).collect::<Vec<_>>();
    // The scale ends where nearly all of the loaded nodes are; snaps may go beyond.
    forces.retain(|f| *f > 0.5);
    forces.sort_by(f32::total_cmp);
    let full = forces.get(forces.len().saturating_sub(1) * 995 / 1000).copied().unwrap_or(0.0);
    let position = |x: f32| ((x / 20e-6).round() as i16).to_le_bytes();
    json!({
        "t": floats(shapes.iter().map(|shape| trial_time_s(recording, shape.at_ns))),
        "count": pack(shapes.iter().map(|shape| (shape.nodes.len() as u16).to_le_bytes())),
        "position": pack(nodes().flat_map(|node| node.position_m.map(position))),
        "force": pack(nodes().map(|node| ((norm_mn(node.force_n) * 10.0) as u16).to_le_bytes())),
        "full_scale_mn": f64::from(full).max(5.0),
        "entry_mm": analysis.entry_m.map(|x| 1e3 * x),
        "radius_mm": 1e3 * analysis.radius_m,
        "guidewire_radius_mm": analysis.guidewire_radius_m.map(|radius_m| 1e3 * radius_m),
        "bare": analysis.guidewire_radius_m.map(|_| {
            let ahead_m = |at_ns| ahead_m(analysis, at_ns) as f32;
            let links = |at_ns| f64::from(analysis.solver.links_in(ahead_m(at_ns)));
            floats(shapes.iter().map(|shape| links(shape.at_ns)))
        }),
    })
}

/// Length of guidewire ahead of the catheter's tip at a time of the bus \[m\].
fn ahead_m(analysis: &Analysis, at_ns: u64) -> f64 {
    let ticks = &analysis.track.ticks;
    let tick = ticks.get(ticks.partition_point(|tick| tick.at_ns < at_ns));
    let drives = tick.and_then(|tick| tick.guidewire.zip(tick.insertion_m));
    drives.map_or(0.0, |(wire, catheter_m)| f64::from(wire.insertion_m - catheter_m)).max(0.0)
}

/// Vertices from the entry in 20 µm, normals × 127, triangles.
pub fn vessel(surface: &Surface, entry_m: [f64; 3]) -> Value {
    let vertex = |x: f64| ((x / 20e-6).round() as i16).to_le_bytes();
    let vertices = surface
        .vertices
        .iter()
        .flat_map(|v| std::array::from_fn::<_, 3, _>(|k| vertex(f64::from(v[k]) - entry_m[k])));
    let normal = |x: f32| ((x * 127.0) as i8).to_le_bytes();
    json!({
        "vertices": pack(vertices),
        "normals": pack(surface.normals.iter().flat_map(|n| n.map(normal))),
        "indices": pack(surface.triangles.iter().flatten().map(|i| i.to_le_bytes())),
    })
}
