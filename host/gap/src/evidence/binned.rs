//! Residuals and derivatives as means over short bins, and the weight of each bin.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::noise::Noise;
use crate::fitting::fit::Fit;
use crate::fitting::nuisance::Nuisances;
use crate::fitting::problem::Problem;
use crate::plant::Trial;

/// The bins of one trial.
pub struct BinnedTrial {
    /// Samples of each bin, all of one channel.
    pub bins: Vec<Range<usize>>,
    /// Means of the residual with nuisances at 0, in the unit of the channel.
    pub residual: DVector<f64>,
    /// Means of the derivatives by the nuisances, in standard deviations of their priors.
    pub nuisances: DMatrix<f64>,
    /// Means of the derivatives by the parameters.
    pub parameters: DMatrix<f64>,
    /// Means of the residual with the nuisances where they were fitted to be.
    left: DVector<f64>,
    /// Variances: of the mean of the noise, of what the model leaves open, and the square of the gap.
    white: Vec<f64>,
    open: Vec<f64>,
    gap: Vec<f64>,
    /// Of Student's t.
    freedom: f64,
}

/// All trials of a fit.
pub struct Binned {
    pub trials: Vec<BinnedTrial>,
}

impl Binned {
    pub fn of(problem: &Problem<'_>, noise: &Noise, fit: &Fit, nuisances: &Nuisances) -> Self {
        let trials = 0..problem.plant.trials().len();
        Self {
            trials: trials.map(|t| BinnedTrial::of(problem, noise, fit, nuisances, t)).collect(),
        }
    }
}

impl BinnedTrial {
    fn of(
        problem: &Problem<'_>,
        noise: &Noise,
        fit: &Fit,
        nuisances: &Nuisances,
        t: usize,
    ) -> Self {
        let trial = &problem.plant.trials()[t];
        let own = &fit.trials[t];
        let weights = problem.weights(t);
        let rules = &problem.rules.evidence;
        let bins = bins(trial, rules.bin_s);
        let in_units = |column: DVector<f64>| bin_means(&bins, &column.component_div(weights));
        let columns = |of: &DMatrix<f64>| {
            let means: Vec<DVector<f64>> =
                of.column_iter().map(|column| in_units(column.into_owned())).collect();
            let values = means.iter().flat_map(|column| column.iter().copied());
            DMatrix::from_iterator(bins.len(), of.ncols(), values)
        };
        let raw = &own.raw + nuisances.bend(t);
        let estimate = DVector::from_column_slice(&own.refit.estimate);
        let left = in_units(&raw + nuisances.scaled(t) * estimate);
        let mean = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
            let one = |bin: &Range<usize>| bin.clone().map(of).sum::<f64>() / bin.len() as f64;
            bins.iter().map(one).collect()
        };
        let variance = |i: usize| noise.channels[trial.samples[i].channel].powi(2);
        let white = bins.iter().map(|bin| variance(bin.start) / bin.len() as f64).collect();
        let open = mean(&|i| {
            let sample = &trial.samples[i];
            let repeated = problem.floor().of_repeats(sample.channel);
            let least = repeated.map_or(rules.open_of_noise.powi(2) * variance(i), |sd| sd * sd);
            problem.plant.open(sample).powi(2) + least
        });
        let gap = mean(&|i| noise.gap[t][i].powi(2));
        Self {
            residual: in_units(raw),
            nuisances: columns(nuisances.scaled(t)),
            parameters: columns(&own.raw_jacobian),
            left,
            white,
            open,
            gap,
            bins,
            freedom: rules.freedom,
        }
    }

    /// The weight of every bin, and the logarithm of the determinant of their covariance with the difference
    /// between Student's t and the normal distribution of that weight.
    ///
    /// > σ² = n²/k + a² (m² + (0.3 n)²) + κ² g²,   w = min(1, (ν + 1)/(ν + u²))/σ²,   u = left/σ
    ///
    /// as Lange, Little and Taylor (1989) weight them.
    ///
    /// See docs/explanation/diagnosis.md (D10).
    pub fn weights(&self, amplitude: f64, kappa: f64) -> (Vec<f64>, f64) {
        let freedom = self.freedom;
        let (a, k) = (amplitude * amplitude, kappa * kappa);
        let of_t = |square: f64| (freedom + 1.0) * (1.0 + square / freedom).ln();
        let mut log_determinant = 0.0;
        let weight = |i: usize| {
            let variance = self.white[i] + a * self.open[i] + k * self.gap[i];
            let square = self.left[i] * self.left[i] / variance;
            log_determinant += variance.ln();
            let share = (freedom + 1.0) / (freedom + square);
            if share >= 1.0 {
                return variance.recip();
            }
            // Continuous at a square of 1, from where on the tails are those of Student's t.
            log_determinant += 1.0 + of_t(square) - of_t(1.0) - share * square;
            share / variance
        };
        let weights = (0..self.bins.len()).map(weight).collect();
        (weights, log_determinant)
    }
}

/// Runs of samples of one channel that are no longer than a bin.
fn bins(trial: &Trial, bin_s: f64) -> Vec<Range<usize>> {
    let mut bins: Vec<Range<usize>> = Vec::new();
    for range in trial.channel_ranges() {
        let mut from = range.start;
        for i in range.clone() {
            if trial.samples[i].t_s >= trial.samples[from].t_s + bin_s {
                bins.push(from..i);
                from = i;
            }
        }
        bins.push(from..range.end);
    }
    bins
}

/// Means of a column over its bins.
pub fn bin_means(bins: &[Range<usize>], column: &DVector<f64>) -> DVector<f64> {
    let mean = |bin: &Range<usize>| column.rows_range(bin.clone()).mean();
    DVector::from_iterator(bins.len(), bins.iter().map(mean))
}
