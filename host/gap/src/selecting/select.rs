//! The search for the effects that the data support: singles, pairs, additions, removals.

use nalgebra::DVector;

use crate::fitting::fit::{Depth, Fit, Start, fit};
use crate::fitting::nuisance::Nuisances;
use crate::fitting::problem::Problem;
use crate::parallel::{each, each_some};
use crate::plant::Point;
use crate::scoring::candidate::Candidate;
use crate::scoring::criteria::{NO_GAP, Parsimony, by_cost, simplest_first};
use crate::scoring::folds::Folds;
use crate::scoring::score::score;
use crate::selecting::selection::{Rival, Selection, Shown, Step};

/// Single effects that are fitted to the end, at most and at least, and how far from the loss of
/// the first, as a share of what that closes; where simulations cost nothing, all are.
const FITTED_SINGLES: usize = 10;
const FEWEST_SINGLES: usize = 4;
const FITTED_WITHIN: f64 = 0.5;
/// Shrink of a single effect from which on it is in every pair that is worth a fit, so that one
/// more effect is looked for in its place.
pub const DOMINANT: f64 = 0.9;
/// Single effects that are fitted once more with the nuisances linearised where they ended.
const OWN_NUISANCES: usize = 2;
/// Shrink below which several effects together are no explanation: with enough of them, anything
/// is fitted a little.
pub const EXPLAINED: f64 = 0.8;
/// Effects that one explanation may have, where simulations cost nothing and where they do.
pub const MOST_EFFECTS: usize = 6;
const MOST_EFFECTS_COSTLY: usize = 3;

/// Fits, scores and compares models of one problem.
pub struct Selector<'a> {
    pub problem: &'a Problem<'a>,
    pub folds: &'a Folds,
}

impl Selector<'_> {
    /// Every effect off. `None` when not even that can be simulated.
    pub fn nominal(&self) -> Option<Candidate> {
        let point = Point::nominal(self.problem.plant);
        let base = self.problem.residuals(&point)?;
        let nuisances = Nuisances::at(self.problem, &point, &base)?;
        let nominal = self.candidate(Depth::Whole, &nuisances, Start::Point(&point), &[], None)?;
        Some(self.without_gap(&nuisances, &nominal).unwrap_or(nominal))
    }

    /// A fit and its score. Where simulations cost nothing, nuisances are linearised once more
    /// where it ends; where they do, a whole fit goes on from there with simulations corrected
    /// there, and a polished one asks the finer model itself.
    pub fn candidate(
        &self,
        depth: Depth,
        nuisances: &Nuisances,
        start: Start<'_>,
        effects: &[usize],
        fresh: Option<usize>,
    ) -> Option<Candidate> {
        let cheap = self.problem.plant.cheap();
        let finer = start.point().clone().finer();
        let is_last = depth == Depth::Polished && !cheap;
        let start = if is_last { Start::Point(&finer) } else { start };
        let mut found = fit(self.problem, nuisances, start, effects, fresh, depth)?;
        if !effects.is_empty() && cheap {
            let nuisances = self.nuisances_at(&found)?;
            let failed = found.failed;
            found = fit(self.problem, &nuisances, Start::Fit(&found), effects, None, depth)?;
            found.failed |= failed;
        } else if depth == Depth::Whole && !cheap && !found.failed {
            found = self.corrected(nuisances, &found, depth).unwrap_or(found);
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
        let mut tried = self.singles(&nominal, &nuisances, effects);
        if !self.problem.plant.cheap() {
            self.with_own_nuisances(&nominal, &mut tried);
        }
        let broken = |(effect, c): (usize, &Option<Candidate>)| {
            c.as_ref().is_none_or(|c| c.fit.failed).then_some(effect)
        };
        let failed = tried.iter().enumerate().filter_map(broken).collect();
        let singles: Vec<Option<Candidate>> =
            tried.into_iter().map(|c| c.filter(|c| !c.fit.failed)).collect();
        let shown = self.shown(&nominal, &singles);
        let mut selection = Selection {
            best: nominal.clone(),
            shown,
            path: vec![(Vec::new(), nominal.score.clone())],
            nominal,
            singles,
            steps: Vec::new(),
            failed,
            nuisances: None,
            without: Vec::new(),
            pairs: Vec::new(),
            exchanged: Vec::new(),
            extended: Vec::new(),
        };
        self.first(&mut selection);
        let dominant = selection.best.score.shrink(&selection.nominal.score) >= DOMINANT;
        if selection.best.score.worst() > NO_GAP && !dominant {
            self.pairs(&mut selection, &nuisances);
        }
        let most = if self.problem.plant.cheap() { MOST_EFFECTS } else { MOST_EFFECTS_COSTLY };
        while selection.best.score.worst() > NO_GAP
            && selection.best.fit.effects.len() < most
            && self.extend(&mut selection)
        {}
        self.finish(&mut selection)?;
        if !self.problem.plant.cheap() {
            for _ in 0..selection.best.fit.effects.len() {
                if !self.exchange(&mut selection) {
                    break;
                }
                self.finish(&mut selection)?;
            }
        }
        let heirs = self.heirs(&selection);
        if !heirs.is_empty() {
            self.give_way(&mut selection, heirs)?;
        }
        self.look_again(&mut selection)?;
        self.single_again(&mut selection)?;
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
            let start = Start::Fit(&nominal.fit);
            self.candidate(Depth::Glance, nuisances, start, &[effect], Some(effect))
        };
        let mut tried: Vec<Option<Candidate>> = each(0..effects, glance);
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
        let closed = |loss: f64| nominal.fit.loss - loss;
        let enough = losses.first().map_or(0.0, |(loss, _)| FITTED_WITHIN * closed(*loss));
        let near = losses.iter().take_while(|(loss, _)| closed(*loss) >= enough).count();
        losses.truncate(near.clamp(FEWEST_SINGLES, FITTED_SINGLES));
        let first = losses.into_iter().map(|(_, effect)| effect);
        let refined: Vec<(usize, Option<Candidate>)> = each_some(first, |effect| {
            let from = Start::Fit(&tried[effect].as_ref()?.fit);
            let whole = self.candidate(Depth::Whole, nuisances, from, &[effect], None);
            Some((effect, whole))
        });
        for (effect, candidate) in refined {
            if let (Some(mut whole), Some(glance)) = (candidate, &tried[effect]) {
                whole.fit.tried.clone_from(&glance.fit.tried);
                tried[effect] = Some(whole);
            }
        }
        tried
    }

    /// Fits the best single effects once more, with the nuisances linearised where they ended: what
    /// a bias or a time shift does beside a strong effect is not what it does beside none, and what
    /// is left by that asks for a second effect. Not where one effect is dominant as it is.
    fn with_own_nuisances(&self, nominal: &Candidate, tried: &mut [Option<Candidate>]) {
        let shrink = |c: &Candidate| c.score.shrink(&nominal.score);
        let mut found: Vec<(f64, usize)> = tried
            .iter()
            .enumerate()
            .filter_map(|(effect, c)| Some((c.as_ref().filter(|c| !c.fit.failed)?, effect)))
            .map(|(c, effect)| (shrink(c), effect))
            .collect();
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        if found.first().is_none_or(|(shrink, _)| *shrink >= DOMINANT) {
            return;
        }
        found.truncate(OWN_NUISANCES);
        let again = |(_, effect): (f64, usize)| {
            let before = tried[effect].as_ref()?;
            let nuisances = self.nuisances_at(&before.fit)?;
            let start = Start::Fit(&before.fit);
            let mut own = self.candidate(Depth::Whole, &nuisances, start, &[effect], None)?;
            own.fit.tried.clone_from(&before.fit.tried);
            (own.score.excess() < before.score.excess()).then_some((effect, own))
        };
        let better = each_some(found, again);
        for (effect, own) in better {
            tried[effect] = Some(own);
        }
    }

    /// Where each single effect shows what it does: where it was fitted to alone, or, of one that
    /// helps nothing alone, the switch-on value that promised most.
    fn shown(&self, nominal: &Candidate, singles: &[Option<Candidate>]) -> Vec<Option<Shown>> {
        let shown = |single: &Option<Candidate>| {
            let fit = &single.as_ref()?.fit;
            let own = |raw: Vec<DVector<f64>>, point: &Point| {
                let pairs = raw.iter().zip(&nominal.fit.trials);
                let does = pairs.map(|(on, off)| on - &off.raw).collect();
                Some(Shown { point: point.clone(), does })
            };
            if fit.point != nominal.fit.point {
                return own(fit.trials.iter().map(|trial| trial.raw.clone()).collect(), &fit.point);
            }
            let tried = fit.tried.as_ref()?;
            own(self.problem.residuals(tried)?, tried)
        };
        each(singles, shown)
    }

    pub fn parameters(&self, effect: usize) -> usize {
        self.problem.plant.effects()[effect].parameters.len()
    }

    pub fn accept(&self, selection: &mut Selection, candidate: Candidate, steps: Vec<Step>) {
        selection.path.push((candidate.fit.effects.clone(), candidate.score.clone()));
        selection.best = candidate;
        selection.steps.extend(steps);
    }

    /// The best single effect, if it pays.
    pub fn first(&self, selection: &mut Selection) {
        let scored = selection.singles.iter().enumerate();
        let mut scored: Vec<(usize, &Candidate)> =
            scored.filter_map(|(effect, c)| Some((effect, c.as_ref()?))).collect();
        by_cost(
            self.problem.plant,
            selection.nominal.score.excess(),
            &mut scored,
            |(_, candidate)| candidate,
        );
        simplest_first(self.problem.plant, &mut scored, |(_, candidate)| candidate);
        let Some(&(effect, best)) = scored.first() else { return };
        let nominal = &selection.nominal.score;
        let parsimony = Parsimony::of(self.problem.plant, nominal);
        if !parsimony.pays(nominal, &best.score, self.parameters(effect)) {
            return;
        }
        let rivals = scored[1..].iter().map(|(e, c)| Rival::of(*e, c)).collect();
        let best = best.clone();
        let step = Step::of(effect, &best, rivals);
        self.accept(selection, best, vec![step]);
    }
}
