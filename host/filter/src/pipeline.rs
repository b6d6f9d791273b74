//! The steps in their order, on one column.

use serde::Serialize;

use crate::average::{moving_average, trailing_average};
use crate::clock::{Clock, ClockError};
use crate::denoise::{denoise, denoise_causally};
use crate::hampel::{hampel, trailing_hampel};
use crate::noise::white_noise;
use crate::wavelet::Family;

/// Details that are slower than this stay untouched \[Hz\]: a tip that comes off a wall or a wall that
/// gives way takes a tenth of a second or so.
const SLOWEST_DETAIL_HZ: f64 = 20.0;
/// Levels at most: at 1 kHz, details down to 16 Hz.
const MOST_LEVELS: usize = 5;

/// What is done to a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pipeline {
    /// Rows of the window in which outliers are looked for; 0 leaves them.
    pub outlier_rows: usize,
    /// Standard deviations from which on a value is an outlier.
    pub outlier_sd: f64,
    /// `None` for no wavelet. The causal form knows Haar's only.
    pub wavelet: Option<Family>,
    /// `None` for as many as the rate allows.
    pub levels: Option<usize>,
    /// Length of the moving average \[s\]; 0 for none.
    pub average_s: f64,
    /// Looks back only.
    pub causal: bool,
    pub split_at_gaps: bool,
}

impl Default for Pipeline {
    /// Windows of 11 rows, three standard deviations, [`Family::Sym4`], 20 ms: the time over which
    /// `cathforce gap diagnose` averages forces, too.
    fn default() -> Self {
        Self {
            outlier_rows: 11,
            outlier_sd: 3.0,
            wavelet: Some(Family::Sym4),
            levels: None,
            average_s: 0.02,
            causal: false,
            split_at_gaps: false,
        }
    }
}

/// A filtered column.
#[derive(Clone, Debug, PartialEq)]
pub struct Filtered {
    pub values: Vec<f64>,
    pub done: Done,
}

/// What was done to a column; figures of noise are in its unit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Done {
    pub values: usize,
    pub rate_hz: f64,
    /// Stretches that gaps divide it into, each filtered on its own.
    pub stretches: usize,
    pub outliers_replaced: usize,
    pub wavelet: Option<Family>,
    pub levels: usize,
    /// Rows of the moving average; 1 for none.
    pub average_rows: usize,
    /// Standard deviation of white noise under a slow signal, before and after.
    pub noise_before: f64,
    pub noise_after: f64,
    /// Root mean square of what wavelet and average took away.
    pub removed_rms: f64,
    /// By which everything is late \[s\]: the moving average of a causal pipeline.
    pub delay_s: f64,
    /// By which what the wavelet smooths is late at most, and an outlier's row with it \[s\].
    pub delay_at_most_s: f64,
}

impl Pipeline {
    /// Filters the values of one column, each at its time \[s\].
    pub fn apply(&self, t_s: &[f64], values: &[f64]) -> Result<Filtered, ClockError> {
        let clock = Clock::of(t_s, self.split_at_gaps)?;
        let rate_hz = 1.0 / clock.step_s;
        let levels = if self.wavelet.is_some() { self.levels(rate_hz) } else { 0 };
        let average_rows = self.average_rows(rate_hz);
        let mut filtered = Vec::with_capacity(values.len());
        let (mut outliers, mut removed) = (0, 0.0);
        for stretch in &clock.stretches {
            let (clean, replaced) = self.without_outliers(&values[stretch.clone()]);
            let smooth = self.smooth(&clean, levels, average_rows);
            outliers += replaced;
            removed += clean.iter().zip(&smooth).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            filtered.extend(smooth);
        }
        let rows_late = |rows: usize| if self.causal { 0.5 * (rows as f64 - 1.0) } else { 0.0 };
        let delay_s = clock.step_s * rows_late(average_rows);
        // A jump passes the outlier's window when it fills half of it.
        let outlier_rows = if self.causal { self.outlier_rows as f64 / 2.0 } else { 0.0 };
        let at_most = clock.step_s * (rows_late(1 << levels) + outlier_rows.floor());
        let done = Done {
            values: values.len(),
            rate_hz,
            stretches: clock.stretches.len(),
            outliers_replaced: outliers,
            wavelet: self.wavelet.map(|own| if self.causal { Family::Haar } else { own }),
            levels,
            average_rows,
            noise_before: white_noise(values),
            noise_after: white_noise(&filtered),
            removed_rms: (removed / values.len() as f64).sqrt(),
            delay_s,
            delay_at_most_s: delay_s + at_most,
        };
        Ok(Filtered { values: filtered, done })
    }

    fn without_outliers(&self, values: &[f64]) -> (Vec<f64>, usize) {
        let find = if self.causal { trailing_hampel } else { hampel };
        let found = find(values, self.outlier_rows, self.outlier_sd);
        match self.outlier_rows {
            0 => (values.to_vec(), 0),
            _ => (found.values, found.rows.len()),
        }
    }

    fn smooth(&self, values: &[f64], levels: usize, average_rows: usize) -> Vec<f64> {
        match (self.causal, self.wavelet) {
            (true, _) => trailing_average(&denoise_causally(values, levels), average_rows),
            (false, Some(family)) => moving_average(&denoise(values, family, levels), average_rows),
            (false, None) => moving_average(values, average_rows),
        }
    }

    /// Levels whose details are faster than [`SLOWEST_DETAIL_HZ`]; one at least.
    fn levels(&self, rate_hz: f64) -> usize {
        let levels = (rate_hz / SLOWEST_DETAIL_HZ).log2().floor();
        self.levels.unwrap_or(levels.clamp(1.0, MOST_LEVELS as f64) as usize)
    }

    /// Rows of the moving average: of one that looks at both sides an odd number.
    fn average_rows(&self, rate_hz: f64) -> usize {
        let rows = (self.average_s * rate_hz).round().max(1.0) as usize;
        if self.causal { rows } else { 2 * (rows / 2) + 1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 1000.0;

    fn times(count: usize) -> Vec<f64> {
        (0..count).map(|i| i as f64 / RATE_HZ).collect()
    }

    /// A wave of 1 N and 1 Hz with an overtone of the sensor and some spikes.
    fn measured(count: usize) -> (Vec<f64>, Vec<f64>) {
        let wave: Vec<f64> =
            times(count).iter().map(|t| (std::f64::consts::TAU * t).sin()).collect();
        let buzz = |i: usize| 0.02 * ((i * i * 7919 + i * 104_729) % 1009) as f64 / 504.0 - 0.02;
        let mut measured: Vec<f64> = wave.iter().enumerate().map(|(i, w)| w + buzz(i)).collect();
        (0..count).step_by(97).for_each(|i| measured[i] += 3.0);
        (wave, measured)
    }

    fn worst(found: &[f64], truth: &[f64]) -> f64 {
        found.iter().zip(truth).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn spikes_and_noise_go_and_the_signal_stays() {
        let (wave, measured) = measured(3000);
        let Filtered { values, done } = Pipeline::default().apply(&times(3000), &measured).unwrap();
        assert!(worst(&values[20..2980], &wave[20..2980]) < 0.02);
        assert!(done.outliers_replaced >= 31, "{done:?}");
        assert_eq!((done.levels, done.average_rows, done.stretches), (5, 21, 1));
        assert!(done.noise_after < 0.2 * done.noise_before, "{done:?}");
        assert_eq!((done.delay_s, done.delay_at_most_s), (0.0, 0.0));
    }

    #[test]
    fn the_causal_form_is_late_by_what_it_says() {
        let (wave, measured) = measured(3000);
        let pipeline = Pipeline { causal: true, ..Pipeline::default() };
        let Filtered { values, done } = pipeline.apply(&times(3000), &measured).unwrap();
        // 20 rows of average, 31 of the wavelet, 5 of the window.
        assert!((done.delay_s - 9.5e-3).abs() < 1e-9, "{done:?}");
        assert!((done.delay_at_most_s - (9.5e-3 + 15.5e-3 + 5e-3)).abs() < 1e-9, "{done:?}");
        assert_eq!(done.wavelet, Some(Family::Haar));
        // The lag with the least error lies between both.
        let error = |lag: usize| worst(&values[600..2000], &wave[600 - lag..2000 - lag]);
        let lag = (0..60).min_by(|&a, &b| error(a).total_cmp(&error(b))).unwrap();
        assert!((9..=31).contains(&lag), "{lag}");
    }

    #[test]
    fn each_step_can_be_left_out() {
        let (_, measured) = measured(500);
        let none =
            Pipeline { outlier_rows: 0, wavelet: None, average_s: 0.0, ..Pipeline::default() };
        for causal in [false, true] {
            let found = Pipeline { causal, ..none }.apply(&times(500), &measured).unwrap();
            assert!(worst(&found.values, &measured) < 1e-12);
            assert_eq!((found.done.outliers_replaced, found.done.levels), (0, 0));
            assert_eq!(found.done.delay_s, 0.0);
        }
    }

    #[test]
    fn stretches_know_nothing_of_each_other() {
        let (_, measured) = measured(400);
        let mut t_s = times(400);
        t_s[200..].iter_mut().for_each(|t| *t += 1.0);
        let pipeline = Pipeline { split_at_gaps: true, ..Pipeline::default() };
        let both = pipeline.apply(&t_s, &measured).unwrap();
        let first = pipeline.apply(&t_s[..200], &measured[..200]).unwrap();
        assert_eq!(both.values[..200], first.values);
        assert_eq!(both.done.stretches, 2);
        assert!(Pipeline::default().apply(&t_s, &measured).is_err());
    }
}
