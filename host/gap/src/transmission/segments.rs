//! Candidates for the next recording of a transmission.

use std::f64::consts::TAU;

use crate::plant::Segment;
use crate::signal::Gaussian;

/// Between two points \[s\], and points between two samples.
pub const GRID_S: f64 = 0.01;
pub const STRIDE: usize = 4;
/// Length of a segment, and time in which a canned motion turns round \[s\].
const SEGMENT_S: f64 = 24.0;
const TURN_S: f64 = 0.05;

/// The canned motions.
pub const SEGMENTS: [Segment; 4] = [
    Segment { name: "large-strokes", what: "to and fro over the whole travel, slowly" },
    Segment {
        name: "nested-strokes",
        what: "strokes of 80, 40, 20, 10 and 5 % of the travel, each turned round within the last",
    },
    Segment { name: "two-rates", what: "the same stroke slowly, and ten times as fast" },
    Segment {
        name: "stairs",
        what: "steps of 5 % of the travel up and down, with a rest after each",
    },
];

/// Their inputs over time, in the order of [`SEGMENTS`].
pub fn inputs([low, high]: [f64; 2]) -> Vec<Vec<f64>> {
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let shapes: [&dyn Fn(f64) -> f64; 4] = [
        &|t| triangle(t / 12.0),
        &|t| {
            let sizes = [0.8, 0.4, 0.2, 0.1, 0.05];
            sizes[((t / SEGMENT_S * 5.0) as usize).min(4)] * triangle(t / (SEGMENT_S / 10.0))
        },
        &|t| if t < 0.6 * SEGMENT_S { (TAU * t / 7.2).sin() } else { (TAU * t / 0.72).sin() },
        &|t| {
            let step = ((t / 0.6).floor() as i64).rem_euclid(40);
            -1.0 + 0.1 * step.min(40 - step) as f64
        },
    ];
    let points = (SEGMENT_S / GRID_S) as usize;
    let smooth = Gaussian::new(TURN_S / GRID_S);
    let play = |shape: &&dyn Fn(f64) -> f64| {
        let raw: Vec<f64> = (0..points).map(|i| middle + half * shape(i as f64 * GRID_S)).collect();
        smooth.smooth(&raw)
    };
    shapes.iter().map(play).collect()
}

/// From 0 to 1, to −1 and back to 0 within a period of 1.
fn triangle(periods: f64) -> f64 {
    let x = (periods + 0.25).rem_euclid(1.0);
    1.0 - 4.0 * (x - 0.5).abs()
}
