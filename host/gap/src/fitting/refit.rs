//! One trial with its nuisances refitted.
//!
//! With the whitened residual r and its derivatives S, one column a nuisance over one standard deviation of its
//! prior,
//!
//! > min over z of Σ ρ(r + S z) + |z|²,   |z_k| ≤ [`NUISANCE_LIMIT`]
//!
//! is, with the weights w of the loss ρ (`loss`), a least-squares problem in the residual [√w r; 0] of
//! n + m numbers. What is orthogonal to the columns [√w S; 1] of the nuisances that are not at their
//! limit is what is left: the projection that [`Refit`] does to residuals and derivatives alike.

use nalgebra::{DMatrix, DVector};

use crate::fitting::loss::Loss;

/// Standard deviations of its prior within which a nuisance stays. Beyond, it is an effect.
pub const NUISANCE_LIMIT: f64 = 4.0;
/// Times that a residual's loss is taken as a square around where the nuisances were last.
const ROUNDS: usize = 2;

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

impl Refit {
    /// Refits nuisances with derivatives `s` (samples × nuisances) to a whitened residual that is linear in them.
    ///
    /// See docs/explanation/diagnosis.md (D3).
    pub fn of(s: &DMatrix<f64>, loss: Loss, residual: &DVector<f64>) -> Self {
        let (n, m) = s.shape();
        let (mut estimate, mut free) = (DVector::zeros(m), Vec::new());
        let (mut phi, mut root_weight) = (residual.clone(), residual.clone());
        let mut columns = s.clone();
        let mut left = residual.clone();
        for round in 0..=ROUNDS {
            for (i, r) in left.iter().enumerate() {
                (phi[i], root_weight[i]) = loss.of_residual(*r);
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
        Self {
            residual: with_penalties(&phi),
            pull: with_penalties(&left.component_mul(&root_weight)),
            estimate: estimate.iter().copied().collect(),
            basis,
            root_weight,
        }
    }

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

    /// Whether a nuisance, by index, is held back by its limit, or within a hundredth of it.
    pub fn is_at_limit(&self, nuisance: usize) -> bool {
        self.estimate[nuisance].abs() >= 0.99 * NUISANCE_LIMIT
    }

    /// Σ residual².
    pub fn energy(&self) -> f64 {
        self.residual.norm_squared()
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

    const SAMPLES: usize = 200;

    /// The estimate of a bias of 1 standard deviation where every twentieth sample is far off.
    fn bias(loss: Loss, off: f64) -> f64 {
        let scaled = DMatrix::from_element(SAMPLES, 1, -1.0);
        let far = |i: usize| if i.is_multiple_of(20) { off } else { 0.0 };
        let residual = DVector::from_fn(SAMPLES, |i, _| 1.0 + far(i));
        Refit::of(&scaled, loss, &residual).estimate[0]
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
        let scaled = DMatrix::from_fn(SAMPLES, 1, |i, _| 0.1 * i as f64);
        let residual = DVector::from_fn(SAMPLES, |i, _| if i == 7 { 30.0 } else { 0.5 });
        let refit = Refit::of(&scaled, Loss::beyond(3.0), &residual);
        let left = refit.project(&scaled);
        // But for what its prior holds it back.
        let whole = scaled.component_mul(&refit.root_weight).norm();
        assert!(left.norm() < 0.1 * whole, "{} of {whole}", left.norm());
    }
}
