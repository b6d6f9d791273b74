//! Oscillation of a residual at the frequencies of breathing and pulse.

use std::f64::consts::TAU;

use nalgebra::{Matrix2, Vector2};

use super::residual::{Residual, mean};

/// The band of breath and pulse \[Hz\].
const BAND_HZ: [f64; 2] = [0.2, 3.0];
/// Frequencies a cycle over the longest trial, when the strongest is looked for.
const PER_CYCLE: f64 = 4.0;
/// Cycles that a trial holds of the slowest.
const CYCLES: f64 = 2.0;

/// What swings.
#[derive(Clone, Copy, Debug)]
pub struct Band {
    pub share: f64,
    pub strongest_hz: f64,
    pub strongest_share: f64,
}

impl Band {
    /// `None` where trials are too short for the band.
    pub fn of(channel: &[Residual]) -> Option<Self> {
        let trials: Vec<Vec<(f64, f64)>> =
            channel.chunk_by(|a, b| a.trial == b.trial).map(straightened).collect();
        let span_s = |trial: &Vec<(f64, f64)>| trial[trial.len() - 1].0;
        let longest_s = trials.iter().map(span_s).reduce(f64::max)?;
        let samples = trials.iter().map(Vec::len).sum::<usize>() as f64;
        let all_s: f64 = trials.iter().map(span_s).sum();
        let low = BAND_HZ[0].max(CYCLES / longest_s);
        // Half of what the samples' mean distance in time carries.
        let high = BAND_HZ[1].min(0.5 * samples / all_s);
        let whole: f64 = trials.iter().flatten().map(|(_, e)| e * e).sum();
        if !(low < high && whole > 0.0) {
            return None;
        }
        let in_band = |trial: &Vec<(f64, f64)>| -> f64 {
            // Fourier's frequencies, which share the variance among them.
            let own = |hz: f64| (hz * span_s(trial)) as usize;
            let of = |k: usize| explained(trial, k as f64 / span_s(trial));
            (own(BAND_HZ[0]) + 1..=own(high)).map(of).sum()
        };
        let count = ((high - low) * longest_s * PER_CYCLE).ceil() as usize;
        let frequencies = (0..=count).map(|k| low + (high - low) * k as f64 / count as f64);
        let together =
            |hz: f64| (hz, trials.iter().map(|trial| explained(trial, hz)).sum::<f64>() / whole);
        let (strongest_hz, strongest_share) =
            frequencies.map(together).max_by(|a, b| a.1.total_cmp(&b.1))?;
        let share = (trials.iter().map(in_band).sum::<f64>() / whole).min(1.0);
        Some(Self { share, strongest_hz, strongest_share })
    }
}

/// Time since the first residual, and what a straight line leaves.
fn straightened(trial: &[Residual]) -> Vec<(f64, f64)> {
    let start_s = trial[0].t_s;
    let t = mean(trial.iter().map(|r| r.t_s));
    let e = mean(trial.iter().map(|r| r.error));
    let (mut tt, mut te) = (0.0, 0.0);
    for residual in trial {
        tt += (residual.t_s - t).powi(2);
        te += (residual.t_s - t) * (residual.error - e);
    }
    let slope = if tt > 0.0 { te / tt } else { 0.0 };
    trial.iter().map(|r| (r.t_s - start_s, r.error - e - slope * (r.t_s - t))).collect()
}

/// Sum of squares that a cosine and a sine of one frequency explain (Lomb 1976).
fn explained(series: &[(f64, f64)], hz: f64) -> f64 {
    let (mut normal, mut slope) = (Matrix2::zeros(), Vector2::zeros());
    for (t_s, error) in series {
        let (sine, cosine) = (TAU * hz * t_s).sin_cos();
        let row = Vector2::new(cosine, sine);
        normal += row * row.transpose();
        slope += row * *error;
    }
    normal.cholesky().map_or(0.0, |own| slope.dot(&own.solve(&slope)))
}
