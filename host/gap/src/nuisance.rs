//! Nuisances: refitted for every candidate, in every trial, within their priors.
//!
//! They are linear over their priors, so that refitting costs no simulation. With the whitened
//! residual r and its derivatives S, one column a nuisance over one standard deviation of its
//! prior,
//!
//! > min over z of |r + S z|² + |z|²,   |z_k| ≤ [`NUISANCE_LIMIT`]
//!
//! is a least-squares problem in the residual [r; 0] of n + m numbers. What is orthogonal to
//! the columns [S; 1] of the nuisances that are not at their limit is what is left: the
//! projection that [`Refit`] does to residuals and derivatives alike.

use nalgebra::{DMatrix, DVector};

use crate::plant::Point;
use crate::problem::{Coordinate, Problem};

/// Standard deviations of its prior within which a nuisance stays. Beyond, it is an effect.
pub const NUISANCE_LIMIT: f64 = 2.0;

/// Derivatives of the whitened residuals with respect to the nuisances, times their priors.
#[derive(Clone, Debug)]
pub struct Nuisances {
    scaled: Vec<DMatrix<f64>>,
}

/// One trial with its nuisances refitted.
#[derive(Clone, Debug)]
pub struct Refit {
    /// n whitened residuals, then m penalties.
    pub residual: DVector<f64>,
    /// Of each nuisance, in standard deviations of its prior.
    pub estimate: Vec<f64>,
    /// Orthonormal columns: what free nuisances can explain.
    basis: DMatrix<f64>,
    samples: usize,
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
        Some(Self { scaled })
    }

    /// From S of every trial, which somebody else has computed.
    pub fn of(scaled: Vec<DMatrix<f64>>) -> Self {
        Self { scaled }
    }

    /// Number of trials.
    pub fn trials(&self) -> usize {
        self.scaled.len()
    }

    /// S of one trial, samples × nuisances.
    pub fn scaled(&self, trial: usize) -> &DMatrix<f64> {
        &self.scaled[trial]
    }

    /// Refits the nuisances of one trial to its whitened residual.
    pub fn refit(&self, trial: usize, residual: &DVector<f64>) -> Refit {
        let s = &self.scaled[trial];
        let (n, m) = s.shape();
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
                None => break,
            }
        }
        let mut augmented = DMatrix::zeros(n + m, free.len());
        augmented.rows_mut(0, n).copy_from(&s.select_columns(&free));
        for (column, &k) in free.iter().enumerate() {
            augmented[(n + k, column)] = 1.0;
        }
        let basis = if free.is_empty() { DMatrix::zeros(n + m, 0) } else { augmented.qr().q() };
        let mut left = DVector::zeros(n + m);
        left.rows_mut(0, n).copy_from(&(residual + s * &estimate));
        left.rows_mut(n, m).copy_from(&estimate);
        Refit { residual: left, estimate: estimate.iter().copied().collect(), basis, samples: n }
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
        augmented.rows_mut(0, self.samples).copy_from(columns);
        let explained = &self.basis * self.basis.tr_mul(&augmented);
        augmented - explained
    }

    /// The same of one column.
    pub fn project_column(&self, column: &DVector<f64>) -> DVector<f64> {
        let mut augmented = DVector::zeros(self.basis.nrows());
        augmented.rows_mut(0, self.samples).copy_from(column);
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
