//! Held-out scores: every sample is predicted from parameters that have not seen its fold.
//!
//! A fold's parameters follow from the fit to everything by one Gauss–Newton step that leaves
//! the fold out, and its prediction by the same derivatives: no further simulation. Nuisances
//! are a trial's own and are refitted on the trial that is held out, within their priors.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector};

use crate::fitting::fit::Fit;
use crate::fitting::loss::Loss;
use crate::fitting::problem::{Coordinate, Problem};
use crate::plant::{Plant, Quantity};
use crate::scoring::folds::{FoldKind, Folds};

/// A model's error on data that its parameters have not seen.
#[derive(Clone, Debug)]
pub struct Score {
    /// Whitened held-out residuals by trial and sample; `None` where not scored.
    pub residuals: Vec<Vec<Option<f64>>>,
    /// Samples that are scored, over all trials.
    pub samples: usize,
    /// Energy per sample: 1 is the floor.
    pub energy: f64,
    /// The same of every quantity, and how many samples it has.
    pub quantities: Vec<(Quantity, f64, usize)>,
    /// Energy above the floor that shrinks are shares of: of a catheter in the same terms; of a drive
    /// in squares, as errors in newtons are.
    pub gap: f64,
    /// Samples that are worth an independent one.
    pub effective: f64,
}

/// Scores a fit.
pub fn score(problem: &Problem<'_>, folds: &Folds, fit: &Fit) -> Score {
    let steps = fold_steps(problem, folds, fit);
    let loss = Loss::of(problem.plant);
    let mut residuals = Vec::new();
    let (mut sum, mut samples) = (0.0, 0);
    for (t, (trial, fitted)) in problem.plant.trials().iter().zip(&fit.trials).enumerate() {
        let n = trial.samples.len();
        let mut own: Vec<Option<f64>> = vec![None; n];
        // Fold by fold: of a long trial, all of them at once would not fit into memory.
        let fold_of = &folds.of_sample[t];
        let present: BTreeSet<usize> = fold_of.iter().copied().collect();
        for fold in present {
            let moved = shortened(&fitted.refit.residual, &fitted.jacobian * &steps[fold]);
            let held_out = (0..n).filter(|&i| fold_of[i] == fold && folds.scored[t][i]);
            held_out.for_each(|i| own[i] = Some(moved[i]));
        }
        let scored = own.iter().flatten().count();
        if scored > 0 {
            sum += own.iter().flatten().map(|r| r * r).sum::<f64>() + fitted.penalty();
            samples += scored;
        }
        residuals.push(own);
    }
    let energy = sum / samples.max(1) as f64;
    let effective = effective_samples(problem.plant, &residuals);
    let quantities = by_quantity(problem, fit, &residuals);
    let raw = |phi: &mut Option<f64>| *phi = phi.map(|phi| loss.residual(phi));
    residuals.iter_mut().flatten().for_each(raw);
    let gap = match problem.plant.cheap() {
        true => excess(&by_quantity(problem, fit, &residuals)),
        false => excess(&quantities),
    };
    Score { residuals, samples, energy, quantities, gap, effective }
}

/// Energy per sample of every quantity, with what the nuisances cost, and how many samples it has.
fn by_quantity(
    problem: &Problem<'_>,
    fit: &Fit,
    residuals: &[Vec<Option<f64>>],
) -> Vec<(Quantity, f64, usize)> {
    let mut energies = Energies::default();
    for (trial, own) in problem.plant.trials().iter().zip(residuals) {
        for (sample, residual) in trial.samples.iter().zip(own) {
            if let Some(r) = residual {
                energies.add(problem.plant.channels()[sample.channel].quantity, *r);
            }
        }
    }
    energies.per_sample(fit.trials.iter().map(|trial| trial.penalty()).sum())
}

/// Residuals after a change. One that is larger than they are leads beyond where derivatives hold,
/// as they do not far from a threshold: it is shortened to their size.
fn shortened(residual: &DVector<f64>, change: DVector<f64>) -> DVector<f64> {
    let most = residual.norm() / change.norm().max(f64::MIN_POSITIVE);
    residual + change * most.min(1.0)
}

/// Squares of whitened residuals by quantity.
#[derive(Clone, Debug, Default)]
pub struct Energies(BTreeMap<Quantity, (f64, usize)>);

impl Energies {
    pub fn add(&mut self, quantity: Quantity, residual: f64) {
        let sum = self.0.entry(quantity).or_default();
        *sum = (sum.0 + residual * residual, sum.1 + 1);
    }

    /// Energy per sample and number of samples. `penalty`: what the nuisances cost, which belongs
    /// to all samples alike.
    pub fn per_sample(&self, penalty: f64) -> Vec<(Quantity, f64, usize)> {
        let all: usize = self.0.values().map(|(_, count)| count).sum();
        let share = penalty / all.max(1) as f64;
        self.0.iter().map(|(q, (sum, n))| (*q, sum / *n as f64 + share, *n)).collect()
    }
}

/// Energy above the floor per sample. A quantity below its floor makes up for no other.
///
/// See docs/explanation/diagnosis.md (D9).
pub fn excess(quantities: &[(Quantity, f64, usize)]) -> f64 {
    let all: usize = quantities.iter().map(|(.., count)| count).sum();
    let above = |(_, energy, count): &(Quantity, f64, usize)| {
        (energy - 1.0).max(0.0) * *count as f64 / all as f64
    };
    quantities.iter().map(above).sum()
}

/// How far the parameters of every fold lie from those of the whole fit.
///
/// See docs/explanation/diagnosis.md (D8).
pub fn fold_steps(problem: &Problem<'_>, folds: &Folds, fit: &Fit) -> Vec<DVector<f64>> {
    let k = fit.coordinates.len();
    let mut normal = vec![DMatrix::<f64>::zeros(k, k); folds.count];
    let mut gradient = vec![DVector::<f64>::zeros(k); folds.count];
    let (mut all_normal, mut all_gradient) = (DMatrix::zeros(k, k), DVector::zeros(k));
    for (i, coordinate) in fit.coordinates.iter().enumerate() {
        if let Coordinate::Effect { effect, parameter } = *coordinate {
            let p = problem.parameter(effect, parameter);
            all_normal[(i, i)] += p.scale.powi(-2);
            all_gradient[i] += (fit.point.effects[effect][parameter] - p.off) / p.scale.powi(2);
        }
    }
    for (trial, own) in fit.trials.iter().zip(&folds.of_sample) {
        let (j, r) = (&trial.jacobian, &trial.refit.pull);
        all_normal += j.tr_mul(j);
        all_gradient += j.tr_mul(r);
        for i in 0..r.len() {
            // The penalties at the end go with the trial, and stay when it is cut into blocks.
            let fold = match (own.get(i), own.first(), folds.kind) {
                (Some(&fold), ..) | (None, Some(&fold), FoldKind::Trial) => fold,
                _ => continue,
            };
            let row = j.row(i).transpose();
            normal[fold] += &row * row.transpose();
            gradient[fold] += row * r[i];
        }
    }
    let room: Vec<(f64, f64)> = fit.coordinates.iter().map(|c| room(problem, fit, *c)).collect();
    let solve = |normal: DMatrix<f64>, slope: &DVector<f64>| {
        bounded_minimum(&normal, slope, &room).unwrap_or_else(|| DVector::zeros(k))
    };
    // What the whole fit left undone is no difference between folds.
    let undone = solve(all_normal.clone(), &all_gradient);
    let step = |fold: usize| {
        let slope = &all_gradient - &gradient[fold];
        let step = solve(&all_normal - &normal[fold], &slope) - &undone;
        DVector::from_fn(k, |i, _| step[i].clamp(room[i].0, room[i].1))
    };
    (0..folds.count).map(step).collect()
}

/// How far a coordinate may go down and up from where it is fitted.
fn room(problem: &Problem<'_>, fit: &Fit, coordinate: Coordinate) -> (f64, f64) {
    match coordinate {
        Coordinate::Effect { effect, parameter } => {
            let p = problem.parameter(effect, parameter);
            let value = fit.point.effects[effect][parameter];
            // Where a value was rounded to its bound, there is none beyond it.
            ((p.low - value).min(0.0), (p.high - value).max(0.0))
        }
        Coordinate::Nuisance(_) => (f64::NEG_INFINITY, f64::INFINITY),
    }
}

/// The x that minimises ½ xᵀ N x + gᵀ x, with what would leave its room held at the end of it and
/// the others solved again. `None` when N has no such minimum.
fn bounded_minimum(
    normal: &DMatrix<f64>,
    gradient: &DVector<f64>,
    room: &[(f64, f64)],
) -> Option<DVector<f64>> {
    let mut x = DVector::zeros(gradient.len());
    let mut free: Vec<usize> = (0..gradient.len()).collect();
    while !free.is_empty() {
        let mut held = x.clone();
        free.iter().for_each(|&i| held[i] = 0.0);
        let slope = (gradient + normal * &held).select_rows(&free);
        let own = normal.select_columns(&free).select_rows(&free);
        let solved = own.cholesky()?.solve(&-slope);
        for (&i, value) in free.iter().zip(solved.iter()) {
            x[i] = value.clamp(room[i].0, room[i].1);
        }
        let before = free.len();
        let inside: Vec<bool> =
            free.iter().zip(solved.iter()).map(|(&i, value)| x[i] == *value).collect();
        let mut inside = inside.into_iter();
        free.retain(|_| inside.next().unwrap_or(false));
        if free.len() == before {
            break;
        }
    }
    Some(x)
}

/// N/(1 + 2 Σ ρ_k), summed over trials and channels.
///
/// See docs/explanation/diagnosis.md (D14).
fn effective_samples(plant: &dyn Plant, residuals: &[Vec<Option<f64>>]) -> f64 {
    let mut sum = 0.0;
    for (trial, own) in plant.trials().iter().zip(residuals) {
        for range in trial.channel_ranges() {
            let series: Vec<f64> = own[range].iter().flatten().copied().collect();
            if !series.is_empty() {
                sum += series.len() as f64 / crate::noise::correlation::correlation_length(&series);
            }
        }
    }
    sum
}

impl Score {
    /// Energy above the floor per sample; see [`excess`].
    pub fn excess(&self) -> f64 {
        excess(&self.quantities)
    }

    /// Energy of the quantity that is farthest above its floor.
    pub fn worst(&self) -> f64 {
        self.quantities.iter().map(|(_, energy, _)| *energy).fold(0.0, f64::max)
    }

    /// Shrink of the gap above the floor against the nominal model's score: at most 1, and −1 where twice as much
    /// is left, or more. Where the nominal model leaves nothing above the floor, there is nothing to close.
    ///
    /// See docs/explanation/diagnosis.md (D9).
    pub fn shrink(&self, nominal: &Score) -> f64 {
        match nominal.gap {
            gap if gap > 0.0 => (1.0 - self.gap / gap).max(-1.0),
            _ => 0.0,
        }
    }

    /// The same in the terms that fits lower: of a drive that is less than squares, and a single effect
    /// that is not there may lower it and leave more of these.
    pub fn shrink_of_loss(&self, nominal: &Score) -> f64 {
        1.0 - self.excess() / nominal.excess().max(f64::MIN_POSITIVE)
    }

    /// Root mean square of the error of a quantity, of a vector its norm, in its unit.
    pub fn rms(&self, problem: &Problem<'_>, quantity: Quantity) -> Option<f64> {
        root_mean_square(problem, quantity, |trial, i| self.error(problem, trial, i))
    }

    /// The same of one trial.
    pub fn rms_of(&self, problem: &Problem<'_>, quantity: Quantity, trial: usize) -> Option<f64> {
        let own = |t: usize, i: usize| (t == trial).then(|| self.error(problem, t, i)).flatten();
        root_mean_square(problem, quantity, own)
    }

    /// What a sample adds to the energy that [`Score::gap`] is of, 1 on average at the floor; `None` where
    /// not scored.
    pub fn counts(&self, problem: &Problem<'_>, trial: usize, sample: usize) -> Option<f64> {
        let plant = problem.plant;
        let loss = if plant.cheap() { Loss::SQUARES } else { Loss::of(plant) };
        Some(loss.of_residual(self.residuals[trial][sample]?).0.powi(2))
    }

    /// Measured less predicted, in the unit of the channel; `None` where not scored.
    pub fn error(&self, problem: &Problem<'_>, trial: usize, sample: usize) -> Option<f64> {
        Some(self.residuals[trial][sample]? / problem.weights(trial)[sample])
    }
}

/// Root mean square over the samples of a quantity for which `error` has a value.
pub fn root_mean_square(
    problem: &Problem<'_>,
    quantity: Quantity,
    error: impl Fn(usize, usize) -> Option<f64>,
) -> Option<f64> {
    let channels = problem.plant.channels();
    let mut sums = vec![(0.0, 0_usize); channels.len()];
    for (t, trial) in problem.plant.trials().iter().enumerate() {
        for (i, sample) in trial.samples.iter().enumerate() {
            let wanted = channels[sample.channel].quantity == quantity;
            if let Some(e) = wanted.then(|| error(t, i)).flatten() {
                sums[sample.channel].0 += e * e;
                sums[sample.channel].1 += 1;
            }
        }
    }
    let means: Vec<f64> =
        sums.iter().filter(|(_, n)| *n > 0).map(|(sum, n)| sum / *n as f64).collect();
    // Three channels are one point in space.
    let points = if means.len() > 3 { means.len() as f64 / 3.0 } else { 1.0 };
    (!means.is_empty()).then(|| (means.iter().sum::<f64>() / points).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_held_at_its_bound_moves_nothing_else() {
        let normal = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 2.0]);
        let gradient = DVector::from_vec(vec![1.0, -1.0]);
        let wide = [(-9.0, 9.0); 2];
        let free = bounded_minimum(&normal, &gradient, &wide).unwrap();
        assert!((free - DVector::from_vec(vec![-1.0, 1.0])).norm() < 1e-12);
        // The first may not go down: the second is solved for with it at 0, not cut off from above.
        let held = bounded_minimum(&normal, &gradient, &[(0.0, 9.0), (-9.0, 9.0)]).unwrap();
        assert!((held - DVector::from_vec(vec![0.0, 0.5])).norm() < 1e-12);
        assert!(bounded_minimum(&-normal, &gradient, &wide).is_none());
    }

    #[test]
    fn what_is_held_out_changes_by_no_more_than_it_is() {
        let residual = DVector::from_vec(vec![3.0, 4.0]);
        let after = |change: [f64; 2]| shortened(&residual, DVector::from_vec(change.to_vec()));
        assert_eq!(after([0.0, 1.0]).as_slice(), [3.0, 5.0]);
        assert!((after([0.0, 1e9]) - DVector::from_vec(vec![3.0, 9.0])).norm() < 1e-6);
        assert_eq!(after([0.0; 2]), residual);
    }
}
