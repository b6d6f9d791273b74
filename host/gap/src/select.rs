//! Which effects the data support: singles, pairs, more while they pay, fewer where they do not.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::fit::{Depth, Fit, fit};
use crate::nuisance::Nuisances;
use crate::plant::{Plant, Point};
use crate::problem::Problem;
use crate::score::{Folds, Score, score};

/// Gap energy per sample below which there is no gap, in floors.
pub const NO_GAP: f64 = 1.3;
/// A gain must exceed so many of its standard errors over the blocks.
const GAIN_STANDARD_ERRORS: f64 = 2.0;
/// Smallest share of the remaining gap that an effect must remove.
const SMALLEST_SHARE: f64 = 0.02;
/// Smallest N_eff ln(E_old/E_new) − k ln N_eff.
const EVIDENCE: f64 = 6.0;
/// Pairs that are refitted, and candidates in every later round.
const REFITTED_PAIRS: usize = 8;
/// Single effects that are fitted to the end; where simulations cost nothing, all are.
const FITTED_SINGLES: usize = 10;
const REFITTED_MORE: usize = 5;
/// Effects that one explanation may have, where simulations cost nothing and where they do.
const MOST_EFFECTS: usize = 6;
const MOST_EFFECTS_COSTLY: usize = 3;

/// A fitted model with its held-out score.
#[derive(Clone, Debug)]
pub struct Candidate {
    pub fit: Fit,
    pub score: Score,
}

/// A model that was refitted with another effect in the place of the chosen one.
#[derive(Clone, Debug)]
pub struct Rival {
    pub effect: usize,
    pub point: Point,
    pub score: Score,
}

impl Rival {
    fn of(effect: usize, candidate: &Candidate) -> Self {
        Self { effect, point: candidate.fit.point.clone(), score: candidate.score.clone() }
    }
}

/// An accepted effect, and what it was chosen over.
#[derive(Clone, Debug)]
pub struct Step {
    pub effect: usize,
    /// The model that it made.
    pub point: Point,
    pub score: Score,
    pub rivals: Vec<Rival>,
}

impl Step {
    fn of(effect: usize, candidate: &Candidate, rivals: Vec<Rival>) -> Self {
        let (point, score) = (candidate.fit.point.clone(), candidate.score.clone());
        Self { effect, point, score, rivals }
    }
}

/// What selection found.
pub struct Selection {
    pub nominal: Candidate,
    /// Every single effect, in the order of the library; `None` where the fit failed.
    pub singles: Vec<Option<Candidate>>,
    /// The best explanation; the nominal model when nothing pays.
    pub best: Candidate,
    /// How the explanation grew, for the report: effects and score after each step.
    pub path: Vec<(Vec<usize>, Score)>,
    pub steps: Vec<Step>,
    /// Effects whose fit failed.
    pub failed: Vec<usize>,
}

/// Why an effect is or is not added.
pub fn pays(old: &Score, new: &Score, parameters: usize) -> bool {
    let (gain, error) = new.gain_over(old);
    let n = new.effective.max(2.0);
    let evidence = n * (old.energy / new.energy).ln() - parameters as f64 * n.ln();
    gain > GAIN_STANDARD_ERRORS * error
        && old.energy - new.energy >= SMALLEST_SHARE * (old.energy - 1.0)
        && evidence > EVIDENCE
}

/// What a model costs in the same terms: N_eff ln E + k ln N_eff, for models side by side.
fn cost(score: &Score, effective: f64, parameters: usize) -> f64 {
    effective * score.energy.ln() + parameters as f64 * effective.ln()
}

/// Costs that differ by less say nothing.
const TIE: f64 = 2.0;

/// The candidates, the least costly first; ties in the order that they had. N_eff is the
/// smallest of all, so that none is favoured by what it leaves.
///
/// Of those within one standard error of the first, or within the smallest share of the gap that
/// counts, one with a parameter at a bound stands behind the others.
fn by_cost<T>(plant: &dyn Plant, gap: f64, candidates: &mut [T], of: impl Fn(&T) -> &Candidate) {
    let effective = candidates.iter().map(|c| of(c).score.effective).fold(f64::INFINITY, f64::min);
    let key = |c: &T| {
        let candidate = of(c);
        cost(&candidate.score, effective.max(2.0), candidate.fit.coordinates.len())
    };
    let least = candidates.iter().map(key).fold(f64::INFINITY, f64::min);
    candidates.sort_by_cached_key(|c| ((key(c) - least) / TIE).round() as i64);
    let Some(first) = candidates.first().map(|c| of(c).score.clone()) else { return };
    let equal = |c: &T| {
        let (gain, error) = first.gain_over(&of(c).score);
        gain <= error.max(SMALLEST_SHARE * gap)
    };
    candidates.sort_by_cached_key(|c| match (equal(c), of(c).fit.at_bound(plant)) {
        (true, false) => 0,
        (true, true) => 1,
        (false, _) => 2,
    });
}

/// Fits, scores and compares models of one problem.
pub struct Selector<'a> {
    pub problem: &'a Problem<'a>,
    pub folds: &'a Folds,
}

impl Selector<'_> {
    /// Every effect off. `None` when not even that can be simulated.
    pub fn nominal(&self) -> Option<Candidate> {
        self.candidate(&Point::nominal(self.problem.plant), &[], None)
    }

    /// A fit from `start`; nuisances are linearised there, and once more where it ends.
    fn candidate(
        &self,
        start: &Point,
        effects: &[usize],
        fresh: Option<usize>,
    ) -> Option<Candidate> {
        let base = self.problem.residuals(start)?;
        let nuisances = Nuisances::at(self.problem, start, &base)?;
        self.candidate_with(&nuisances, start, effects, fresh)
    }

    fn candidate_with(
        &self,
        nuisances: &Nuisances,
        start: &Point,
        effects: &[usize],
        fresh: Option<usize>,
    ) -> Option<Candidate> {
        self.candidate_to(Depth::Whole, nuisances, start, effects, fresh)
    }

    pub fn candidate_to(
        &self,
        depth: Depth,
        nuisances: &Nuisances,
        start: &Point,
        effects: &[usize],
        fresh: Option<usize>,
    ) -> Option<Candidate> {
        let mut found = fit(self.problem, nuisances, start, effects, fresh, depth)?;
        if !effects.is_empty() && self.problem.plant.cheap() {
            let raw: Vec<_> = found.trials.iter().map(|trial| trial.raw.clone()).collect();
            let nuisances = Nuisances::at(self.problem, &found.point, &raw)?;
            let failed = found.failed;
            found = fit(self.problem, &nuisances, &found.point, effects, None, depth)?;
            found.failed |= failed;
        }
        let score = score(self.problem, self.folds, &found);
        Some(Candidate { fit: found, score })
    }

    pub fn nuisances_at(&self, fit: &Fit) -> Option<Nuisances> {
        let raw: Vec<_> = fit.trials.iter().map(|trial| trial.raw.clone()).collect();
        Nuisances::at(self.problem, &fit.point, &raw)
    }

    /// Singles, pairs, more, fewer.
    pub fn select(&self, nominal: Candidate) -> Option<Selection> {
        let effects = self.problem.plant.effects().len();
        let nuisances = self.nuisances_at(&nominal.fit)?;
        let tried = self.singles(&nominal, &nuisances, effects);
        let broken = |(effect, c): (usize, &Option<Candidate>)| {
            c.as_ref().is_none_or(|c| c.fit.failed).then_some(effect)
        };
        let failed = tried.iter().enumerate().filter_map(broken).collect();
        let singles: Vec<Option<Candidate>> =
            tried.into_iter().map(|c| c.filter(|c| !c.fit.failed)).collect();
        let mut selection = Selection {
            best: nominal.clone(),
            path: vec![(Vec::new(), nominal.score.clone())],
            nominal,
            singles,
            steps: Vec::new(),
            failed,
        };
        self.first(&mut selection);
        if selection.best.score.energy > NO_GAP {
            self.pairs(&mut selection, &nuisances);
        }
        let most = if self.problem.plant.cheap() { MOST_EFFECTS } else { MOST_EFFECTS_COSTLY };
        while selection.best.score.energy > NO_GAP
            && selection.best.fit.effects.len() < most
            && self.extend(&mut selection)
        {}
        self.prune(&mut selection);
        Some(selection)
    }

    /// Every single effect: a glance at all, then the whole fit of those that may win.
    fn singles(
        &self,
        nominal: &Candidate,
        nuisances: &Nuisances,
        effects: usize,
    ) -> Vec<Option<Candidate>> {
        let glance = |effect: usize| {
            let start = &nominal.fit.point;
            self.candidate_to(Depth::Glance, nuisances, start, &[effect], Some(effect))
        };
        let mut tried: Vec<Option<Candidate>> = (0..effects).into_par_iter().map(glance).collect();
        if self.problem.plant.cheap() {
            // A glance was the whole fit.
            return tried;
        }
        let mut losses: Vec<(f64, usize)> = tried
            .iter()
            .enumerate()
            .filter_map(|(effect, c)| Some((c.as_ref()?.fit.loss, effect)))
            .collect();
        losses.sort_by(|a, b| a.0.total_cmp(&b.0));
        let first: Vec<usize> = losses.iter().take(FITTED_SINGLES).map(|(_, e)| *e).collect();
        let refined: Vec<(usize, Option<Candidate>)> = first
            .into_par_iter()
            .map(|effect| {
                let from = tried[effect].as_ref().map(|c| &c.fit.point)?;
                Some((effect, self.candidate_with(nuisances, from, &[effect], None)))
            })
            .flatten()
            .collect();
        for (effect, candidate) in refined {
            if candidate.is_some() {
                tried[effect] = candidate;
            }
        }
        tried
    }

    fn parameters(&self, effect: usize) -> usize {
        self.problem.plant.effects()[effect].parameters.len()
    }

    fn accept(&self, selection: &mut Selection, candidate: Candidate, step: Step) {
        selection.path.push((candidate.fit.effects.clone(), candidate.score.clone()));
        selection.best = candidate;
        selection.steps.push(step);
    }

    /// The best single effect, if it pays.
    fn first(&self, selection: &mut Selection) {
        let scored = selection.singles.iter().enumerate();
        let mut scored: Vec<(usize, &Candidate)> =
            scored.filter_map(|(effect, c)| Some((effect, c.as_ref()?))).collect();
        by_cost(
            self.problem.plant,
            selection.nominal.score.energy - 1.0,
            &mut scored,
            |(_, candidate)| candidate,
        );
        let Some(&(effect, best)) = scored.first() else { return };
        if !pays(&selection.nominal.score, &best.score, self.parameters(effect)) {
            return;
        }
        let rivals = scored[1..].iter().map(|(e, c)| Rival::of(*e, c)).collect();
        let best = best.clone();
        let step = Step::of(effect, &best, rivals);
        self.accept(selection, best, step);
    }

    /// The best pair, if it pays more than the best single effect.
    fn pairs(&self, selection: &mut Selection, nuisances: &Nuisances) {
        let fitted = |pair: [usize; 2]| -> Option<([usize; 2], Candidate)> {
            let mut start = selection.nominal.fit.point.clone();
            for effect in pair {
                if let Some(single) = &selection.singles[effect] {
                    start.effects[effect].clone_from(&single.fit.point.effects[effect]);
                }
            }
            // From both switched on, or from the better of the two alone.
            let joint = self.candidate_with(nuisances, &start, &pair, None);
            let better = pair
                .into_iter()
                .filter_map(|e| selection.singles[e].as_ref())
                .min_by(|a, b| a.fit.loss.total_cmp(&b.fit.loss));
            let better = better?;
            let candidate = match joint {
                Some(joint) if joint.fit.loss <= better.fit.loss => Some(joint),
                _ => self.candidate_with(nuisances, &better.fit.point, &pair, None),
            };
            Some((pair, candidate.filter(|c| !c.fit.failed)?))
        };
        let pairs = self.screen_pairs(selection);
        let mut found: Vec<_> = pairs.into_par_iter().filter_map(fitted).collect();
        found.sort_by_key(|(pair, _)| *pair);
        by_cost(
            self.problem.plant,
            selection.nominal.score.energy - 1.0,
            &mut found,
            |(_, candidate)| candidate,
        );
        let Some((pair, best)) = found.first() else { return };
        let already = selection.best.fit.effects.clone();
        let added: Vec<usize> = pair.iter().copied().filter(|e| !already.contains(e)).collect();
        let parameters = added.iter().map(|&e| self.parameters(e)).sum();
        if !pays(&selection.best.score, &best.score, parameters) {
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

    /// Pairs whose linear combination explains most of the nominal residual.
    fn screen_pairs(&self, selection: &Selection) -> Vec<[usize; 2]> {
        let nominal = &selection.nominal.fit;
        // What each effect does, at the size that it was fitted to alone.
        let column = |single: &Candidate| -> Vec<DVector<f64>> {
            let pairs = nominal.trials.iter().zip(&single.fit.trials);
            pairs.map(|(off, on)| off.refit.project_column(&(&on.raw - &off.raw))).collect()
        };
        let columns: Vec<Option<Vec<DVector<f64>>>> =
            selection.singles.iter().map(|single| single.as_ref().map(column)).collect();
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

    /// Adds the effect that helps most, if it pays.
    fn extend(&self, selection: &mut Selection) -> bool {
        let base = &selection.best;
        let Some(nuisances) = self.nuisances_at(&base.fit) else { return false };
        let mut screened: Vec<(f64, usize)> = (0..self.problem.plant.effects().len())
            .filter(|effect| !base.fit.effects.contains(effect))
            .filter_map(|effect| Some((self.promise(selection, effect)?, effect)))
            .collect();
        screened.sort_by(|a, b| b.0.total_cmp(&a.0));
        screened.truncate(REFITTED_MORE);
        let fitted = |(_, effect): (f64, usize)| {
            let mut effects = base.fit.effects.clone();
            effects.push(effect);
            let candidate =
                self.candidate_with(&nuisances, &base.fit.point, &effects, Some(effect));
            Some((effect, candidate.filter(|c| !c.fit.failed)?))
        };
        let mut refitted: Vec<_> = screened.into_par_iter().filter_map(fitted).collect();
        // What acts on the plant comes before what acts on its sensors.
        refitted.sort_by_key(|(effect, _)| *effect);
        by_cost(
            self.problem.plant,
            selection.nominal.score.energy - 1.0,
            &mut refitted,
            |(_, candidate)| candidate,
        );
        let Some((effect, best)) = refitted.first() else { return false };
        if !pays(&base.score, &best.score, self.parameters(*effect)) {
            return false;
        }
        let rivals = refitted[1..].iter().map(|(e, c)| Rival::of(*e, c)).collect();
        let (effect, best) = (*effect, best.clone());
        let step = Step::of(effect, &best, rivals);
        self.accept(selection, best, step);
        true
    }

    /// How much of the residual an effect explains to first order, on top of the best model.
    fn promise(&self, selection: &Selection, effect: usize) -> Option<f64> {
        let base = &selection.best.fit;
        let columns = self.effect_on(selection, effect)?;
        let (mut normal, mut cross) = (base_normal(base), DVector::zeros(base.coordinates.len()));
        let (mut own, mut slope) = (0.0, 0.0);
        for (trial, column) in base.trials.iter().zip(&columns) {
            let column = trial.refit.project_column(column);
            own += column.norm_squared();
            slope += column.dot(&trial.refit.residual);
            cross += trial.jacobian.tr_mul(&column);
        }
        // What the parameters that are on already cannot do themselves.
        for i in 0..normal.nrows() {
            normal[(i, i)] *= 1.0 + 1e-9;
        }
        let explained = normal.cholesky().map_or(0.0, |c| cross.dot(&c.solve(&cross)));
        let left = own - explained;
        (left > 1e-9 * own).then(|| slope * slope / left)
    }

    /// What an effect does to the residuals of the best model, at the size that it was fitted to
    /// alone; where simulations cost something, what it did to those of the nominal model.
    fn effect_on(&self, selection: &Selection, effect: usize) -> Option<Vec<DVector<f64>>> {
        let alone = selection.singles[effect].as_ref()?;
        let nominal = &selection.nominal.fit;
        let difference = |on: &[DVector<f64>], off: &Fit| {
            on.iter().zip(&off.trials).map(|(on, off)| on - &off.raw).collect()
        };
        let idle = alone.fit.point == nominal.point;
        if !self.problem.plant.cheap() {
            let on: Vec<_> = alone.fit.trials.iter().map(|trial| trial.raw.clone()).collect();
            return (!idle).then(|| difference(&on, nominal));
        }
        let base = &selection.best.fit;
        let mut point = base.point.clone();
        point.effects[effect] = if idle {
            // It fitted to nothing alone: its first start says what it does.
            self.problem.plant.effects()[effect].starts.first()?.clone()
        } else {
            alone.fit.point.effects[effect].clone()
        };
        Some(difference(&self.problem.residuals(&point)?, base))
    }

    /// Takes out what does not pay any more, one after the other.
    fn prune(&self, selection: &mut Selection) {
        loop {
            let effects = selection.best.fit.effects.clone();
            if effects.len() < 2 {
                return;
            }
            let Some(nuisances) = self.nuisances_at(&selection.best.fit) else { return };
            let without = |&effect: &usize| {
                let candidate = self.without(selection, &nuisances, effect)?;
                let idle = !pays(&candidate.score, &selection.best.score, self.parameters(effect));
                idle.then_some((effect, candidate))
            };
            let idle = effects
                .iter()
                .filter_map(without)
                .min_by(|a, b| a.1.score.energy.total_cmp(&b.1.score.energy));
            let Some((effect, candidate)) = idle else { return };
            selection.path.push((candidate.fit.effects.clone(), candidate.score.clone()));
            selection.best = candidate;
            selection.steps.retain(|step| step.effect != effect);
        }
    }

    /// The best model with one effect taken out, the others refitted.
    pub fn without(
        &self,
        selection: &Selection,
        nuisances: &Nuisances,
        effect: usize,
    ) -> Option<Candidate> {
        let best = &selection.best.fit;
        let left: Vec<usize> = best.effects.iter().copied().filter(|&e| e != effect).collect();
        let mut start = best.point.clone();
        let off = self.problem.plant.effects()[effect].parameters.iter().map(|p| p.off);
        start.effects[effect] = off.collect();
        self.candidate_with(nuisances, &start, &left, None)
    }

    /// The derivatives of the nuisances at the best model.
    pub fn nuisances_of_best(&self, selection: &Selection) -> Option<Nuisances> {
        self.nuisances_at(&selection.best.fit)
    }
}

fn base_normal(base: &Fit) -> DMatrix<f64> {
    let k = base.coordinates.len();
    base.trials
        .iter()
        .fold(DMatrix::zeros(k, k), |sum, trial| sum + trial.jacobian.tr_mul(&trial.jacobian))
}
