//! The size of white noise.

use crate::hampel::median;

/// Median of |x| of a normal distribution, in standard deviations.
pub(crate) const MEDIAN: f64 = 0.6745;

/// Standard deviation of white noise under a slow signal, from the second differences, whose median a
/// few events do not move. 0 for fewer than three values.
pub fn white_noise(values: &[f64]) -> f64 {
    let second = |w: &[f64]| (w[0] - 2.0 * w[1] + w[2]).abs() / 6.0_f64.sqrt();
    let mut differences: Vec<f64> = values.windows(3).map(second).collect();
    if differences.is_empty() { 0.0 } else { median(&mut differences) / MEDIAN }
}
