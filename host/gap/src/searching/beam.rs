//! The search: sets of effects, extended one effect at a time, as long as that makes them more probable.
//!
//! Every single effect is fitted. Then, round by round, the best sets of each size are extended by the
//! effects that promise most, to first order: what an effect does alone is added to the derivatives of
//! the set. Those that promise enough are fitted with the whole model and scored. The parts of the best
//! set are fitted too, so that each of its effects is compared with what could stand in its place.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::DVector;

use crate::deciding::detectable::{Detectable, detectable};
use crate::deciding::interval::may_be_off;
use crate::deciding::posterior::{Explanation, Posterior};
use crate::evidence::discrepancy::{Cell, Evidence, Screen, evidence};
use crate::evidence::noise::Noise;
use crate::fitting::fit::{Depth, Start};
use crate::fitting::nuisance::Nuisances;
use crate::fitting::progress::{BestSoFar, EffectSoFar};
use crate::parallel::{each, each_some};
use crate::rules::Prior;
use crate::scoring::candidate::Candidate;
use crate::scoring::score::Score;
use crate::searching::selection::{Selection, SetRow};
use crate::searching::selector::Selector;
use crate::searching::singles::Shown;

/// A set that was fitted.
struct Fitted {
    candidate: Candidate,
    nuisances: Nuisances,
    evidence: Evidence,
    /// ln p(set, data), but for a constant, with all causes in the library and with one outside it.
    log_posteriors: [f64; 2],
    /// Whether it may be the answer: no effect is at a bound of its parameters or may as well be off, and no nuisance
    /// is at its limit in most trials.
    may_be_named: bool,
    is_extended: bool,
}

impl Fitted {
    fn log_posterior(&self) -> f64 {
        self.log_posteriors[0].max(self.log_posteriors[1])
    }
}

/// All sets that were fitted, by their effects in ascending order.
type Sets = BTreeMap<Vec<usize>, Fitted>;

/// A set that is worth a fit: another one, and the effect that is added to it or taken away.
struct Wanted {
    from: Vec<usize>,
    effect: usize,
}

impl Selector<'_> {
    /// The sets of effects under which the data are most probable. `None` when a simulation breaks down.
    pub fn search(&self, nominal: Candidate) -> Option<Selection> {
        let plant = self.problem.plant;
        let cheap = plant.cheap();
        let rules = &self.problem.rules;
        let of_nominal = self.nuisances_at(&nominal.fit)?;
        let tried = self.singles(&nominal, &of_nominal);
        let broken = |(effect, c): (usize, &Option<Candidate>)| {
            c.as_ref().is_none_or(|c| c.fit.failed).then_some(effect)
        };
        // What was not tried for want of time has not failed.
        let failed = match self.problem.is_cut() {
            false => tried.iter().enumerate().filter_map(broken).collect(),
            true => Vec::new(),
        };
        let singles: Vec<Option<Candidate>> =
            tried.into_iter().map(|c| c.filter(|c| !c.fit.failed)).collect();
        let shown = self.shown(&nominal, &singles);
        let fits = singles.iter().flatten().map(|c| &c.fit).chain([&nominal.fit]);
        let fits: Vec<_> = fits.collect();
        let noise = Noise::of(self.problem, &fits, &nominal.fit, &of_nominal);
        let scored = |candidate: Candidate| {
            let nuisances = self.nuisances_at(&candidate.fit)?;
            self.scored(&noise, &rules.prior, candidate, nuisances)
        };
        let whole = singles.iter().flatten().filter(|c| c.fit.is_whole()).cloned();
        let first: Vec<Candidate> = whole.chain([nominal.clone()]).collect();
        let mut sets: Sets = each_some(first, scored).into_iter().collect();
        self.tell(&nominal, &sets);
        let (most, rounds) = match cheap {
            true => (rules.search.most_effects_of_a_drive, rules.search.rounds_of_a_drive),
            false => (rules.search.most_effects, rules.search.rounds),
        };
        for _ in 0..rounds {
            if self.problem.is_cut() {
                break;
            }
            let wanted = self.wanted(&noise, &mut sets, &shown, most);
            if wanted.is_empty() {
                break;
            }
            // Beside effects whose nuisances are linearised there, one more changes little of what they do.
            let fitted = |wanted: Wanted| {
                if self.problem.is_cut() {
                    return None;
                }
                let nuisances = sets.get(&wanted.from)?.nuisances.clone();
                self.scored(&noise, &rules.prior, self.extended(&sets, &wanted)?, nuisances)
            };
            let found = each_some(wanted, fitted);
            for (effects, own) in found {
                sets.entry(effects).or_insert(own);
            }
            self.tell(&nominal, &sets);
        }
        self.finished(&noise, &nominal, singles, failed, sets)
    }

    /// Tells whoever watches which set is the most probable one so far.
    fn tell(&self, nominal: &Candidate, sets: &Sets) {
        let Some(own) = sets.get(&best_of(sets, self.problem.rules.search.tie)) else { return };
        let Candidate { fit, score } = &own.candidate;
        let found = fit.effects.iter().map(|&index| {
            let effect = &self.problem.plant.effects()[index];
            let values = effect.parameters.iter().zip(&fit.point.effects[index]);
            let values = values.map(|(parameter, value)| (*parameter, *value)).collect();
            EffectSoFar { id: effect.id, what: effect.what, values }
        });
        let (effects, closes) = (found.collect(), score.shrink(&nominal.score));
        self.problem.tell(&BestSoFar { effects, closes, sets: sets.len() });
    }

    /// A model that was asked for, compared with the nominal one alone.
    pub fn compared(
        &self,
        nominal: Candidate,
        best: Candidate,
        nuisances: Nuisances,
        singles: Vec<Option<Candidate>>,
        failed: Vec<usize>,
        path: Vec<(Vec<usize>, Score)>,
    ) -> Option<Selection> {
        let of_nominal = self.nuisances_at(&nominal.fit)?;
        let noise = Noise::of(self.problem, &[&nominal.fit, &best.fit], &nominal.fit, &of_nominal);
        // Whoever asks has chosen: the price of one effect among many is not due.
        let prior = Prior { of_effect: 0.0, ..self.problem.rules.prior };
        let none = self.scored(&noise, &prior, nominal.clone(), of_nominal);
        let with = self.scored(&noise, &prior, best.clone(), nuisances.clone());
        let sets: Sets = none.into_iter().chain(with).collect();
        Some(Selection {
            posterior: posterior(&sets),
            detectable: self.detectable(&noise, &nominal, &sets),
            nominal,
            singles,
            best,
            nuisances: Some(nuisances),
            path,
            without: Vec::new(),
            failed,
            sets: Vec::new(),
        })
    }

    /// A fitted set with its score.
    fn scored(
        &self,
        noise: &Noise,
        prior: &Prior,
        candidate: Candidate,
        nuisances: Nuisances,
    ) -> Option<(Vec<usize>, Fitted)> {
        if candidate.fit.failed {
            return None;
        }
        let found = evidence(self.problem, noise, &candidate.fit, &nuisances);
        let mut log_posteriors = prior.log_posteriors(&found, candidate.fit.effects.len());
        let refuses = self.problem.rules.search.refuses_bounds;
        let may_be_named = !(refuses && candidate.fit.at_bound(self.problem.plant));
        if !may_be_named {
            // What ends at a bound has turned into a limit of itself, which is another cause.
            log_posteriors[0] = f64::NEG_INFINITY;
        }
        let mut effects = candidate.fit.effects.clone();
        effects.sort_unstable();
        let own = Fitted {
            candidate,
            nuisances,
            evidence: found,
            log_posteriors,
            may_be_named,
            is_extended: false,
        };
        Some((effects, own))
    }

    /// The sets that are fitted next.
    fn wanted(
        &self,
        noise: &Noise,
        sets: &mut Sets,
        shown: &[Option<Shown>],
        most: usize,
    ) -> Vec<Wanted> {
        let rules = &self.problem.rules.search;
        let parts = match rules.compares_parts {
            true => parts_of_best(sets, rules.tie),
            false => Vec::new(),
        };
        let mut bases: BTreeSet<Vec<usize>> = parts.iter().cloned().collect();
        for size in 1..most {
            bases.extend(best_of_size(sets, size).into_iter().take(rules.width));
        }
        bases.retain(|effects| sets.get(effects).is_some_and(|own| !own.is_extended));
        let promised = each(&bases, |base| {
            let own = &sets[base];
            self.promising(noise, own, shown)
        });
        let mut wanted: BTreeMap<Vec<usize>, Wanted> = BTreeMap::new();
        for (base, effects) in bases.iter().zip(promised) {
            for effect in effects {
                let mut set = base.clone();
                set.push(effect);
                set.sort_unstable();
                if set.len() <= most && !sets.contains_key(&set) {
                    wanted.entry(set).or_insert(Wanted { from: base.clone(), effect });
                }
            }
            if let Some(own) = sets.get_mut(base) {
                own.is_extended = true;
            }
        }
        let best = best_of(sets, rules.tie);
        for part in parts.into_iter().filter(|part| !sets.contains_key(part)) {
            let effect = best.iter().copied().find(|effect| !part.contains(effect));
            if let Some(effect) = effect {
                wanted.insert(part, Wanted { from: best.clone(), effect });
            }
        }
        wanted.into_values().collect()
    }

    /// Effects that promise to make a set more probable, to first order; the best ones first.
    fn promising(&self, noise: &Noise, base: &Fitted, shown: &[Option<Shown>]) -> Vec<usize> {
        let fit = &base.candidate.fit;
        let screen = self
            .problem
            .rules
            .prior
            .best(&base.evidence)
            .and_then(|at| Screen::of(self.problem, noise, (fit, &base.nuisances), at));
        let Some(screen) = screen else { return Vec::new() };
        let others = (0..shown.len()).filter(|effect| !fit.effects.contains(effect));
        let mut promised: Vec<(f64, usize)> = each_some(others, |effect| {
            let does: &[DVector<f64>] = &shown[effect].as_ref()?.does;
            Some((screen.gain(does)?, effect))
        });
        promised.sort_by(|a, b| b.0.total_cmp(&a.0));
        promised.truncate(self.problem.rules.search.extended_by);
        promised.into_iter().map(|(_, effect)| effect).collect()
    }

    /// Fits a set that is wanted, from the set that it comes from.
    fn extended(&self, sets: &Sets, wanted: &Wanted) -> Option<Candidate> {
        let own = sets.get(&wanted.from)?;
        let base = &own.candidate.fit;
        if base.effects.contains(&wanted.effect) {
            let left: Vec<usize> =
                base.effects.iter().copied().filter(|e| *e != wanted.effect).collect();
            let mut start = base.point.clone();
            let off = self.problem.plant.effects()[wanted.effect].parameters.iter().map(|p| p.off);
            start.effects[wanted.effect] = off.collect();
            let start = start.anchored();
            return self.candidate(Depth::Whole, &own.nuisances, Start::Point(&start), &left, None);
        }
        let set: Vec<usize> = base.effects.iter().copied().chain([wanted.effect]).collect();
        let (start, fresh) = (Start::Fit(base), Some(wanted.effect));
        self.candidate(Depth::Whole, &own.nuisances, start, &set, fresh)
    }

    /// The answer of the search, its best set fitted to the end.
    fn finished(
        &self,
        noise: &Noise,
        nominal: &Candidate,
        singles: Vec<Option<Candidate>>,
        failed: Vec<usize>,
        mut sets: Sets,
    ) -> Option<Selection> {
        let rows = sets.values().map(|own| self.row(nominal, own)).collect();
        let (best_fit, nuisances) = self.best_without_doubt(&mut sets)?;
        let posterior = posterior(&sets);
        let detectable = self.detectable(noise, nominal, &sets);
        let mut best = best_fit.fit.effects.clone();
        best.sort_unstable();
        let path = path(&sets, &singles, &best, nominal);
        let without = parts(&best).into_iter().filter_map(|part| {
            let effect = *best.iter().find(|effect| !part.contains(effect))?;
            Some((effect, sets.get(&part)?.candidate.clone()))
        });
        let without = if best.len() > 1 { without.collect() } else { Vec::new() };
        Some(Selection {
            nominal: nominal.clone(),
            singles,
            nuisances: Some(nuisances),
            posterior,
            path,
            without,
            failed,
            sets: rows,
            detectable,
            best: best_fit,
        })
    }

    /// The most probable set that may be named, fitted to the end.
    ///
    /// A set that names an effect whose interval holds "off" may not: its part without that effect says the
    /// same. The score alone is too sure of a small effect that makes up for what the model misses. Where only
    /// sets at a bound explain anything, the best of them is what comes nearest.
    fn best_without_doubt(&self, sets: &mut Sets) -> Option<(Candidate, Nuisances)> {
        let rules = &self.problem.rules.search;
        loop {
            let named = best_of(sets, rules.tie);
            let best = nearest_of(sets).filter(|_| named.is_empty()).unwrap_or(named);
            let own = sets.get_mut(&best)?;
            let fitted = self.polished(own.candidate.clone(), &own.nuisances);
            let off = match rules.refuses_doubt {
                true => may_be_off(self.problem, self.folds, &fitted, &own.nuisances),
                false => Vec::new(),
            };
            let is_at_bound = rules.refuses_bounds && fitted.fit.at_bound(self.problem.plant);
            if off.is_empty() && (!own.may_be_named || !is_at_bound) {
                return Some((fitted, own.nuisances.clone()));
            }
            own.may_be_named = false;
            if !off.is_empty() {
                own.log_posteriors = [f64::NEG_INFINITY; 2];
            }
        }
    }

    /// What would have been seen of each effect, had it been there.
    fn detectable(&self, noise: &Noise, nominal: &Candidate, sets: &Sets) -> Vec<Detectable> {
        let none = sets.get(&Vec::new()).filter(|_| !self.problem.is_cut());
        let screen = none.and_then(|own| {
            let at = self.problem.rules.prior.best_without_others(&own.evidence)?;
            Screen::of(self.problem, noise, (&nominal.fit, &own.nuisances), at)
        });
        screen.map(|screen| detectable(self.problem, nominal, &screen)).unwrap_or_default()
    }

    fn row(&self, nominal: &Candidate, own: &Fitted) -> SetRow {
        let (fit, score) = (&own.candidate.fit, &own.candidate.score);
        let cell = |c: &Cell| {
            let amplitudes = [c.amplitude, c.kappa, c.looseness];
            amplitudes.into_iter().chain(c.log_densities.iter().copied()).collect()
        };
        SetRow {
            effects: fit.effects.iter().map(|&e| self.problem.plant.effects()[e].id).collect(),
            shrink: score.shrink(&nominal.score),
            worst: score.worst(),
            at_bound: fit.at_bound(self.problem.plant),
            is_beyond_stated: own.evidence.is_beyond_stated,
            bins: own.evidence.size.bins.clone(),
            channels: own.evidence.size.channels,
            cells: own.evidence.cells.iter().map(cell).collect(),
        }
    }

    /// The best model fitted to the end by the finer model, where that leaves no more.
    pub fn polished(&self, best: Candidate, nuisances: &Nuisances) -> Candidate {
        let is_worth_it = self.problem.rules.search.polishes && !self.problem.plant.cheap();
        if best.fit.effects.is_empty() || !is_worth_it || self.problem.is_cut() {
            return best;
        }
        let start = Start::Fit(&best.fit);
        let polished = self.candidate(Depth::Polished, nuisances, start, &best.fit.effects, None);
        // Near a threshold, the last of the way down may be the noise of one trial.
        polished.filter(|own| own.score.excess() <= best.score.excess()).unwrap_or(best)
    }
}

/// How probable each of the sets is.
fn posterior(sets: &Sets) -> Posterior {
    Posterior::of(sets.values().map(|own| {
        let fit = &own.candidate.fit;
        let mut effects = fit.effects.clone();
        effects.sort_unstable();
        let explanation =
            Explanation { effects, point: fit.point.clone(), probability: 0.0, with_others: 0.0 };
        (explanation, own.log_posteriors)
    }))
}

/// The most probable set that may be named; of those that are as probable, the first in the order of the library.
fn best_of(sets: &Sets, tie: f64) -> Vec<usize> {
    let named = || sets.iter().filter(|(_, own)| own.may_be_named);
    let most = named().map(|(_, own)| own.log_posterior()).fold(f64::NEG_INFINITY, f64::max);
    let best = named().find(|(_, own)| own.log_posterior() >= most - tie);
    best.map(|(effects, _)| effects.clone()).unwrap_or_default()
}

/// The most probable set at a bound, if it is more probable than no effect.
fn nearest_of(sets: &Sets) -> Option<Vec<usize>> {
    let none = sets.get(&Vec::new()).map_or(f64::NEG_INFINITY, Fitted::log_posterior);
    let nearer = sets.iter().filter(|(_, own)| !own.may_be_named && own.log_posterior() > none);
    let nearest = nearer.max_by(|a, b| a.1.log_posterior().total_cmp(&b.1.log_posterior()));
    nearest.map(|(effects, _)| effects.clone())
}

/// The sets of a size, the most probable one first.
fn best_of_size(sets: &Sets, size: usize) -> Vec<Vec<usize>> {
    let mut own: Vec<_> = sets.iter().filter(|(effects, _)| effects.len() == size).collect();
    own.sort_by(|a, b| b.1.log_posterior().total_cmp(&a.1.log_posterior()));
    own.into_iter().map(|(effects, _)| effects.clone()).collect()
}

/// A set without each of its effects.
fn parts(set: &[usize]) -> Vec<Vec<usize>> {
    let without = |left_out: &usize| set.iter().copied().filter(|e| e != left_out).collect();
    set.iter().map(without).collect()
}

/// The parts of the most probable set that are sets of effects themselves.
fn parts_of_best(sets: &Sets, tie: f64) -> Vec<Vec<usize>> {
    parts(&best_of(sets, tie)).into_iter().filter(|part| !part.is_empty()).collect()
}

/// How a set grows from none: by the part that leaves least, of those that were fitted.
fn path(
    sets: &Sets,
    singles: &[Option<Candidate>],
    best: &[usize],
    nominal: &Candidate,
) -> Vec<(Vec<usize>, Score)> {
    let score = |set: &Vec<usize>| match (sets.get(set), &set[..]) {
        (Some(own), _) => Some(own.candidate.score.clone()),
        (None, [only]) => singles[*only].as_ref().map(|own| own.score.clone()),
        _ => None,
    };
    let mut steps = Vec::new();
    let mut set = best.to_vec();
    while !set.is_empty() {
        let Some(own) = score(&set) else { break };
        steps.push((set.clone(), own));
        let parts = parts(&set).into_iter().filter(|part| !part.is_empty());
        let fitted = parts.filter_map(|part| Some((score(&part)?.energy, part)));
        let least = fitted.min_by(|a, b| a.0.total_cmp(&b.0));
        set = least.map(|(_, part)| part).unwrap_or_default();
    }
    steps.push((Vec::new(), nominal.score.clone()));
    steps.reverse();
    steps
}
