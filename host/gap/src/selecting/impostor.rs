//! Causes outside the library that an effect of the library may be mistaken for.
//!
//! An effect and its impostor act along different variables: a sensor bias that drifts with time resembles
//! a cable that is drawn along with the feed. To first order both act like some nuisance parameters, so
//! both are fitted without a simulation, and the data decide:
//!
//! > min over a, z of |r + S z + Σ_k a_k S_k u|² + |z|²,   u: length fed
//!
//! with the whitened residual r without the effect, and the derivatives S with respect to the nuisance
//! parameters (`nuisance`).

use nalgebra::{DMatrix, DVector};

use crate::fitting::nuisance::{Nuisances, Refit};
use crate::fitting::problem::Problem;
use crate::plant::Impostor;
use crate::scoring::criteria::EVIDENCE;
use crate::selecting::selection::Selection;

/// Rounds in which the nuisances that are at their limits settle.
const ROUNDS: usize = 4;

/// A named effect that something else explains better than it does, and what.
pub fn unmasked(problem: &Problem<'_>, selection: &Selection) -> Option<(usize, &'static str)> {
    let nuisances = selection.nuisances.as_ref()?;
    let best = &selection.best;
    best.fit.effects.iter().find_map(|&effect| {
        let impostor = problem.plant.impostor(effect)?;
        let mut off = best.fit.point.clone();
        let values = problem.plant.effects()[effect].parameters.iter().map(|p| p.off);
        off.effects[effect] = values.collect();
        let left = left(problem, nuisances, &impostor, problem.residuals(&off)?)?;
        let own: f64 = best.fit.trials.iter().map(|trial| trial.refit.energy()).sum();
        let evidence = best.score.effective * (own / left).ln();
        (evidence > EVIDENCE).then_some((effect, impostor.what))
    })
}

/// Σ residual² over all trials that a cause leaves, at its best.
fn left(
    problem: &Problem<'_>,
    nuisances: &Nuisances,
    impostor: &Impostor,
    mut raw: Vec<DVector<f64>>,
) -> Option<f64> {
    let columns: Vec<DMatrix<f64>> =
        problem.trials().iter().map(|&trial| does(problem, nuisances, impostor, trial)).collect();
    let k = impostor.nuisances.len();
    for _ in 0..ROUNDS {
        let (mut normal, mut slope) = (DMatrix::zeros(k, k), DVector::zeros(k));
        for (trial, columns) in columns.iter().enumerate() {
            let refit = nuisances.refit(trial, &raw[trial]);
            let free = refit.project(columns);
            normal += free.tr_mul(&free);
            slope -= free.tr_mul(&refit.pull);
        }
        let sizes = normal.cholesky()?.solve(&slope);
        for (raw, columns) in raw.iter_mut().zip(&columns) {
            *raw += columns * &sizes;
        }
    }
    let refits = raw.iter().enumerate().map(|(trial, raw)| nuisances.refit(trial, raw));
    Some(refits.map(|refit: Refit| refit.energy()).sum())
}

/// S_k u of one trial.
fn does(
    problem: &Problem<'_>,
    nuisances: &Nuisances,
    impostor: &Impostor,
    trial: usize,
) -> DMatrix<f64> {
    let own = &problem.plant.trials()[trial];
    let scaled = nuisances.scaled(trial);
    DMatrix::from_fn(own.samples.len(), impostor.nuisances.len(), |i, c| {
        scaled[(i, impostor.nuisances[c])] * impostor.along.of(own, i)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{Along, Nuisance, Point};
    use crate::toy::{Toy, effect, explained_by, noise, parameter};

    const SAMPLES: usize = 400;
    const STEP_S: f64 = 0.01;
    const NOISE: f64 = 0.01;

    fn time_s(i: usize) -> f64 {
        STEP_S * i as f64
    }

    /// Forward for three quarters of the time, and back.
    fn fed_m(i: usize) -> f64 {
        let back = i.saturating_sub(3 * SAMPLES / 4);
        1e-3 * (i as f64 - 2.0 * back as f64)
    }

    /// Whether a drift is unmasked where a force was put in that grows like this.
    fn is_unmasked(force: impl Fn(usize) -> f64) -> bool {
        let measured = (0..SAMPLES).map(|i| force(i) + NOISE * noise(i));
        let predict =
            |i: usize, point: &Point| point.nuisances[0] + point.effects[0][0] * time_s(i);
        let mut toy = Toy::new(STEP_S, NOISE, measured, predict).fed(fed_m);
        toy.effects = vec![effect("drift", vec![parameter("slope")], vec![vec![1.0]])];
        toy.nuisances = vec![Nuisance { name: "bias", unit: "N", sd: 0.1, effect: None }];
        toy.impostor = Some(Impostor { nuisances: vec![0], along: Along::Feed, what: "a cable" });
        explained_by(&toy, &[0], |selector, selection| {
            let found = unmasked(selector.problem, &selection);
            assert!(found.is_none_or(|found| found == (0, "a cable")));
            found.is_some()
        })
    }

    #[test]
    fn a_force_that_follows_the_feed_is_no_drift() {
        assert!(is_unmasked(|i| 3.0 * fed_m(i)));
        assert!(is_unmasked(|i| 3.0 * fed_m(i) + 0.05));
    }

    #[test]
    fn a_drift_is_one_even_if_it_bends() {
        assert!(!is_unmasked(|i| 0.5 * time_s(i)));
        assert!(!is_unmasked(|i| 1.0 - (-0.5 * time_s(i)).exp()));
        assert!(!is_unmasked(|_| 0.0));
    }
}
