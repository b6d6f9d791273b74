//! The noise of a sample, which is a mean over rows.
//!
//! An amplifier's filter makes the noise of neighbouring rows alike. Their scatter then says too little about the
//! noise of their mean. Means that lie two apart share next to nothing of a filter that is shorter than a mean, so
//! that their scatter tells it.

use std::f64::consts::PI;

use super::super::column::{AVERAGE_S, Column};
use crate::rules::Rules;

/// Means from one that is compared to the next, and the longest time over which they are compared \[s\].
const OF_MEANS: (usize, f64) = (2, 6.0 * AVERAGE_S);
/// The same of a camera's frames, which no filter connects: of ten a second or more.
const OF_FRAMES: (usize, f64) = (1, 0.25);
/// Fewest differences. The median of n absolute values has a relative standard deviation of 1.17/√n, here 15 %.
const FEWEST: usize = 60;
/// Standard deviation of a normal distribution over the median of its absolute values.
const OF_MEDIAN: f64 = 1.4826;
/// A sensor with steps has so many rows for each of its readings.
const ROWS_A_READING: usize = 4;

/// One sample.
#[derive(Clone, Copy, Debug)]
pub struct Mean {
    /// The middle of its time.
    pub t_s: f64,
    pub value: f64,
    pub rows: usize,
}

/// The noise of the samples of one column.
#[derive(Clone, Copy, Debug)]
pub struct Noise<'a> {
    column: &'a Column,
    /// Standard deviation that the samples show; 0 where they do not tell it.
    scatter: f64,
    /// Standard deviation of what rounding to the sensor's steps adds to any mean.
    rounding: f64,
    /// Rows of the longest sample.
    rows: usize,
}

impl<'a> Noise<'a> {
    /// `means`: the samples of the column.
    pub fn of(column: &'a Column, means: &[Mean]) -> Self {
        let rows = means.iter().map(|own| own.rows).max().unwrap_or(1);
        Self {
            column,
            scatter: scatter(means, if rows > 1 { OF_MEANS } else { OF_FRAMES }).unwrap_or(0.0),
            rounding: rounding(column),
            rows,
        }
    }

    /// Of a sample of so many rows: what is said of a row, or more where samples scatter by more. A scatter that
    /// is too large for a stated noise is not noise but a cause.
    pub fn of_sample(&self, rows: usize) -> f64 {
        let white = self.column.noise / (rows as f64).sqrt();
        let most = match self.column.estimated {
            true => f64::INFINITY,
            false => Rules::USED.evidence.misstated * white,
        };
        let scatter = if self.scatter <= most { self.scatter } else { 0.0 };
        white.max(scatter).hypot(self.rounding)
    }

    /// Of one row, as if rows were independent.
    pub fn of_row(&self) -> f64 {
        self.of_sample(self.rows) * (self.rows as f64).sqrt()
    }
}

/// Standard deviation of a mean, from how far each is off the line between two others. Over so short a time what
/// follows the motion changes almost evenly, and the median leaves out snaps.
fn scatter(means: &[Mean], (apart, longest_s): (usize, f64)) -> Option<f64> {
    let off_line = |own: &[Mean]| {
        let [a, b, c] = [own[0], own[apart], own[2 * apart]];
        let share = (b.t_s - a.t_s) / (c.t_s - a.t_s);
        let line = a.value + share * (c.value - a.value);
        (b.value - line).abs() / (1.0 + share.powi(2) + (1.0 - share).powi(2)).sqrt()
    };
    let mut off: Vec<f64> = means
        .windows(2 * apart + 1)
        .filter(|own| own[2 * apart].t_s - own[0].t_s < longest_s)
        .map(off_line)
        .collect();
    if off.len() < FEWEST {
        return None;
    }
    let middle = off.len() / 2;
    Some(OF_MEDIAN * *off.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Rounding to steps of q is wrong by q/√12 where a reading stays on one step. Noise of a standard deviation σ
/// before it spreads readings over several steps, and their mean is off by less (Widrow and Kollár 2008):
///
/// > q/√12 · exp(−2 π² σ²/q²)
fn rounding(column: &Column) -> f64 {
    let step = step(column);
    let once = step / 12f64.sqrt();
    // What was found in the rows has been rounded, what is stated has not.
    let rounded = if column.estimated { once } else { 0.0 };
    let noise_squared = (column.noise.powi(2) - rounded.powi(2)).max(0.0);
    match step > 0.0 {
        true => once * (-2.0 * PI.powi(2) * noise_squared / step.powi(2)).exp(),
        false => 0.0,
    }
}

/// The step between readings of a sensor; 0 where they have none.
fn step(column: &Column) -> f64 {
    let mut values: Vec<f64> = column.rows.iter().map(|(_, value)| *value).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    if values.len() < 2 || values.len() * ROWS_A_READING > column.rows.len() {
        return 0.0;
    }
    values.windows(2).map(|own| own[1] - own[0]).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::super::super::column::Source;
    use super::*;

    const ROW_S: f64 = 4e-3;
    const NOISE_N: f64 = 2e-3;
    const ROWS: usize = 5;

    /// Ten seconds of a slow force whose sensor averages over so many rows and rounds to steps.
    fn column(filter: usize, step_n: f64, estimated: bool, noise: f64) -> Column {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let mut even = || rng.random_range(-0.5..0.5);
        let white: Vec<f64> =
            (0..2600).map(|_| NOISE_N * (0..12).map(|_| even()).sum::<f64>()).collect();
        let row = |i: usize| {
            let own = white[i..i + filter].iter().sum::<f64>() / filter as f64;
            let force = 0.05 * (0.8 * i as f64 * ROW_S).sin() + own;
            (i, if step_n > 0.0 { (force / step_n).round() * step_n } else { force })
        };
        Column { source: Source::Force(0), rows: (0..2500).map(row).collect(), noise, estimated }
    }

    fn means(column: &Column) -> Vec<Mean> {
        let mean = |own: &[(usize, f64)]| Mean {
            t_s: own[ROWS / 2].0 as f64 * ROW_S,
            value: own.iter().map(|(_, value)| value).sum::<f64>() / ROWS as f64,
            rows: ROWS,
        };
        column.rows.chunks_exact(ROWS).map(mean).collect()
    }

    fn of_sample(column: &Column) -> f64 {
        Noise::of(column, &means(column)).of_sample(ROWS)
    }

    #[test]
    fn a_filter_does_not_hide_noise() {
        let white = NOISE_N / (ROWS as f64).sqrt();
        for filter in [1, 3, 5] {
            let rows = column(filter, 0.0, true, 0.0).rows;
            let noise = cathforce_recording::white_noise(&rows);
            let found = of_sample(&Column { noise, ..column(filter, 0.0, true, 0.0) });
            // A mean over five rows after one over the last five is a mean over nine.
            assert!((0.75..1.15).contains(&(found / white)), "{filter}: {}", found / white);
            assert!(filter == 1 || noise < 0.8 * NOISE_N, "rows alone say {noise}");
        }
    }

    #[test]
    fn a_stated_noise_is_corrected_upwards_up_to_where_it_is_a_cause() {
        let white = NOISE_N / (ROWS as f64).sqrt();
        let stated = |share: f64| of_sample(&column(1, 0.0, false, share * NOISE_N)) / white;
        assert!((stated(0.5) - 1.0).abs() < 0.15);
        assert!((stated(2.0) - 2.0).abs() < 1e-9, "accuracy is not seen in what scatters");
        assert!((stated(0.2) - 0.2).abs() < 1e-9, "five times as much is no noise");
    }

    #[test]
    fn steps_are_a_noise_that_a_mean_does_not_lessen() {
        let coarse = column(1, 0.02, false, NOISE_N);
        assert!((rounding(&coarse) / (0.02 / 12f64.sqrt()) - 0.82).abs() < 0.01);
        // Noise as large as a step spreads readings evenly.
        assert!(rounding(&column(1, NOISE_N, false, NOISE_N)) < 1e-3 * NOISE_N);
        assert_eq!(rounding(&column(1, 0.0, false, NOISE_N)), 0.0);
    }

    #[test]
    fn frames_that_are_missing_do_not_make_motion_noise() {
        let own = column(1, 0.0, false, 0.5 * NOISE_N);
        // Ten times the noise from a frame to the next.
        let frame = |k: usize| Mean {
            t_s: 0.05 * k as f64,
            value: own.rows[k].1 + 10.0 * NOISE_N * k as f64,
            rows: 1,
        };
        let frames: Vec<Mean> = (0..600).filter(|k| k * 7 % 10 < 7).map(frame).collect();
        let found = Noise::of(&own, &frames).of_sample(1);
        assert!((found / NOISE_N - 1.0).abs() < 0.15, "{}", found / NOISE_N);
    }

    #[test]
    fn a_row_has_the_noise_of_which_samples_are_means() {
        let own = column(1, 0.0, true, NOISE_N);
        assert!((Noise::of(&own, &means(&own)).of_row() / NOISE_N - 1.0).abs() < 0.15);
        assert_eq!(Noise::of(&own, &[]).of_row(), NOISE_N);
    }
}
