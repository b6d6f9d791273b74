//! Time stamps that tremble.
//!
//! A controller samples evenly, but what logs it may stamp a row when it arrives. By such stamps a position
//! at speed v that is δ late is off by v δ, and its acceleration by far more. Whether rows are even or
//! were taken when they say, the motion tells: it is smooth by the true times alone.

use super::noise::Noise;
use crate::data::clock::usual_step_s;

/// Rows count as even where the position's noise by even times is less than this share of that by their
/// stamps.
const SMOOTHER: f64 = 0.5;
/// Stamps that scatter by less than this share of a step do not matter.
const SCATTERED: f64 = 0.01;

/// Even times of rows whose stamps tremble, and by how much they do \[s\], root mean square; `None` where the
/// position is as smooth by the stamps.
pub fn evened(t_s: &[f64], position_m: &[f64]) -> Option<(Vec<f64>, f64)> {
    let n = t_s.len() as f64;
    let (middle, mean_s) = (0.5 * (n - 1.0), t_s.iter().sum::<f64>() / n);
    let (mut ii, mut it) = (0.0, 0.0);
    for (i, t) in t_s.iter().enumerate() {
        let from_middle = i as f64 - middle;
        ii += from_middle * from_middle;
        it += from_middle * (t - mean_s);
    }
    let even: Vec<f64> = (0..t_s.len()).map(|i| mean_s + (i as f64 - middle) * it / ii).collect();
    let squares: f64 = t_s.iter().zip(&even).map(|(t, e)| (t - e).powi(2)).sum();
    let scatter_s = (squares / n).sqrt();
    if scatter_s.is_nan() || scatter_s <= SCATTERED * usual_step_s(t_s) {
        return None;
    }
    let [by_even, by_stamps] = [&even[..], t_s].map(|times| Noise::of(times, position_m).most);
    (by_even < SMOOTHER * by_stamps).then_some((even, scatter_s))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::toy::noise;

    const STEP_S: f64 = 1e-3;

    fn true_times() -> Vec<f64> {
        (0..3000).map(|i| i as f64 * STEP_S).collect()
    }

    fn position_m(t_s: f64) -> f64 {
        0.1 * (4.0 * t_s).sin()
    }

    /// Late or early by up to 0.3 steps or so.
    fn trembling(t_s: &[f64]) -> Vec<f64> {
        t_s.iter().enumerate().map(|(i, t)| t + 0.15 * STEP_S * noise(i).clamp(-2.0, 2.0)).collect()
    }

    #[test]
    fn even_rows_with_trembling_stamps_are_even_again() {
        let t_s = true_times();
        let measured: Vec<f64> = t_s.iter().map(|t| position_m(*t)).collect();
        let (even, scatter_s) = evened(&trembling(&t_s), &measured).expect("smoother by far");
        let off = even.iter().zip(&t_s).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 0.05 * STEP_S, "{off}");
        assert!((0.05..0.3).contains(&(scatter_s / STEP_S)), "{scatter_s}");
        assert!(evened(&t_s, &measured).is_none());
    }

    #[test]
    fn rows_that_are_uneven_as_they_say_stay() {
        let t_s = trembling(&true_times());
        let measured: Vec<f64> = t_s.iter().map(|t| position_m(*t)).collect();
        assert!(evened(&t_s, &measured).is_none());
        // A row that was lost moves all that come after it.
        let mut lost = true_times();
        lost.remove(1500);
        let measured: Vec<f64> = lost.iter().map(|t| position_m(*t)).collect();
        assert!(evened(&lost, &measured).is_none());
    }
}
