//! The white noise of every channel, and how large the gap is around each sample.

use nalgebra::DVector;

use crate::fitting::fit::Fit;
use crate::fitting::nuisance::Nuisances;
use crate::fitting::problem::Problem;

/// What is known of the measurements before any effect is tried.
pub struct Noise {
    /// Standard deviation by channel, in its unit.
    pub channels: Vec<f64>,
    /// By trial and sample, root mean square of what the nominal model leaves around it beyond the noise
    /// and its own uncertainty.
    pub gap: Vec<Vec<f64>>,
    /// Whether a channel scatters far more than its sensor is said to.
    pub is_beyond_stated: bool,
}

impl Noise {
    /// From the second differences of the residuals of several fits, of which the least counts.
    pub fn of(problem: &Problem<'_>, fits: &[&Fit], nominal: &Fit, nuisances: &Nuisances) -> Self {
        let channels = problem.plant.channels().len();
        let of_channel = |channel: usize| {
            let of_fit = |fit: &&Fit| {
                let mut differences = Vec::new();
                for (t, (trial, own)) in problem.plant.trials().iter().zip(&fit.trials).enumerate()
                {
                    for range in trial.channel_ranges() {
                        if trial.samples[range.start].channel != channel {
                            continue;
                        }
                        let weights = problem.weights(t);
                        let absolute: Vec<f64> =
                            range.clone().map(|i| own.raw[i] / weights[i]).collect();
                        let second = |w: &[f64]| (w[1] - 0.5 * (w[0] + w[2])).abs() / 1.5f64.sqrt();
                        differences.extend(absolute.windows(3).map(second));
                    }
                }
                median(differences).map(|own| 1.4826 * own)
            };
            let samples = || {
                let all = problem.plant.trials().iter().flat_map(|t| &t.samples);
                all.filter(move |sample| sample.channel == channel)
            };
            let stated = median(samples().map(|own| own.noise).collect());
            let found = fits.iter().filter_map(of_fit).fold(f64::INFINITY, f64::min);
            let found = if found.is_finite() && found > 0.0 { Some(found) } else { stated };
            // What differs from run to run is in the floor; an encoder's steps are in what the model leaves open.
            let repeated = problem.floor().of_repeats(channel).unwrap_or(0.0);
            let open = median(samples().map(|own| own.noise.hypot(own.model)).collect());
            let known = open.map(|own| own.max(repeated));
            let is_beyond = found
                .zip(known)
                .is_some_and(|(found, known)| found > problem.rules.evidence.misstated * known);
            (found.unwrap_or(1.0).max(f64::MIN_POSITIVE.sqrt()), is_beyond)
        };
        let (channels, beyond): (Vec<f64>, Vec<bool>) = (0..channels).map(of_channel).unzip();
        let trials = 0..problem.plant.trials().len();
        let gap = trials.map(|t| gap(problem, &channels, nominal, nuisances, t)).collect();
        Self { channels, gap, is_beyond_stated: beyond.contains(&true) }
    }
}

/// Root mean square, over a stretch around each sample of a trial, of what the nominal model leaves beyond
/// the noise and its own uncertainty, in the unit of the channel.
fn gap(
    problem: &Problem<'_>,
    noise: &[f64],
    nominal: &Fit,
    nuisances: &Nuisances,
    t: usize,
) -> Vec<f64> {
    let trial = &problem.plant.trials()[t];
    let estimate = DVector::from_column_slice(&nominal.trials[t].refit.estimate);
    let left = &nominal.trials[t].raw + nuisances.bend(t) + nuisances.scaled(t) * estimate;
    let stretch_s = problem.rules.evidence.stretch_s;
    let mut gap = vec![0.0; left.len()];
    for range in trial.channel_ranges() {
        let white = noise[trial.samples[range.start].channel];
        let beyond = |i: usize| {
            let left = left[i] / problem.weights(t)[i];
            left * left - white * white - problem.plant.open(&trial.samples[i]).powi(2)
        };
        let squares: Vec<f64> = range.clone().map(beyond).collect();
        let times: Vec<f64> = range.clone().map(|i| trial.samples[i].t_s).collect();
        let (mut from, mut to, mut sum) = (0, 0, 0.0);
        for (k, i) in range.enumerate() {
            while to < times.len() && times[to] <= times[k] + 0.5 * stretch_s {
                sum += squares[to];
                to += 1;
            }
            while times[from] < times[k] - 0.5 * stretch_s {
                sum -= squares[from];
                from += 1;
            }
            gap[i] = (sum / (to - from) as f64).max(0.0).sqrt();
        }
    }
    gap
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
