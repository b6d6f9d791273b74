//! Exponential decay of a residual while the drive rests.

use super::residual::{FEWEST, Residual, TOLD, left_by_line, runs};

/// Shortest dwell in which anything decays \[s\].
const DWELL_S: f64 = 0.5;
/// Time constants that are tried \[s\].
const DECAY_S: [f64; 2] = [0.05, 10.0];
const DECAYS: usize = 40;
/// A straight line in every dwell leaves at least so many times what decays leave.
const BEYOND_A_LINE: f64 = 1.2;

/// The time constant of what decays in dwells; `None` where nothing does.
pub fn decay_s(own: &[Residual]) -> Option<f64> {
    let dwells: Vec<Vec<(f64, f64)>> = runs(own)
        .into_iter()
        .flat_map(|run| run.split(|residual| residual.direction() != 0.0))
        .filter(|dwell| dwell.len() >= FEWEST)
        .map(|dwell| dwell.iter().map(|r| (r.t_s - dwell[0].t_s, r.error)).collect::<Vec<_>>())
        .filter(|dwell| dwell[dwell.len() - 1].0 >= DWELL_S)
        .collect();
    let longest_s = dwells.iter().map(|dwell| dwell[dwell.len() - 1].0).reduce(f64::max)?;
    let left = |shape: &dyn Fn(f64) -> f64| -> f64 {
        dwells.iter().map(|dwell| left_by_line(dwell, shape)).sum()
    };
    let constant = left(&|_| 0.0);
    let line = left(&|t_s| t_s);
    // Slower than the longest dwell, it is a straight line.
    let last_s = DECAY_S[1].min(longest_s);
    let tau_s = |k: usize| DECAY_S[0] * (last_s / DECAY_S[0]).powf(k as f64 / (DECAYS - 1) as f64);
    let tried = (0..DECAYS).map(tau_s).map(|tau_s| (tau_s, left(&|t_s| (-t_s / tau_s).exp())));
    let (tau_s, decayed) = tried.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let is_told = decayed < (1.0 - TOLD) * constant && line > BEYOND_A_LINE * decayed;
    is_told.then_some(tau_s)
}
