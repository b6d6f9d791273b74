//! How well the data tell the parameters: intervals, and pairs that they cannot tell apart.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

/// Standard deviations of a normal distribution on either side within which nine of ten lie.
pub const NINETY: f64 = 1.6449;
/// Two parameters whose errors go together this closely are told from each other by a tenth of what tells
/// either of them: 1 − r² is the share of a parameter's information that is left beside the other.
const TOGETHER: f64 = 0.95;

/// Two parameters of which the data tell a combination only.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pair {
    pub first: usize,
    pub second: usize,
    /// Of their errors, from −1 to 1.
    pub correlation: f64,
}

/// Standard deviations and correlations of fitted parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Certainty {
    /// In the units of the parameters; infinite where the data say nothing.
    pub sd: Vec<f64>,
    pub covariance: DMatrix<f64>,
    /// Of the derivatives over the scales of the parameters, the largest first: 1 means that a change by
    /// one scale moves the residuals by one standard deviation in all.
    pub singular_values: Vec<f64>,
    pub pairs: Vec<Pair>,
}

impl Certainty {
    /// From the derivatives J of residuals r, in standard deviations of the noise.
    ///
    /// > cov = (JᵀJ + P)⁻¹ (Σ_c g_c g_cᵀ + P) (JᵀJ + P)⁻¹,   g_c = Σ_{i in c} J_i r_i
    ///
    /// over clusters c of residuals whose errors may go together, such as a second of a trial (Liang and
    /// Zeger 1986), but no less than the (JᵀJ + P)⁻¹ of independent ones. `cluster`: of each residual;
    /// `scales`: by parameter, how large a change is plausible; `prior`: whether that is knowledge, P =
    /// diag(scale⁻²), or only a unit, P = 0.
    pub fn of(
        jacobian: &DMatrix<f64>,
        residuals: &[f64],
        cluster: &[usize],
        scales: &[f64],
        prior: bool,
    ) -> Self {
        let n = scales.len();
        // In scales of the parameters, so that their units do not matter.
        let scaled = DMatrix::from_fn(jacobian.nrows(), n, |i, k| jacobian[(i, k)] * scales[k]);
        let penalty = DMatrix::identity(n, n) * if prior { 1.0 } else { 0.0 };
        let normal = scaled.tr_mul(&scaled) + &penalty;
        let inverse = inverse(&normal);
        let meat = clustered(&scaled, residuals, cluster) + &penalty;
        let robust = &inverse * meat * &inverse;
        let mut covariance = inverse.clone();
        for k in 0..n {
            let wider = (robust[(k, k)] / inverse[(k, k)]).max(1.0).sqrt();
            if wider.is_finite() {
                covariance.row_mut(k).scale_mut(wider);
                covariance.column_mut(k).scale_mut(wider);
            }
        }
        let pairs = pairs(&inverse);
        let mut singular_values: Vec<f64> =
            scaled.svd(false, false).singular_values.iter().copied().collect();
        singular_values.sort_by(|a, b| b.total_cmp(a));
        let covariance = DMatrix::from_fn(n, n, |i, k| covariance[(i, k)] * scales[i] * scales[k]);
        let sd = covariance.diagonal().iter().map(|own| own.sqrt()).collect();
        Self { sd, covariance, singular_values, pairs }
    }
}

/// Σ_c g_c g_cᵀ over the clusters, for so few of them that their number counts.
fn clustered(jacobian: &DMatrix<f64>, residuals: &[f64], cluster: &[usize]) -> DMatrix<f64> {
    let n = jacobian.ncols();
    let count = cluster.iter().max().map_or(0, |last| last + 1);
    let mut pulls = vec![DVector::zeros(n); count];
    for (i, (r, c)) in residuals.iter().zip(cluster).enumerate() {
        pulls[*c] += jacobian.row(i).transpose() * *r;
    }
    let few = count as f64 / (count as f64 - 1.0).max(1.0);
    pulls.iter().fold(DMatrix::zeros(n, n), |sum, own| sum + own * own.transpose()) * few
}

/// Of a symmetric matrix; a direction without curvature has a variance so large that it counts as
/// infinite.
fn inverse(normal: &DMatrix<f64>) -> DMatrix<f64> {
    /// Curvature below this share of the largest one is rounding.
    const ROUNDING: f64 = 1e-14;
    let eigen = normal.clone().symmetric_eigen();
    let most = eigen.eigenvalues.max();
    let variances = eigen.eigenvalues.map(|own| 1.0 / own.max(ROUNDING * most).max(1e-30));
    &eigen.eigenvectors * DMatrix::from_diagonal(&variances) * eigen.eigenvectors.transpose()
}

fn pairs(covariance: &DMatrix<f64>) -> Vec<Pair> {
    let n = covariance.nrows();
    let correlation =
        |i: usize, k: usize| covariance[(i, k)] / (covariance[(i, i)] * covariance[(k, k)]).sqrt();
    let all = (0..n).flat_map(|first| (first + 1..n).map(move |second| (first, second)));
    let mut pairs: Vec<Pair> = all
        .map(|(first, second)| Pair { first, second, correlation: correlation(first, second) })
        .filter(|pair| pair.correlation.abs() > TOGETHER)
        .collect();
    pairs.sort_by(|a, b| b.correlation.abs().total_cmp(&a.correlation.abs()));
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line with two parameters over u from −1 to 1.
    fn line(columns: impl Fn(f64) -> [f64; 2]) -> DMatrix<f64> {
        DMatrix::from_fn(201, 2, |i, k| columns(i as f64 / 100.0 - 1.0)[k])
    }

    #[test]
    fn a_straight_line_has_the_standard_deviations_of_the_textbook() {
        let jacobian = line(|u| [1.0, u]);
        let one_each: Vec<usize> = (0..201).collect();
        // Independent residuals of size 1, alternating, which pull at nothing.
        let residuals: Vec<f64> = (0..201).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let found = Certainty::of(&jacobian, &residuals, &one_each, &[1.0, 1.0], false);
        let squares: f64 = (0..201).map(|i| (i as f64 / 100.0 - 1.0).powi(2)).sum();
        assert!((found.sd[0] - (1.0_f64 / 201.0).sqrt()).abs() < 1e-3, "{:?}", found.sd);
        assert!((found.sd[1] - (1.0 / squares).sqrt()).abs() < 1e-3, "{:?}", found.sd);
        assert!(found.pairs.is_empty());
    }

    #[test]
    fn residuals_that_go_together_widen_an_interval() {
        let jacobian = line(|u| [1.0, u]);
        let residuals: Vec<f64> =
            (0..201).map(|i| if (i / 20) % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let cluster = |width: usize| (0..201).map(|i| i / width).collect::<Vec<_>>();
        let alone = Certainty::of(&jacobian, &residuals, &cluster(1), &[1.0, 1.0], false);
        let together = Certainty::of(&jacobian, &residuals, &cluster(20), &[1.0, 1.0], false);
        // Twenty that are alike tell as much as one.
        assert!((together.sd[0] / alone.sd[0] / 20.0_f64.sqrt() - 1.0).abs() < 0.2);
    }

    #[test]
    fn parameters_that_do_the_same_are_a_pair() {
        let jacobian = line(|u| [1.0 + 0.01 * u, 1.0]);
        let one_each: Vec<usize> = (0..201).collect();
        let found = Certainty::of(&jacobian, &[0.0; 201], &one_each, &[1.0, 1.0], false);
        assert_eq!((found.pairs[0].first, found.pairs[0].second), (0, 1));
        assert!(found.pairs[0].correlation < -0.99, "{:?}", found.pairs);
        assert!(found.singular_values[0] > 100.0 * found.singular_values[1]);
        // What does nothing at all is known by its prior only.
        let idle = line(|_| [1.0, 0.0]);
        let found = Certainty::of(&idle, &[0.0; 201], &one_each, &[1.0, 0.3], true);
        assert!((found.sd[1] - 0.3).abs() < 1e-9, "{:?}", found.sd);
    }
}
