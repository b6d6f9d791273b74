//! Two effects at once: screened linearly, the best refitted.

use std::collections::BTreeMap;

use nalgebra::DVector;
use rayon::prelude::*;

use crate::criteria::{Parsimony, by_cost};
use crate::fit::{Depth, Start};
use crate::nuisance::Nuisances;
use crate::select::{Candidate, Rival, Selection, Selector, Shown, Step};

/// Pairs that are tried, and of them those that are fitted to the end where simulations cost
/// something.
const REFITTED_PAIRS: usize = 8;
const FITTED_PAIRS: usize = 3;

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
        let mut found: Vec<_> = pairs.into_par_iter().filter_map(fitted).collect();
        found.sort_by(|(_, a), (_, b)| a.fit.loss.total_cmp(&b.fit.loss));
        if !self.problem.plant.cheap() {
            let ended = |(pair, brief): &mut ([usize; 2], Candidate)| {
                let start = Start::Fit(&brief.fit);
                if let Some(whole) = self.candidate(Depth::Whole, at(*pair), start, pair, None) {
                    *brief = whole;
                }
            };
            found.par_iter_mut().take(FITTED_PAIRS).for_each(ended);
        }
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

    /// Pairs whose linear combination explains most of the nominal residual.
    fn screen_pairs(&self, selection: &Selection) -> Vec<[usize; 2]> {
        let nominal = &selection.nominal.fit;
        let column = |shown: &Shown| -> Vec<DVector<f64>> {
            let pairs = nominal.trials.iter().zip(&shown.does);
            pairs.map(|(off, does)| off.refit.project_column(does)).collect()
        };
        let columns: Vec<Option<Vec<DVector<f64>>>> =
            selection.shown.iter().map(|shown| shown.as_ref().map(column)).collect();
        let dot = |a: &[DVector<f64>], b: &[DVector<f64>]| -> f64 {
            a.iter().zip(b).map(|(x, y)| x.dot(y)).sum()
        };
        let residual: Vec<DVector<f64>> =
            nominal.trials.iter().map(|trial| trial.refit.residual.clone()).collect();
        let mut explained = Vec::new();
        for (a, first) in columns.iter().enumerate() {
            for (b, second) in columns.iter().enumerate().skip(a + 1) {
                let (Some(first), Some(second)) = (first, second) else { continue };
                let (aa, ab, bb) = (dot(first, first), dot(first, second), dot(second, second));
                let (ar, br) = (dot(first, &residual), dot(second, &residual));
                let determinant = aa * bb - ab * ab;
                if determinant > 1e-9 * aa * bb {
                    let gain = (bb * ar * ar - 2.0 * ab * ar * br + aa * br * br) / determinant;
                    explained.push((gain, [a, b]));
                }
            }
        }
        explained.sort_by(|a, b| b.0.total_cmp(&a.0));
        explained.into_iter().take(REFITTED_PAIRS).map(|(_, pair)| pair).collect()
    }
}

/// The one of two effects that explains more alone, with its fit.
fn better_of(selection: &Selection, pair: [usize; 2]) -> Option<(usize, &Candidate)> {
    let fitted = |effect: usize| Some((effect, selection.singles[effect].as_ref()?));
    let found = pair.into_iter().filter_map(fitted);
    found.min_by(|(_, a), (_, b)| a.fit.loss.total_cmp(&b.fit.loss))
}
