//! Time series on a uniform grid: smoothing, slopes, interpolation; angles from −π to π.

use std::f64::consts::{PI, TAU};

/// Gaussian smoothing and its first two derivatives on a uniform grid.
///
/// The kernels sum to exactly 1, and their moments are exactly those of a derivative, so a
/// constant has no slope and a straight line no curvature.
#[derive(Clone, Debug)]
pub struct Gaussian {
    /// Index `reach` is the centre.
    weights: Vec<f64>,
    reach: usize,
}

impl Gaussian {
    /// `sd`: standard deviation in samples. Cut at four of them.
    pub fn new(sd: f64) -> Self {
        Self::centred(sd, 0.0)
    }

    /// The same of what lies `by` samples later, at most half a sample.
    pub fn centred(sd: f64, by: f64) -> Self {
        let reach = (4.0 * sd).ceil().max(1.0) as usize;
        let offset = |i: usize| i as f64 - reach as f64 - by;
        let bell = |x: f64| (-0.5 * (x / sd).powi(2)).exp();
        let mut weights: Vec<f64> = (0..=2 * reach).map(|i| bell(offset(i))).collect();
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= sum);
        Self { weights, reach }
    }

    /// The smoothed value at sample `at`; beyond the ends the series is held.
    pub fn at(&self, series: &[f64], at: usize) -> f64 {
        if let Some(from) = at.checked_sub(self.reach)
            && let Some(around) = series.get(from..from + self.weights.len())
        {
            return self.weights.iter().zip(around).map(|(w, x)| w * x).sum();
        }
        let last = series.len().saturating_sub(1);
        let index = |i: usize| (at + i).saturating_sub(self.reach).min(last);
        self.weights.iter().enumerate().map(|(i, w)| w * series[index(i)]).sum()
    }

    /// The whole series, smoothed: weight by weight over a piece of it, in which the processor adds several
    /// samples at once. Each sample's sum has the order of [`Gaussian::at`], and so its bits.
    pub fn smooth(&self, series: &[f64]) -> Vec<f64> {
        /// Samples of a piece, which stay in the processor's nearest cache.
        const PIECE: usize = 1024;

        let (reach, count) = (self.reach, series.len());
        let inner = reach.min(count)..count.saturating_sub(reach).max(reach.min(count));
        // What a sum of numbers begins with.
        let mut smooth = vec![-0.0; count];
        for i in (0..inner.start).chain(inner.end..count) {
            smooth[i] = self.at(series, i);
        }
        let mut from = inner.start;
        for piece in smooth[inner].chunks_mut(PIECE) {
            for (k, w) in self.weights.iter().enumerate() {
                let moved = &series[from + k - reach..];
                piece.iter_mut().zip(moved).for_each(|(sum, x)| *sum += w * x);
            }
            from += piece.len();
        }
        smooth
    }

    /// Samples at either end that the held ends reach.
    pub fn reach(&self) -> usize {
        self.reach
    }
}

/// The same angle from −π to π.
pub fn wrapped(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}

/// Central differences, one-sided at the ends.
pub fn slope(series: &[f64], dt_s: f64) -> Vec<f64> {
    let last = series.len().saturating_sub(1);
    let at = |i: usize| {
        let (low, high) = (i.saturating_sub(1), (i + 1).min(last));
        (series[high] - series[low]) / ((high - low).max(1) as f64 * dt_s)
    };
    (0..series.len()).map(at).collect()
}

/// Linear interpolation on a uniform grid that begins at 0; held beyond its ends.
pub fn interpolate(series: &[f64], index: f64) -> f64 {
    interpolate_by(&|i| series[i], series.len(), index)
}

/// The same of a series of so many values that `at` gives one by one.
pub fn interpolate_by(at: &dyn Fn(usize) -> f64, len: usize, index: f64) -> f64 {
    let last = len.saturating_sub(1);
    let index = index.clamp(0.0, last as f64);
    let low = index.floor() as usize;
    let high = (low + 1).min(last);
    at(low) + (index - low as f64) * (at(high) - at(low))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smoothing_keeps_lines_and_narrows_noise() {
        let gaussian = Gaussian::new(3.0);
        let line: Vec<f64> = (0..200).map(|i| 2.0 + 0.5 * f64::from(i)).collect();
        let smooth = gaussian.smooth(&line);
        for i in gaussian.reach()..200 - gaussian.reach() {
            assert!((smooth[i] - line[i]).abs() < 1e-9);
        }
        let slopes = slope(&smooth, 0.5);
        assert!((slopes[100] - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_series_is_smoothed_to_the_bits_of_its_samples() {
        for (count, sd) in [(5000, 3.0), (1024 + 24, 3.0), (20, 3.0), (1, 2.0), (0, 1.0)] {
            let series: Vec<f64> = (0..count).map(crate::toy::noise).collect();
            let gaussian = Gaussian::new(sd);
            let one_by_one: Vec<f64> = (0..count).map(|i| gaussian.at(&series, i)).collect();
            assert_eq!(gaussian.smooth(&series), one_by_one, "{count}");
        }
    }

    #[test]
    fn interpolation_holds_the_ends() {
        assert_eq!(interpolate(&[1.0, 3.0], -1.0), 1.0);
        assert_eq!(interpolate(&[1.0, 3.0], 0.25), 1.5);
        assert_eq!(interpolate(&[1.0, 3.0], 7.0), 3.0);
    }
}
