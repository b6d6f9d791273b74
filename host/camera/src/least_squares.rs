//! Least squares by Levenberg's and Marquardt's method.
//!
//! The crate `levenberg-marquardt` asks for a nalgebra of another version, and for a dense
//! derivative of all pictures by all poses, most of which is zero. This one takes the sums of
//! squares, which each problem adds up by its own structure.
//!
//! Source: Marquardt, "An algorithm for least-squares estimation of nonlinear parameters", 1963.

use nalgebra::{DMatrix, DVector};

/// A problem near one state.
pub struct Linear {
    /// Σ JᵀJ over the residuals.
    pub square: DMatrix<f64>,
    /// Σ Jᵀr over the residuals.
    pub gradient: DVector<f64>,
    /// Σ r².
    pub cost: f64,
}

/// Residuals that depend on a state.
pub trait Problem {
    type State: Clone;
    fn linear(&self, state: &Self::State) -> Linear;
    /// The state after a step in the order of [`Linear::gradient`].
    fn moved(&self, state: &Self::State, step: &DVector<f64>) -> Self::State;
    /// Σ r²; infinite where the state is impossible.
    fn cost(&self, state: &Self::State) -> f64;
}

/// Damping at the start, in shares of the diagonal; it is found anew within a few steps.
const FIRST_DAMPING: f64 = 1e-3;
/// Less than a millionth of a millionth of the cost is rounding.
const CONVERGED: f64 = 1e-12;
const MOST_STEPS: usize = 60;
/// With so much damping no step is left that rounding does not drown.
const MOST_DAMPING: f64 = 1e12;

/// The state of least squares that is reached from `start`.
pub fn minimise<P: Problem>(problem: &P, start: P::State) -> P::State {
    let (mut state, mut damping) = (start, FIRST_DAMPING);
    for _ in 0..MOST_STEPS {
        let Linear { square, gradient, cost } = problem.linear(&state);
        let better = loop {
            let mut damped = square.clone();
            for k in 0..damped.nrows() {
                damped[(k, k)] *= 1.0 + damping;
            }
            let step = damped.cholesky().map(|factor| factor.solve(&-&gradient));
            let next = step.map(|step| problem.moved(&state, &step));
            let next = next.map(|next| (problem.cost(&next), next));
            match next {
                Some((next_cost, next)) if next_cost <= cost => break Some((next_cost, next)),
                _ if damping > MOST_DAMPING => break None,
                _ => damping *= 10.0,
            }
        };
        let Some((next_cost, next)) = better else { return state };
        state = next;
        damping *= 0.1;
        if cost - next_cost <= CONVERGED * cost {
            return state;
        }
    }
    state
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley as residuals 10 (y − x²) and 1 − x; its minimum is at (1, 1).
    struct Valley;

    impl Problem for Valley {
        type State = [f64; 2];

        fn linear(&self, [x, y]: &[f64; 2]) -> Linear {
            let jacobian = DMatrix::from_row_slice(2, 2, &[-20.0 * x, 10.0, -1.0, 0.0]);
            let residual = DVector::from_vec(vec![10.0 * (y - x * x), 1.0 - x]);
            Linear {
                square: jacobian.transpose() * &jacobian,
                gradient: jacobian.transpose() * &residual,
                cost: residual.norm_squared(),
            }
        }

        fn moved(&self, [x, y]: &[f64; 2], step: &DVector<f64>) -> [f64; 2] {
            [x + step[0], y + step[1]]
        }

        fn cost(&self, [x, y]: &[f64; 2]) -> f64 {
            (10.0 * (y - x * x)).powi(2) + (1.0 - x).powi(2)
        }
    }

    #[test]
    fn the_bottom_of_a_curved_valley_is_found() {
        let found = minimise(&Valley, [-1.2, 1.0]);
        assert!((found[0] - 1.0).abs() < 1e-8 && (found[1] - 1.0).abs() < 1e-8, "{found:?}");
    }
}
