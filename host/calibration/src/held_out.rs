//! Where a fit would have ended without some of its data, by one Gauss–Newton step from where it ended
//! with all of them: to first order exact, and without another simulation.

use nalgebra::{DMatrix, DVector};

/// Values without each of so many groups of residuals. `group`: of each residual; `None` of what stays,
/// such as a prior. `values` are those of the whole fit; a step that nothing determines is none.
pub fn without_each(
    values: &[f64],
    jacobian: &DMatrix<f64>,
    residuals: &[f64],
    group: &[Option<usize>],
    groups: usize,
) -> Vec<Vec<f64>> {
    let without = |left_out: usize| {
        let n = values.len();
        let (mut normal, mut pull) = (DMatrix::zeros(n, n), DVector::zeros(n));
        for (i, (r, own)) in residuals.iter().zip(group).enumerate() {
            if *own != Some(left_out) {
                let row = jacobian.row(i).transpose();
                pull += &row * *r;
                normal += &row * row.transpose();
            }
        }
        let step = normal.cholesky().map(|own| own.solve(&-pull));
        let step = step.filter(|step| step.iter().all(|own| own.is_finite()));
        let step = step.unwrap_or_else(|| DVector::zeros(n));
        values.iter().zip(step.iter()).map(|(value, step)| value + step).collect()
    };
    (0..groups).map(without).collect()
}

/// Variances by the jackknife (Tukey 1958), (n − 1)/n Σ (θ_g − θ̄)², from the values without each of n
/// groups; 0 for fewer than two.
pub fn jackknife(without_each: &[Vec<f64>]) -> Vec<f64> {
    let (n, count) = (without_each.len() as f64, without_each.first().map_or(0, Vec::len));
    let variance = |k: usize| {
        let mean = without_each.iter().map(|own| own[k]).sum::<f64>() / n;
        let squares = without_each.iter().map(|own| (own[k] - mean).powi(2)).sum::<f64>();
        (n - 1.0) / n * squares
    };
    (0..count).map(variance).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_without_one_value_is_that_of_the_others() {
        let measured = [1.0, 2.0, 4.0, 9.0];
        let residuals: Vec<f64> = measured.iter().map(|y| y - 4.0).collect();
        let jacobian = DMatrix::from_element(4, 1, -1.0);
        let groups: Vec<Option<usize>> = (0..4).map(Some).collect();
        let found = without_each(&[4.0], &jacobian, &residuals, &groups, 4);
        for (own, expected) in found.iter().zip([5.0, 14.0 / 3.0, 4.0, 7.0 / 3.0]) {
            assert!((own[0] - expected).abs() < 1e-12, "{own:?}");
        }
        // The jackknife's variance of a mean is s²/n.
        let variance = measured.iter().map(|y| (y - 4.0_f64).powi(2)).sum::<f64>() / 3.0 / 4.0;
        assert!((jackknife(&found)[0] - variance).abs() < 1e-12);
        let nothing = without_each(&[4.0], &DMatrix::zeros(4, 1), &residuals, &groups, 4);
        assert_eq!((nothing[0][0], jackknife(&[])), (4.0, Vec::new()));
    }
}
