//! Trials and model as one least-squares problem: whitened residuals and their derivatives.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use nalgebra::{DMatrix, DVector};

use crate::fitting::progress::{BestSoFar, Progress};
use crate::noise::floor::Floor;
use crate::parallel::{each_or_none, each_some};
use crate::plant::{Parameter, Plant, Point};
use crate::rules::Rules;

/// One coordinate of a [`Point`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinate {
    Effect { effect: usize, parameter: usize },
    Nuisance(usize),
}

/// The step of a difference, in standard deviations of the prior.
///
/// Contact is not smooth: a step must move the model by more than a contact opening or
/// closing does, and 2 % of a prior is still linear.
const STEP_SD: f64 = 0.02;
/// The same of a drive, whose force is smooth in every parameter: where much is left, the curvature
/// over a longer step would hold a fit off its minimum. Of its nuisances too: a line through two
/// shifts in time is a mean of both, which beside a latency smooths the noise of the position, and
/// was named.
const SMALL_STEP_SD: f64 = 1e-3;
/// Times the median of the trials that a derivative may be in one of them, before it is taken to the
/// other side as well: at a threshold, as a fork of the vessel is, a step that crosses it gives a
/// difference that is no derivative.
const CROSSED: f64 = 4.0;

/// A plant with the noise of its samples.
pub struct Problem<'a> {
    pub plant: &'a dyn Plant,
    /// One over the standard deviation of every sample, by trial.
    weights: Vec<DVector<f64>>,
    floor: Floor,
    simulations: AtomicUsize,
    progress: Progress<'a>,
    pub rules: Rules,
    is_cut: AtomicBool,
}

impl<'a> Problem<'a> {
    pub fn new(plant: &'a dyn Plant, floor: &Floor, progress: Progress<'a>) -> Self {
        let weights = plant.trials().iter().map(|trial| {
            let sd = |sample| floor.sd_of(sample);
            DVector::from_iterator(trial.samples.len(), trial.samples.iter().map(sd))
                .map(|x| 1.0 / x)
        });
        Self {
            plant,
            weights: weights.collect(),
            floor: floor.clone(),
            simulations: AtomicUsize::new(0),
            progress,
            rules: Rules::USED,
            is_cut: AtomicBool::new(false),
        }
    }

    /// The same, decided by other rules.
    pub fn by(self, rules: Rules) -> Self {
        Self { rules, ..self }
    }

    /// Trials simulated so far.
    pub fn simulations(&self) -> usize {
        self.simulations.load(Ordering::Relaxed)
    }

    /// Whether the run must end with what it has found so far.
    pub fn is_cut(&self) -> bool {
        self.is_cut.load(Ordering::Relaxed)
    }

    /// Tells whoever watches what was found so far.
    pub fn tell(&self, best: &BestSoFar) {
        self.progress.found(best);
    }

    /// The noise floor of every channel.
    pub fn floor(&self) -> &Floor {
        &self.floor
    }

    /// One over the standard deviation of every sample of a trial.
    pub fn weights(&self, trial: usize) -> &DVector<f64> {
        &self.weights[trial]
    }

    /// (y − f)/σ of one trial; `None` when the simulation breaks down.
    ///
    /// See docs/explanation/diagnosis.md (D1).
    pub fn residual(&self, trial: usize, point: &Point) -> Option<DVector<f64>> {
        let predicted = self.plant.simulate(trial, point)?;
        let done = self.simulations.fetch_add(1, Ordering::Relaxed) + 1;
        if self.progress.simulated(done).is_break() {
            self.is_cut.store(true, Ordering::Relaxed);
        }
        let samples = &self.plant.trials()[trial].samples;
        debug_assert_eq!(predicted.len(), samples.len());
        let whitened = samples.iter().zip(&predicted).zip(self.weights[trial].iter());
        let residual = whitened.map(|((sample, f), w)| (sample.value - f) * w);
        let residual = DVector::from_iterator(samples.len(), residual);
        residual.iter().all(|x| x.is_finite()).then_some(residual)
    }

    /// (y − f)/σ by trial.
    pub fn residuals(&self, point: &Point) -> Option<Vec<DVector<f64>>> {
        self.residuals_of(&self.trials(), point)
    }

    /// (y − f)/σ of some trials.
    pub fn residuals_of(&self, trials: &[usize], point: &Point) -> Option<Vec<DVector<f64>>> {
        each_or_none(trials, |&trial| self.residual(trial, point))
    }

    /// All trials.
    pub fn trials(&self) -> Vec<usize> {
        (0..self.plant.trials().len()).collect()
    }

    /// Derivatives of [`Problem::residuals_of`] these trials, which are `base` at this point, by
    /// forward or backward differences that stay within the bounds. By trial: samples ×
    /// coordinates. Where simulations cost something, one that is far larger in one trial than in the
    /// others is the smaller one of both sides.
    pub fn sensitivities(
        &self,
        trials: &[usize],
        point: &Point,
        base: &[DVector<f64>],
        coordinates: &[Coordinate],
    ) -> Option<Vec<DMatrix<f64>>> {
        let columns = 0..coordinates.len();
        let jobs: Vec<(usize, usize)> =
            (0..trials.len()).flat_map(|t| columns.clone().map(move |c| (t, c))).collect();
        let column = |&(t, c): &(usize, usize), side: f64| {
            let (moved, step) = self.moved(point, coordinates[c], side)?;
            Some((self.residual(trials[t], &moved)? - &base[t]) / step)
        };
        let mut columns = each_or_none(&jobs, |job| column(job, 1.0))?;
        let crossed: Vec<usize> =
            if self.plant.cheap() { Vec::new() } else { crossed(&columns, coordinates.len()) };
        let other_side = |job: usize| Some((job, column(&jobs[job], -1.0)?));
        let other_side = each_some(crossed, other_side);
        for (job, other) in other_side {
            if other.norm() < columns[job].norm() {
                columns[job] = other;
            }
        }
        let mut columns = columns.into_iter();
        let matrix = |trial: usize| {
            let own: Vec<_> = columns.by_ref().take(coordinates.len()).collect();
            if own.is_empty() {
                DMatrix::zeros(base[trial].len(), 0)
            } else {
                DMatrix::from_columns(&own)
            }
        };
        Some((0..trials.len()).map(matrix).collect())
    }

    /// A step of a difference from a point; `side`: 1 for the usual one, −1 for the opposite. `None`
    /// where that leads out of the bounds.
    fn moved(&self, point: &Point, coordinate: Coordinate, side: f64) -> Option<(Point, f64)> {
        let mut moved = point.clone();
        let step = match coordinate {
            Coordinate::Effect { effect, parameter } => {
                let Parameter { low, high, scale, .. } = self.parameter(effect, parameter);
                let value = &mut moved.effects[effect][parameter];
                let step = if self.plant.cheap() { SMALL_STEP_SD } else { STEP_SD } * scale;
                let step = side * if *value + step > high { -step } else { step };
                *value += step;
                if side < 0.0 && !(low..=high).contains(value) {
                    return None;
                }
                step
            }
            Coordinate::Nuisance(nuisance) => {
                // Priors of nuisances are tight: of a catheter, a whole one is still a small step.
                let steps_sd = if self.plant.cheap() { SMALL_STEP_SD } else { 1.0 };
                let step = side * steps_sd * self.plant.nuisances()[nuisance].sd;
                moved.nuisances[nuisance] += step;
                step
            }
        };
        Some((moved, step))
    }

    /// One parameter of an effect.
    pub fn parameter(&self, effect: usize, parameter: usize) -> Parameter {
        self.plant.effects()[effect].parameters[parameter]
    }

    /// All parameters of some effects.
    pub fn coordinates(&self, effects: &[usize]) -> Vec<Coordinate> {
        let of = |&effect: &usize| {
            let parameters = self.plant.effects()[effect].parameters.len();
            (0..parameters).map(move |parameter| Coordinate::Effect { effect, parameter })
        };
        effects.iter().flat_map(of).collect()
    }
}

/// Indices of derivatives that are far larger in one trial than in the others. `columns`: trial by
/// trial, each with so many coordinates.
fn crossed(columns: &[DVector<f64>], coordinates: usize) -> Vec<usize> {
    let size = |column: &DVector<f64>| column.norm() / (column.len().max(1) as f64).sqrt();
    let sizes: Vec<f64> = columns.iter().map(size).collect();
    let is_crossed = |job: &usize| {
        let mut own: Vec<f64> =
            sizes[job % coordinates..].iter().step_by(coordinates).copied().collect();
        own.sort_by(f64::total_cmp);
        sizes[*job] > CROSSED * own[(own.len() - 1) / 2]
    };
    (0..columns.len()).filter(is_crossed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::toy::{Toy, effect, noise, parameter};

    const SAMPLES: usize = 100;

    /// By trial, the derivative of a line's size at 0, where the last trial jumps by 1 above a size.
    fn derivatives(trials: usize, jumps_above: f64) -> Vec<f64> {
        let mut toy = Toy::new(0.01, 1.0, (0..SAMPLES).map(noise), |_, point| point.effects[0][0]);
        toy = toy.times(trials);
        toy.effects = vec![effect("size", vec![parameter("size")], vec![vec![1.0]])];
        (toy.cheap, toy.forks, toy.forks_above) = (false, vec![1.0], jumps_above);
        let floor = Floor::of(&toy);
        let problem = Problem::new(&toy, &floor, &crate::unwatched);
        let point = Point::nominal(&toy);
        let base = problem.residuals(&point).unwrap();
        let own = problem.coordinates(&[0]);
        let found = problem.sensitivities(&problem.trials(), &point, &base, &own).unwrap();
        found.iter().map(|columns| -columns.mean()).collect()
    }

    #[test]
    fn a_step_across_a_threshold_is_taken_to_the_other_side() {
        let jumped = 1.0 + 1.0 / STEP_SD;
        let are = |found: Vec<f64>, expected: &[f64]| {
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}");
        };
        are(derivatives(3, 0.5 * STEP_SD), &[1.0; 3]);
        // Both sides are the same above the threshold.
        are(derivatives(3, -0.5), &[1.0; 3]);
        // Of one trial nothing is known to compare it with.
        are(derivatives(1, 0.5 * STEP_SD), &[jumped]);
    }
}
