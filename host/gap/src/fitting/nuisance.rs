//! Nuisances: refitted for every candidate, in every trial, within their priors.
//!
//! They are linear over their priors, so that refitting costs no simulation. With the whitened
//! residual r and its derivatives S, one column a nuisance over one standard deviation of its
//! prior,
//!
//! > min over z of Σ ρ(r + S z) + |z|²,   |z_k| ≤ [`NUISANCE_LIMIT`]
//!
//! is, with the weights w of the loss ρ (`loss`), a least-squares problem in the residual [√w r; 0] of
//! n + m numbers. What is orthogonal to the columns [√w S; 1] of the nuisances that are not at their
//! limit is what is left: the projection that [`Refit`] does to residuals and derivatives alike.

use nalgebra::{DMatrix, DVector};

use crate::fitting::loss::Loss;
use crate::fitting::problem::{Coordinate, Problem};
use crate::plant::Point;

/// Standard deviations of its prior within which a nuisance stays. Beyond, it is an effect.
pub const NUISANCE_LIMIT: f64 = 4.0;
/// Root mean square by which whitened residuals may be off the line before derivatives are taken again. It adds
/// 5 % to the error at the floor.
const BENT: f64 = 0.3;
/// Times that a residual's loss is taken as a square around where the nuisances were last.
const ROUNDS: usize = 2;

/// Derivatives of the whitened residuals with respect to the nuisances, times their priors.
#[derive(Clone, Debug)]
pub struct Nuisances {
    scaled: Vec<DMatrix<f64>>,
    /// What a residual differs by from the linear one where the nuisances were found to be.
    bend: Vec<DVector<f64>>,
    loss: Loss,
}

/// A simulation at an estimate of the nuisances: how far from linear it is, and its loss with the penalty.
struct Seen {
    bend: DVector<f64>,
    loss: f64,
}

/// A point with the nuisances of one trial, in standard deviations of their priors.
fn moved(point: &Point, estimate: &[f64], problem: &Problem<'_>) -> Point {
    let mut there = point.clone();
    let known = problem.plant.nuisances();
    for ((value, z), known) in there.nuisances.iter_mut().zip(estimate).zip(known) {
        *value += z * known.sd;
    }
    there
}

/// One trial with its nuisances refitted.
#[derive(Clone, Debug)]
pub struct Refit {
    /// φ of n whitened residuals (`loss`), then m penalties.
    pub residual: DVector<f64>,
    /// Of each nuisance, in standard deviations of its prior.
    pub estimate: Vec<f64>,
    /// Orthonormal columns: what free nuisances can explain.
    basis: DMatrix<f64>,
    /// √w r of n whitened residuals, then m penalties: its product with projected columns is half of
    /// what Σ residual² falls by.
    pub pull: DVector<f64>,
    /// √w of every sample.
    root_weight: DVector<f64>,
}

impl Nuisances {
    /// Derivatives at a point where the residuals are `base`; `None` when a simulation breaks
    /// down.
    pub fn at(problem: &Problem<'_>, point: &Point, base: &[DVector<f64>]) -> Option<Self> {
        Self::of_trials(problem, &problem.trials(), point, base)
    }

    /// The same of some trials, which are counted from 0 on afterwards.
    pub fn of_trials(
        problem: &Problem<'_>,
        trials: &[usize],
        point: &Point,
        base: &[DVector<f64>],
    ) -> Option<Self> {
        let nuisances = problem.plant.nuisances();
        let coordinates: Vec<_> = (0..nuisances.len()).map(Coordinate::Nuisance).collect();
        let mut scaled = if point.anchor.is_everywhere {
            // What they do is the same by the model that costs less.
            let point = point.clone().anchored();
            let base = problem.residuals_of(trials, &point)?;
            problem.sensitivities(trials, &point, &base, &coordinates)?
        } else {
            problem.sensitivities(trials, point, base, &coordinates)?
        };
        for matrix in &mut scaled {
            for (mut column, nuisance) in matrix.column_iter_mut().zip(nuisances) {
                column *= nuisance.sd;
            }
        }
        let bend = base.iter().map(|own| DVector::zeros(own.len())).collect();
        let mut own = Self { scaled, bend, loss: Loss::of(problem.plant) };
        if !problem.plant.cheap() {
            own.follow(problem, trials, point, base)?;
        }
        Some(own)
    }

    /// Takes derivatives nearer to where the nuisances are found to be, in trials in which they are not linear up to
    /// there: a Gauss–Newton step more.
    fn follow(
        &mut self,
        problem: &Problem<'_>,
        trials: &[usize],
        point: &Point,
        base: &[DVector<f64>],
    ) -> Option<()> {
        let all: Vec<usize> = (0..trials.len()).collect();
        let found = crate::parallel::each_or_none(&all, |&at| {
            Some(self.followed(problem, at, trials[at], point, &base[at]))
        })?;
        for (at, (scaled, bend)) in found.into_iter().enumerate() {
            self.bend[at] = bend;
            if let Some(scaled) = scaled {
                self.scaled[at] = scaled;
            }
        }
        Some(())
    }

    /// Derivatives S of a trial where they are others, and its bend r(ẑ) − r(0) − S ẑ, with which the residual is
    /// right at ẑ too and not only where the nuisances are 0. Where the bend is larger than S ẑ itself, no expansion
    /// holds (a contact was lost, the other branch was taken), and the first line is kept.
    fn followed(
        &self,
        problem: &Problem<'_>,
        at: usize,
        trial: usize,
        point: &Point,
        base: &DVector<f64>,
    ) -> (Option<DMatrix<f64>>, DVector<f64>) {
        let straight = || DVector::zeros(base.len());
        let estimate = self.refit(at, base).estimate;
        let Some(own) = self.seen_from(problem, trial, point, base, &estimate, &self.scaled[at])
        else {
            return (None, straight());
        };
        if own.bend.norm_squared() > BENT.powi(2) * base.len() as f64 {
            // Where the way to the estimate leads past a fork, a part of it may not.
            let from = |share: f64| {
                let part: Vec<f64> = estimate.iter().map(|z| share * z).collect();
                let again = self.once_more(problem, trial, point, base, &part);
                again.filter(|(_, again)| again.loss < own.loss)
            };
            if let Some((scaled, again)) = from(1.0).or_else(|| from(0.5)) {
                return (Some(scaled), again.bend);
            }
        }
        let line = &self.scaled[at] * DVector::from_column_slice(&estimate);
        let holds = own.bend.norm() < line.norm();
        (None, if holds { own.bend } else { straight() })
    }

    /// Derivatives at an estimate, and what is seen where they lead to.
    fn once_more(
        &self,
        problem: &Problem<'_>,
        trial: usize,
        point: &Point,
        base: &DVector<f64>,
        estimate: &[f64],
    ) -> Option<(DMatrix<f64>, Seen)> {
        let known = problem.plant.nuisances();
        let there = moved(point, estimate, problem);
        let residual = problem.residual(trial, &there)?;
        let coordinates: Vec<_> = (0..known.len()).map(Coordinate::Nuisance).collect();
        let from = std::slice::from_ref(&residual);
        let mut scaled = problem.sensitivities(&[trial], &there, from, &coordinates)?.pop()?;
        for (mut column, nuisance) in scaled.column_iter_mut().zip(known) {
            column *= nuisance.sd;
        }
        let line = &scaled * DVector::from_column_slice(estimate);
        let from_there =
            Self { bend: vec![residual - base - line], scaled: vec![scaled], loss: self.loss };
        let estimate = from_there.refit(0, base).estimate;
        let scaled = &from_there.scaled[0];
        let seen = self.seen_from(problem, trial, point, base, &estimate, scaled)?;
        Some((from_there.scaled[0].clone(), seen))
    }

    /// What a simulation at an estimate tells.
    fn seen_from(
        &self,
        problem: &Problem<'_>,
        trial: usize,
        point: &Point,
        base: &DVector<f64>,
        estimate: &[f64],
        scaled: &DMatrix<f64>,
    ) -> Option<Seen> {
        let residual = problem.residual(trial, &moved(point, estimate, problem))?;
        let of = |r: &f64| self.loss.of_residual(*r).0.powi(2);
        let penalty: f64 = estimate.iter().map(|z| z * z).sum();
        let loss = residual.iter().map(of).sum::<f64>() + penalty;
        let line = scaled * DVector::from_column_slice(estimate);
        Some(Seen { bend: residual - base - line, loss })
    }

    /// From S of every trial, which somebody else has computed.
    pub fn of(scaled: Vec<DMatrix<f64>>) -> Self {
        let bend = scaled.iter().map(|own| DVector::zeros(own.nrows())).collect();
        Self { scaled, bend, loss: Loss::SQUARES }
    }

    /// Number of trials.
    pub fn trials(&self) -> usize {
        self.scaled.len()
    }

    /// S of one trial, samples × nuisances.
    pub fn scaled(&self, trial: usize) -> &DMatrix<f64> {
        &self.scaled[trial]
    }

    /// What is added to a residual of one trial before it is linear in the nuisances.
    pub fn bend(&self, trial: usize) -> &DVector<f64> {
        &self.bend[trial]
    }

    /// Refits the nuisances of one trial to its whitened residual.
    ///
    /// See docs/explanation/diagnosis.md (D3).
    pub fn refit(&self, trial: usize, residual: &DVector<f64>) -> Refit {
        let residual = &(residual + &self.bend[trial]);
        let s = &self.scaled[trial];
        let (n, m) = s.shape();
        let (mut estimate, mut free) = (DVector::zeros(m), Vec::new());
        let (mut phi, mut root_weight) = (residual.clone(), residual.clone());
        let mut columns = s.clone();
        let mut left = residual.clone();
        for round in 0..=ROUNDS {
            for (i, r) in left.iter().enumerate() {
                (phi[i], root_weight[i]) = self.loss.of_residual(*r);
            }
            columns.copy_from(s);
            columns.column_iter_mut().for_each(|mut own| own.component_mul_assign(&root_weight));
            if round < ROUNDS {
                (estimate, free) = bounded(&residual.component_mul(&root_weight), &columns);
                left = residual + s * &estimate;
            }
        }
        let mut augmented = DMatrix::zeros(n + m, free.len());
        augmented.rows_mut(0, n).copy_from(&columns.select_columns(&free));
        for (column, &k) in free.iter().enumerate() {
            augmented[(n + k, column)] = 1.0;
        }
        let basis = if free.is_empty() { DMatrix::zeros(n + m, 0) } else { augmented.qr().q() };
        let with_penalties = |own: &DVector<f64>| {
            DVector::from_iterator(n + m, own.iter().chain(estimate.iter()).copied())
        };
        Refit {
            residual: with_penalties(&phi),
            pull: with_penalties(&left.component_mul(&root_weight)),
            estimate: estimate.iter().copied().collect(),
            basis,
            root_weight,
        }
    }
}

/// The z that minimises |r + S z|² + |z|² within the limit, and which of them are not at it.
fn bounded(residual: &DVector<f64>, s: &DMatrix<f64>) -> (DVector<f64>, Vec<usize>) {
    let m = s.ncols();
    let mut estimate = DVector::zeros(m);
    let mut free: Vec<usize> = (0..m).collect();
    loop {
        let columns = s.select_columns(&free);
        let left = residual + s * frozen(&estimate, &free);
        let normal = columns.tr_mul(&columns) + DMatrix::identity(free.len(), free.len());
        // Symmetric with eigenvalues of at least 1.
        let z = normal.cholesky().map(|c| c.solve(&-columns.tr_mul(&left)));
        let z = z.unwrap_or_else(|| DVector::zeros(free.len()));
        for (&k, &value) in free.iter().zip(z.iter()) {
            estimate[k] = value;
        }
        let worst = free
            .iter()
            .copied()
            .max_by(|&a: &usize, &b: &usize| estimate[a].abs().total_cmp(&estimate[b].abs()));
        match worst.filter(|&k| estimate[k].abs() > NUISANCE_LIMIT) {
            Some(k) => {
                estimate[k] = NUISANCE_LIMIT.copysign(estimate[k]);
                free.retain(|&other| other != k);
            }
            None => return (estimate, free),
        }
    }
}

/// The estimates of those that are not free, 0 for the others.
fn frozen(estimate: &DVector<f64>, free: &[usize]) -> DVector<f64> {
    let mut frozen = estimate.clone();
    for &k in free {
        frozen[k] = 0.0;
    }
    frozen
}

impl Refit {
    /// What free nuisances cannot explain of columns over the samples.
    pub fn project(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let mut augmented = DMatrix::zeros(self.basis.nrows(), columns.ncols());
        let mut own = augmented.rows_mut(0, self.root_weight.len());
        own.copy_from(columns);
        own.column_iter_mut().for_each(|mut column| column.component_mul_assign(&self.root_weight));
        let explained = &self.basis * self.basis.tr_mul(&augmented);
        augmented - explained
    }

    /// The same of one column.
    pub fn project_column(&self, column: &DVector<f64>) -> DVector<f64> {
        let mut augmented = DVector::zeros(self.basis.nrows());
        augmented
            .rows_mut(0, self.root_weight.len())
            .copy_from(&column.component_mul(&self.root_weight));
        let explained = &self.basis * self.basis.tr_mul(&augmented);
        augmented - explained
    }

    /// Σ residual².
    pub fn energy(&self) -> f64 {
        self.residual.norm_squared()
    }
}

/// Indices of so many of the refits, what leaves most first.
pub fn most_left<'a>(refits: impl IntoIterator<Item = &'a Refit>, count: usize) -> Vec<usize> {
    let energies: Vec<f64> = refits.into_iter().map(Refit::energy).collect();
    let mut order: Vec<usize> = (0..energies.len()).collect();
    order.sort_by(|&a, &b| energies[b].total_cmp(&energies[a]));
    order.truncate(count);
    order
}

/// Indices of the trials that tell which effects may win: a third of them that has most of the gap left, of
/// few trials two.
pub fn telling<'a>(refits: impl ExactSizeIterator<Item = &'a Refit>) -> Vec<usize> {
    let count = refits.len().div_ceil(3).max(2);
    most_left(refits, count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::floor::Floor;
    use crate::plant::Nuisance;
    use crate::toy::Toy;

    const SAMPLES: usize = 200;

    /// The estimate of a bias of 1 standard deviation where every twentieth sample is far off.
    fn bias(loss: Loss, off: f64) -> f64 {
        let scaled = vec![DMatrix::from_element(SAMPLES, 1, -1.0)];
        let far = |i: usize| if i.is_multiple_of(20) { off } else { 0.0 };
        let residual = DVector::from_fn(SAMPLES, |i, _| 1.0 + far(i));
        let bend = vec![DVector::zeros(SAMPLES)];
        Nuisances { scaled, bend, loss }.refit(0, &residual).estimate[0]
    }

    #[test]
    fn what_is_far_off_in_a_few_samples_does_not_decide_where_a_nuisance_is() {
        let robust = |off| bias(Loss::beyond(3.0), off);
        assert!((robust(0.0) - 1.0).abs() < 0.01);
        assert!((robust(15.0) - 1.0).abs() < 0.2, "{}", robust(15.0));
        assert!((bias(Loss::SQUARES, 15.0) - 1.0).abs() > 0.5);
    }

    #[test]
    fn what_free_nuisances_do_is_projected_out_where_the_residual_ended() {
        let scaled = vec![DMatrix::from_fn(SAMPLES, 1, |i, _| 0.1 * i as f64)];
        let bend = vec![DVector::zeros(SAMPLES)];
        let nuisances = Nuisances { scaled, bend, loss: Loss::beyond(3.0) };
        let residual = DVector::from_fn(SAMPLES, |i, _| if i == 7 { 30.0 } else { 0.5 });
        let refit = nuisances.refit(0, &residual);
        let left = refit.project(nuisances.scaled(0));
        // But for what its prior holds it back.
        let whole = nuisances.scaled(0).component_mul(&refit.root_weight).norm();
        assert!(left.norm() < 0.1 * whole, "{} of {whole}", left.norm());
    }

    /// A second Gauss–Newton step: along the line at 0 alone, the estimate would be 1.81.
    #[test]
    fn a_nuisance_that_is_not_linear_is_found_where_it_is() {
        let stretched = |i: usize, z: f64| 0.01 * i as f64 * (z + 0.2 * z * z);
        let measured = (0..SAMPLES).map(|i| stretched(i, 2.0));
        let mut toy = Toy::new(0.01, 0.01, measured, |i, point| stretched(i, point.nuisances[0]));
        toy.nuisances = vec![Nuisance { name: "stretch", unit: "1", sd: 1.0, effect: None }];
        toy.cheap = false;
        let floor = Floor::of(&toy);
        let problem = Problem::new(&toy, &floor, &crate::unwatched);
        let point = Point::nominal(&toy);
        let base = problem.residuals(&point).unwrap();
        let found = Nuisances::at(&problem, &point, &base).unwrap().refit(0, &base[0]).estimate[0];
        assert!((found - 2.0).abs() < 0.05, "{found}");
    }
}
