//! The share of the gap that each effect closed.

use std::collections::BTreeMap;

use crate::searching::selection::Selection;

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
    // What the last fit of all of them closes beside that, they share by what they have closed.
    let rest = selection.best.score.shrink(nominal) - closed;
    let weight = |own: f64| own.max(1e-3);
    let all: f64 = covered.values().map(|&own| weight(own)).sum();
    covered.values_mut().for_each(|own| *own += rest * weight(*own) / all);
    covered
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Plant;
    use crate::toy::{Toy, effect, explained_by, parameter};

    /// Straight data without noise.
    fn line() -> impl Plant {
        let measured = (0..400).map(|i| 2.0 * i as f64);
        let mut toy = Toy::new(0.01, 1e-3, measured, |i, point| point.effects[0][0] * i as f64);
        toy.effects = vec![effect("slope", vec![parameter("slope")], vec![vec![1.0]])];
        toy
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

    #[test]
    fn what_the_last_fit_closes_is_shared_by_all_effects() {
        let (shares, whole) = explained_by(&line(), &[0], |_, mut selection| {
            let nominal = selection.nominal.score.clone();
            // Before the last fit it had closed nothing.
            selection.path = vec![(Vec::new(), nominal.clone()), (vec![0], nominal.clone())];
            (increments(&selection), selection.best.score.shrink(&nominal))
        });
        assert!(whole > 0.9, "{whole}");
        assert!((shares.values().sum::<f64>() - whole).abs() < 1e-12, "{shares:?}");
    }
}
