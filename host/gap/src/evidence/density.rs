//! The logarithm of the density of every trial, given what the others teach of the parameters.

use nalgebra::{DMatrix, DVector};

use super::binned::BinnedTrial;

/// A parameter of a set of effects where it was fitted.
#[derive(Clone, Copy, Debug)]
pub struct Fitted {
    /// From where its effect is off.
    pub deviation: f64,
    /// Standard deviation of its prior.
    pub scale: f64,
    /// How far it may go down and up within its bounds.
    pub room: [f64; 2],
}

/// The weighted products of a trial's columns, which do not change with the prior of its nuisances.
pub struct Products {
    square: f64,
    of_residual: DVector<f64>,
    of_nuisances: DMatrix<f64>,
    of_parameters: DMatrix<f64>,
    slope: DVector<f64>,
    curvature: DMatrix<f64>,
    log_determinant: f64,
}

impl Products {
    /// `weights`: one over the variance of every bin.
    pub fn of(trial: &BinnedTrial, weights: &[f64], log_determinant: f64) -> Self {
        let weighted = |columns: &DMatrix<f64>| {
            let mut own = columns.clone();
            for mut column in own.column_iter_mut() {
                column.iter_mut().zip(weights).for_each(|(x, w)| *x *= w);
            }
            own
        };
        let (r, s, j) = (&trial.residual, &trial.nuisances, &trial.parameters);
        let (ws, wj) = (weighted(s), weighted(j));
        Self {
            square: r.iter().zip(weights).map(|(r, w)| w * r * r).sum(),
            of_residual: ws.tr_mul(r),
            of_nuisances: ws.tr_mul(s),
            of_parameters: ws.tr_mul(j),
            slope: wj.tr_mul(r),
            curvature: wj.tr_mul(j),
            log_determinant,
        }
    }

    /// The same with one parameter more, by its change of every bin.
    pub fn with(&self, trial: &BinnedTrial, weights: &[f64], column: &DVector<f64>) -> Self {
        let k = self.slope.len();
        let weighted =
            DVector::from_iterator(column.len(), column.iter().zip(weights).map(|(x, w)| x * w));
        let mut of_parameters = self.of_parameters.clone().insert_column(k, 0.0);
        of_parameters.set_column(k, &trial.nuisances.tr_mul(&weighted));
        let mut curvature = self.curvature.clone().insert_column(k, 0.0).insert_row(k, 0.0);
        for (i, both) in trial.parameters.tr_mul(&weighted).iter().enumerate() {
            curvature[(i, k)] = *both;
            curvature[(k, i)] = *both;
        }
        curvature[(k, k)] = column.dot(&weighted);
        Self {
            square: self.square,
            of_residual: self.of_residual.clone(),
            of_nuisances: self.of_nuisances.clone(),
            of_parameters,
            slope: self.slope.clone().insert_row(k, trial.residual.dot(&weighted)),
            curvature,
            log_determinant: self.log_determinant,
        }
    }
}

/// A trial whose nuisances are integrated out.
struct Marginal {
    square: f64,
    slope: DVector<f64>,
    curvature: DMatrix<f64>,
    log_determinant: f64,
}

impl Marginal {
    /// N(r + S z, 1) over z ~ N(0, ω²) has the covariance 1 + ω² S Sᵀ, whose inverse is
    /// 1 − S (ω⁻² + SᵀS)⁻¹ Sᵀ (Woodbury 1950).
    fn of(own: &Products, looseness: f64) -> Option<Self> {
        let m = own.of_residual.len();
        let inner = &own.of_nuisances + DMatrix::identity(m, m) * looseness.powi(-2);
        let factor = inner.cholesky()?;
        let solved = factor.solve(&own.of_residual);
        let log_prior = 2.0 * m as f64 * looseness.ln();
        Some(Self {
            square: own.square - own.of_residual.dot(&solved),
            slope: &own.slope - own.of_parameters.tr_mul(&solved),
            curvature: &own.curvature - own.of_parameters.tr_mul(&factor.solve(&own.of_parameters)),
            log_determinant: own.log_determinant + log_determinant(&factor) + log_prior,
        })
    }
}

/// By trial, ln p(trial | the others), but for a constant that is the same for all sets of effects.
/// `None` where the derivatives are of no use.
///
/// The parameters given the others are normally distributed about their mode within the bounds; the
/// residual is linear in them.
///
/// See docs/explanation/diagnosis.md (D11).
///
/// `looseness`: ω, the standard deviations of the nuisances in those of their priors.
pub fn log_densities(trials: &[Products], fitted: &[Fitted], looseness: f64) -> Option<Vec<f64>> {
    let k = fitted.len();
    let marginals: Vec<Marginal> =
        trials.iter().map(|own| Marginal::of(own, looseness)).collect::<Option<_>>()?;
    let mut prior = DMatrix::zeros(k, k);
    let mut pull = DVector::zeros(k);
    for (i, own) in fitted.iter().enumerate() {
        prior[(i, i)] = own.scale.powi(-2);
        pull[i] = own.deviation * prior[(i, i)];
    }
    let all = marginals.iter().fold((prior, pull), |(curvature, slope), own| {
        (curvature + &own.curvature, slope + &own.slope)
    });
    let density = |own: &Marginal| -> Option<f64> {
        let (precision, slope) = (&all.0 - &own.curvature, &all.1 - &own.slope);
        let before = precision.clone().cholesky()?;
        let mut step = before.solve(&-slope);
        for (step, own) in step.iter_mut().zip(fitted) {
            *step = step.clamp(own.room[0], own.room[1]);
        }
        let moved = &own.slope + &own.curvature * &step;
        let square = own.square + step.dot(&(&own.slope + &moved));
        let after = (precision + &own.curvature).cholesky()?;
        let spread = moved.dot(&after.solve(&moved));
        let widened = log_determinant(&after) - log_determinant(&before);
        Some(-0.5 * (square - spread + own.log_determinant + widened))
    };
    marginals.iter().map(density).collect()
}

/// Standard deviations by which the last parameter moves all trials, beyond what the others and the nuisances
/// can do. `fitted`: of the others.
pub fn distance(trials: &[Products], fitted: &[Fitted], looseness: f64) -> Option<f64> {
    let k = fitted.len();
    let marginals = trials.iter().map(|own| Marginal::of(own, looseness));
    let mut all = DMatrix::zeros(k + 1, k + 1);
    for own in marginals.collect::<Option<Vec<Marginal>>>()? {
        all += own.curvature;
    }
    for (i, own) in fitted.iter().enumerate() {
        all[(i, i)] += own.scale.powi(-2);
    }
    let others = all.view((0, 0), (k, k)).into_owned();
    let both = all.view((0, k), (k, 1)).into_owned();
    let explained = both.dot(&others.cholesky()?.solve(&both));
    Some((all[(k, k)] - explained).max(0.0).sqrt())
}

fn log_determinant(factor: &nalgebra::Cholesky<f64, nalgebra::Dyn>) -> f64 {
    2.0 * factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum::<f64>()
}
