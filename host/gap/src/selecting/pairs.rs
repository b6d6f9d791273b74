//! Pairs of effects: screened linearly, and the best of them refitted.

use std::collections::BTreeMap;

use nalgebra::DVector;

use crate::fitting::fit::{Depth, Start};
use crate::fitting::nuisance::Nuisances;
use crate::parallel::{each, each_some};
use crate::scoring::candidate::Candidate;
use crate::scoring::criteria::{Parsimony, by_cost};
use crate::selecting::select::Selector;
use crate::selecting::selection::{Rival, Selection, Shown, Step};

/// Pairs that are tried, and of them those that are fitted to the end where simulations cost
/// something.
const REFITTED_PAIRS: usize = 8;
const FITTED_PAIRS: usize = 3;
/// Loss over the least one from which on a pair is not: what a brief fit had left so far behind, the end of it
/// hardly changes.
const FAR_BEHIND: f64 = 1.4;

impl Selector<'_> {
    /// The best pair, if it pays more than the best single effect.
    pub fn pairs(&self, selection: &mut Selection, nuisances: &Nuisances) {
        let pairs = self.screen_pairs(selection);
        // What a nuisance does beside a strong effect is not what it does beside none.
        let own = self.nuisances_of_better(selection, &pairs);
        let at = |pair: [usize; 2]| {
            better_of(selection, pair).and_then(|(effect, _)| own.get(&effect)).unwrap_or(nuisances)
        };
        let fitted = |pair: [usize; 2]| -> Option<([usize; 2], Candidate)> {
            let ((_, better), nuisances) = (better_of(selection, pair)?, at(pair));
            let mut start = selection.nominal.fit.point.clone();
            start.anchor.clone_from(&better.fit.point.anchor);
            for effect in pair {
                if let Some(shown) = &selection.shown[effect] {
                    start.effects[effect].clone_from(&shown.point.effects[effect]);
                }
            }
            // From both switched on, or from the better of the two alone.
            let joint = self.candidate(Depth::Brief, nuisances, Start::Point(&start), &pair, None);
            let candidate = match joint {
                Some(joint) if joint.fit.loss <= better.fit.loss => Some(joint),
                _ => {
                    let start = Start::Fit(&better.fit);
                    self.candidate(Depth::Brief, nuisances, start, &pair, None)
                }
            };
            Some((pair, candidate.filter(|c| !c.fit.failed)?))
        };
        let mut found = each_some(&pairs, |pair| fitted(*pair));
        found.sort_by(|(_, a), (_, b)| a.fit.loss.total_cmp(&b.fit.loss));
        if !self.problem.plant.cheap() {
            let ended = |(pair, brief): &mut ([usize; 2], Candidate)| {
                let start = Start::Fit(&brief.fit);
                if let Some(whole) = self.candidate(Depth::Whole, at(*pair), start, pair, None) {
                    *brief = whole;
                }
            };
            let least = found.first().map_or(0.0, |(_, brief)| brief.fit.loss);
            let near = found.iter().filter(|(_, c)| c.fit.loss <= FAR_BEHIND * least).count();
            each(found.iter_mut().take(near.min(FITTED_PAIRS)), ended);
        }
        // In the order of what they promise, which one at a fork says more about than a brief fit.
        let of = |pair: &[usize; 2]| found.iter().find(|(own, _)| own == pair);
        let promising = pairs.iter().filter_map(of).map(|(_, candidate)| candidate.clone());
        selection.pairs = promising.collect();
        found.sort_by_key(|(pair, _)| *pair);
        by_cost(
            self.problem.plant,
            selection.nominal.score.excess(),
            &mut found,
            |(_, candidate)| candidate,
        );
        let Some((pair, best)) = found.first() else { return };
        let already = selection.best.fit.effects.clone();
        let added: Vec<usize> = pair.iter().copied().filter(|e| !already.contains(e)).collect();
        let parameters = added.iter().map(|&e| self.parameters(e)).sum();
        let parsimony = Parsimony::of(self.problem.plant, &selection.nominal.score);
        if !parsimony.pays(&selection.best.score, &best.score, parameters) {
            return;
        }
        let rivals = |effect: usize| {
            let with = found.iter().filter(move |(p, _)| !p.contains(&effect));
            let partner = pair.iter().copied().find(|&e| e != effect);
            with.filter_map(|(p, c)| {
                let shared = p.iter().any(|e| Some(*e) == partner);
                let other = p.iter().copied().find(|e| Some(*e) != partner)?;
                shared.then(|| Rival::of(other, c))
            })
            .collect()
        };
        let steps: Vec<Step> =
            pair.iter().map(|&effect| Step::of(effect, best, rivals(effect))).collect();
        selection.steps.retain(|step| pair.contains(&step.effect));
        for step in steps {
            if !selection.steps.iter().any(|known| known.effect == step.effect) {
                selection.steps.push(step);
            }
        }
        selection.path.push((pair.to_vec(), best.score.clone()));
        selection.best = best.clone();
    }

    /// Nuisances linearised at the better single effect of every pair, by that effect. Where
    /// simulations cost nothing, every fit linearises them where it ends.
    fn nuisances_of_better(
        &self,
        selection: &Selection,
        pairs: &[[usize; 2]],
    ) -> BTreeMap<usize, Nuisances> {
        let mut own = BTreeMap::new();
        if self.problem.plant.cheap() {
            return own;
        }
        for (effect, single) in pairs.iter().filter_map(|pair| better_of(selection, *pair)) {
            if !own.contains_key(&effect)
                && let Some(nuisances) = self.nuisances_at(&single.fit)
            {
                own.insert(effect, nuisances);
            }
        }
        own
    }

    /// Pairs whose linear combination explains most of the nominal residual: of all trials, and of
    /// what each of them has, because one that whips at a fork has more than all others.
    fn screen_pairs(&self, selection: &Selection) -> Vec<[usize; 2]> {
        let trials = &selection.nominal.fit.trials;
        let column = |shown: &Shown| -> Vec<DVector<f64>> {
            let pairs = trials.iter().zip(&shown.does);
            pairs.map(|(off, does)| off.refit.project_column(does)).collect()
        };
        let columns: Vec<Option<Vec<DVector<f64>>>> =
            selection.shown.iter().map(|shown| shown.as_ref().map(column)).collect();
        let residual: Vec<DVector<f64>> =
            trials.iter().map(|trial| trial.refit.pull.clone()).collect();
        let alike = vec![1.0; trials.len()];
        let by_own = trials.iter().map(|trial| trial.raw.len() as f64 / trial.refit.energy());
        let [of_all, of_each] =
            [alike, by_own.collect()].map(|weights| ranked(&columns, &residual, &weights));
        let mut pairs: Vec<[usize; 2]> = Vec::new();
        for pair in of_all.into_iter().zip(of_each).flat_map(|(a, b)| [a, b]) {
            if !pairs.contains(&pair) {
                pairs.push(pair);
            }
        }
        pairs.truncate(REFITTED_PAIRS);
        pairs
    }
}

/// All pairs of columns, by trial, what explains most of a residual first. `weights`: of the trials.
fn ranked(
    columns: &[Option<Vec<DVector<f64>>>],
    residual: &[DVector<f64>],
    weights: &[f64],
) -> Vec<[usize; 2]> {
    let dot = |a: &[DVector<f64>], b: &[DVector<f64>]| -> f64 {
        a.iter().zip(b).zip(weights).map(|((x, y), weight)| weight * x.dot(y)).sum()
    };
    let mut explained = Vec::new();
    for (a, first) in columns.iter().enumerate() {
        for (b, second) in columns.iter().enumerate().skip(a + 1) {
            let (Some(first), Some(second)) = (first, second) else { continue };
            let (aa, ab, bb) = (dot(first, first), dot(first, second), dot(second, second));
            let (ar, br) = (dot(first, residual), dot(second, residual));
            let determinant = aa * bb - ab * ab;
            if determinant > 1e-9 * aa * bb {
                let gain = (bb * ar * ar - 2.0 * ab * ar * br + aa * br * br) / determinant;
                explained.push((gain, [a, b]));
            }
        }
    }
    explained.sort_by(|a, b| b.0.total_cmp(&a.0));
    explained.into_iter().map(|(_, pair)| pair).collect()
}

/// The one of two effects that explains more alone, with its fit.
fn better_of(selection: &Selection, pair: [usize; 2]) -> Option<(usize, &Candidate)> {
    let fitted = |effect: usize| Some((effect, selection.singles[effect].as_ref()?));
    let found = pair.into_iter().filter_map(fitted);
    found.min_by(|(_, a), (_, b)| a.fit.loss.total_cmp(&b.fit.loss))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trial_that_has_most_of_the_gap_does_not_decide_alone_which_pair_is_promising() {
        // Three calm trials have what the first two columns do, one that whips has what the third
        // does.
        let along = |k: usize| DVector::from_fn(3, |i, _| f64::from(u8::from(i == k)));
        let calm = |k: usize| [vec![along(k); 3], vec![DVector::zeros(3)]].concat();
        let columns = [
            Some(calm(0)),
            Some(calm(1)),
            Some([vec![DVector::zeros(3); 3], vec![along(2)]].concat()),
            None,
        ];
        let own = along(0) + along(1);
        let residual = [vec![own; 3], vec![along(2) * 100.0]].concat();
        let energy = [2.0, 2.0, 2.0, 1e4];
        let first = |weights: &[f64]| ranked(&columns, &residual, weights)[0];
        assert!(first(&[1.0; 4]).contains(&2));
        assert_eq!(first(&energy.map(|energy| 3.0 / energy)), [0, 1]);
    }
}
