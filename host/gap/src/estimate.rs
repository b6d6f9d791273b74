//! Numbers of the named effects: parameters with intervals, and what each effect closed.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use crate::metric::Metric;
use crate::plant::Plant;
use crate::problem::{Coordinate, Problem};
use crate::report::Estimate;
use crate::select::{Candidate, Selection};

/// Standard deviations over those that the curvature tells, for what the model's shapes leave open.
const WIDER: f64 = 2.5;
/// Standard deviation, in scales of a parameter's prior, that any model of the mechanics leaves open:
/// in bundles of another simulator most of what was put in lies that near (docs/gap.md).
const OTHER_MODEL: f64 = 0.02;
/// Half width of the interval that holds nine of ten, in standard deviations.
pub const NORMAL_NINETY: f64 = 1.645;

/// Values of one effect's parameters with their intervals, by name.
pub fn parameters(
    plant: &dyn Plant,
    best: &Candidate,
    effect: usize,
    spread: &DVector<f64>,
) -> BTreeMap<String, Estimate> {
    let own = best.fit.coordinates.iter().zip(spread.iter());
    own.filter_map(|(coordinate, sd)| match *coordinate {
        Coordinate::Effect { effect: e, parameter } if e == effect => {
            let p = &plant.effects()[e].parameters[parameter];
            let value = best.fit.point.effects[e][parameter];
            let (low, high) = (value - NORMAL_NINETY * sd, value + NORMAL_NINETY * sd);
            let (low, high) = (low.max(p.low), high.min(p.high));
            Some((p.name.to_owned(), Estimate { value, low, high, unit: p.unit }))
        }
        _ => None,
    })
    .collect()
}

/// Standard deviations of the parameters.
pub fn spread(problem: &Problem<'_>, best: &Candidate, metric: &Metric<'_>) -> DVector<f64> {
    posterior(problem, best, metric).diagonal().map(f64::sqrt)
}

/// Covariance of the parameters: from the curvature of the loss, and what models leave open.
pub fn posterior(problem: &Problem<'_>, best: &Candidate, metric: &Metric<'_>) -> DMatrix<f64> {
    let mut posterior = covariance(problem, best, metric) * WIDER.powi(2);
    for (i, coordinate) in best.fit.coordinates.iter().enumerate() {
        if let Coordinate::Effect { effect, parameter } = *coordinate {
            let open = OTHER_MODEL * problem.parameter(effect, parameter).scale;
            posterior[(i, i)] += open.powi(2);
        }
    }
    posterior
}

/// The same from the curvature alone.
fn covariance(problem: &Problem<'_>, best: &Candidate, metric: &Metric<'_>) -> DMatrix<f64> {
    let k = best.fit.coordinates.len();
    let mut normal = DMatrix::<f64>::zeros(k, k);
    for (t, trial) in best.fit.trials.iter().enumerate() {
        normal += metric.inner(t, &trial.raw_jacobian, &trial.raw_jacobian);
    }
    for (i, coordinate) in best.fit.coordinates.iter().enumerate() {
        if let Coordinate::Effect { effect, parameter } = *coordinate {
            normal[(i, i)] += problem.parameter(effect, parameter).scale.powi(-2);
        }
    }
    normal.cholesky().map_or_else(|| DMatrix::zeros(k, k), |c| c.inverse())
}

/// How much of the gap each effect closed when it was added.
pub fn increments(selection: &Selection) -> BTreeMap<usize, f64> {
    let (best, nominal) = (&selection.best.fit.effects, &selection.nominal.score);
    let alone = |effect: usize| {
        selection.singles[effect].as_ref().map_or(0.0, |single| single.score.shrink(nominal))
    };
    let (mut covered, mut closed) = (BTreeMap::new(), 0.0);
    for (effects, score) in &selection.path {
        let grows =
            effects.iter().all(|e| best.contains(e)) && covered.keys().all(|e| effects.contains(e));
        let mut added: Vec<usize> =
            effects.iter().copied().filter(|e| !covered.contains_key(e)).collect();
        if !grows {
            continue;
        }
        let shrink = score.shrink(nominal);
        if added.is_empty() {
            // The only one, fitted once more.
            if let [only] = effects[..] {
                covered.insert(only, shrink);
                closed = shrink;
            }
            continue;
        }
        if covered.is_empty() {
            // Of two that came together, the one that does more alone came first.
            added.sort_by(|&a, &b| alone(b).total_cmp(&alone(a)));
            for (i, &effect) in added.iter().enumerate() {
                let after = if i + 1 == added.len() { shrink } else { alone(effect).min(shrink) };
                covered.insert(effect, after - closed);
                closed = after;
            }
        } else {
            // Beside others, they share what they closed as they would close it alone.
            let weight = |effect: usize| alone(effect).max(1e-3);
            let all: f64 = added.iter().map(|&effect| weight(effect)).sum();
            let shared = added.iter().map(|&e| (e, (shrink - closed) * weight(e) / all));
            covered.extend(shared.collect::<Vec<_>>());
            closed = shrink;
        }
    }
    covered
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::toy::{Toy, effect, explained_by, parameter};

    /// Straight data without noise, whose slope the curvature tells far better than any model does.
    fn line() -> impl Plant {
        let measured = (0..400).map(|i| 2.0 * i as f64);
        let mut toy = Toy::new(0.01, 1e-3, measured, |i, point| point.effects[0][0] * i as f64);
        toy.effects = vec![effect("slope", vec![parameter("slope")], vec![vec![1.0]])];
        toy
    }

    #[test]
    fn an_interval_is_no_narrower_than_models_differ() {
        let sd = explained_by(&line(), &[0], |selector, selection| {
            let metric = Metric::new(selection.nuisances.as_ref().unwrap(), &selection.best.score);
            assert!(covariance(selector.problem, &selection.best, &metric)[(0, 0)].sqrt() < 1e-3);
            spread(selector.problem, &selection.best, &metric)[0]
        });
        let least = OTHER_MODEL * parameter("slope").scale;
        assert!(sd >= least && sd < 1.1 * least, "{sd}");
    }

    #[test]
    fn an_effect_that_was_fitted_once_more_closes_what_it_closed_last() {
        let closed = explained_by(&line(), &[0], |_, mut selection| {
            let (nominal, best) = (selection.nominal.score.clone(), selection.best.score.clone());
            selection.path = vec![(vec![0], nominal), (vec![0], best)];
            increments(&selection)[&0]
        });
        assert!(closed > 0.9, "{closed}");
    }
}
