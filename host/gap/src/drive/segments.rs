//! Candidates for the next recording of a drive.

use std::f64::consts::PI;

use super::effects::Scale;
use super::motion::{Filters, Motion};
use crate::plant::Segment;

/// Noise of a sample of a motion that has not been recorded, as a share of the command's RMS.
pub const NOISE_SHARE: f64 = 5e-3;

/// The canned motions.
pub const SEGMENTS: [Segment; 6] = [
    Segment { name: "slow-reversals", what: "back and forth at 2 % of the largest speed" },
    Segment {
        name: "three-speeds",
        what: "there and back at 10, 40 and 100 % of the largest speed",
    },
    Segment { name: "fast-reversals", what: "short strokes at full acceleration" },
    Segment { name: "small-strokes", what: "strokes of 0.2 % of the travel" },
    Segment { name: "long-slow-travel", what: "once over the whole travel at 20 % of the speed" },
    Segment { name: "sine-sweep", what: "a sine whose frequency rises from 0.2 to 5 Hz" },
];

/// Their positions over time, in the order of [`SEGMENTS`].
pub fn motions(scale: &Scale, filters: &Filters) -> Vec<Motion> {
    let (v, q) = (scale.speed_m_per_s, scale.travel_m);
    let shapes: [Box<dyn Fn(f64) -> f64>; 6] = [
        Box::new(move |t| triangle(t, 0.02 * v, 1.0)),
        Box::new(move |t| {
            let speed = [0.1, 0.4, 1.0][(t / 2.0) as usize % 3] * v;
            triangle(t % 2.0, speed, 1.0)
        }),
        Box::new(move |t| triangle(t, v, 0.25)),
        Box::new(move |t| 1e-3 * q * (2.0 * PI * t).sin()),
        Box::new(move |t| 0.2 * v * t.min(q / (0.2 * v))),
        Box::new(move |t| {
            let rate = 0.2 + 0.4 * t;
            v / (2.0 * PI * 5.0) * (2.0 * PI * rate * t).sin()
        }),
    ];
    let points = (SEGMENT_S / filters.grid_s) as usize;
    let play = |shape: &dyn Fn(f64) -> f64| {
        let raw: Vec<f64> = (0..points).map(|i| shape(i as f64 * filters.grid_s)).collect();
        // No axis changes its speed at once.
        let smooth = crate::signal::Gaussian::new(TURN_S / filters.grid_s).smooth(&raw);
        Motion::of(&smooth, filters)
    };
    shapes.iter().map(|shape| play(shape.as_ref())).collect()
}

/// Length of a segment \[s\].
const SEGMENT_S: f64 = 6.0;
/// Time in which a canned motion turns round \[s\].
const TURN_S: f64 = 0.02;

/// Back and forth at a constant speed; `half_s` each way.
fn triangle(t: f64, speed: f64, half_s: f64) -> f64 {
    let phase = t % (2.0 * half_s);
    speed * if phase < half_s { phase } else { 2.0 * half_s - phase }
}
