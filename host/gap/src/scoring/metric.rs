//! Distances between predictions in units of what the data can tell.
//!
//! > C = σ_eff² I + S Sᵀ,   σ_eff² = E (1 + 2 Σ ρ_k)
//!
//! Whitened samples scatter by the energy E that the best model leaves, and neighbours repeat
//! each other; nuisances scatter by their priors, which no correlation widens. Inner products
//! aᵀ C⁻¹ b over the trials give curvatures, intervals and isolation distances.

use nalgebra::{DMatrix, DVector};

use crate::fitting::nuisance::Nuisances;
use crate::scoring::score::Score;

/// C⁻¹ of every trial.
pub struct Metric<'a> {
    variance: f64,
    nuisances: &'a Nuisances,
    /// (σ_eff² I + SᵀS)⁻¹ by trial.
    inverse: Vec<DMatrix<f64>>,
}

impl<'a> Metric<'a> {
    /// `best`: the score of the model whose leftover is taken for noise.
    pub fn new(nuisances: &'a Nuisances, best: &Score) -> Self {
        let samples = best.samples as f64;
        let repeated = (samples / best.effective.max(1.0)).max(1.0);
        Self::with(nuisances, best.energy.max(1.0) * repeated)
    }

    /// `variance`: σ_eff².
    pub fn with(nuisances: &'a Nuisances, variance: f64) -> Self {
        let inverse = (0..nuisances.trials()).map(|trial| {
            let s = nuisances.scaled(trial);
            let inner = s.tr_mul(s) + DMatrix::identity(s.ncols(), s.ncols()) * variance;
            // Symmetric, with eigenvalues of at least the variance.
            inner.cholesky().map_or_else(|| DMatrix::zeros(s.ncols(), s.ncols()), |c| c.inverse())
        });
        Self { variance, nuisances, inverse: inverse.collect() }
    }

    /// Aᵀ C⁻¹ B of one trial, columns over its samples.
    pub fn inner(&self, trial: usize, a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
        let s = self.nuisances.scaled(trial);
        let through = a.tr_mul(s) * &self.inverse[trial] * s.tr_mul(b);
        (a.tr_mul(b) - through) / self.variance
    }

    /// Distance of a prediction, by trial, from what columns can do.
    ///
    /// See docs/explanation/diagnosis.md (D15).
    pub fn distance(&self, own: &[DVector<f64>], span: &[DMatrix<f64>]) -> f64 {
        let mut sums = Projection::new(span.first().map_or(0, DMatrix::ncols));
        for (trial, (own, span)) in own.iter().zip(span).enumerate() {
            let own = DMatrix::from_columns(std::slice::from_ref(own));
            sums.add(
                &self.inner(trial, span, span),
                &self.inner(trial, span, &own),
                self.inner(trial, &own, &own)[(0, 0)],
            );
        }
        sums.distance()
    }
}

/// Sums of a least-squares projection of one column on others.
pub struct Projection {
    normal: DMatrix<f64>,
    cross: DVector<f64>,
    power: f64,
}

/// Columns that differ by less than the square root of this count as equal.
const EQUAL: f64 = 1e-10;

impl Projection {
    pub fn new(columns: usize) -> Self {
        let (normal, cross) = (DMatrix::zeros(columns, columns), DVector::zeros(columns));
        Self { normal, cross, power: 0.0 }
    }

    pub fn add(&mut self, normal: &DMatrix<f64>, cross: &DMatrix<f64>, power: f64) {
        self.normal += normal;
        self.cross += cross.column(0);
        self.power += power;
    }

    /// Length of what the columns cannot do.
    pub fn distance(mut self) -> f64 {
        let k = self.cross.len();
        // Columns of any size, and some of them zero or equal.
        let size: Vec<f64> =
            (0..k).map(|i| self.normal[(i, i)].max(0.0).sqrt().max(f64::MIN_POSITIVE)).collect();
        for i in 0..k {
            for j in 0..k {
                self.normal[(i, j)] /= size[i] * size[j];
            }
            self.cross[i] /= size[i];
            self.normal[(i, i)] += EQUAL;
        }
        let solved = self.normal.cholesky().map(|c| c.solve(&self.cross));
        let explained = solved.map_or(0.0, |x| self.cross.dot(&x));
        (self.power - explained).max(0.0).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_is_as_far_as_what_the_others_lack() {
        let span = DMatrix::from_row_slice(3, 2, &[1.0, 2.0, 0.0, 0.0, 0.0, 0.0]);
        let own = DMatrix::from_row_slice(3, 1, &[5.0, 3.0, 4.0]);
        let mut sums = Projection::new(2);
        sums.add(&span.tr_mul(&span), &span.tr_mul(&own), own.norm_squared());
        assert!((sums.distance() - 5.0).abs() < 1e-6, "3 and 4 are left");
    }
}
