//! Assembles the answer step by step: verdict, effects, figures and remarks.

use std::collections::BTreeMap;

use crate::data::unlike_trials::unlike;
use crate::deciding::calibration;
use crate::deciding::confusability::{confusable, identified, win_frequency};
use crate::deciding::prior_limit::nuisance;
use crate::deciding::verdict::{Lead, NEARLY_ALL, verdict};
use crate::diagnosis::report::{
    Details, Diagnosis, NamedEffect, PathStep, QuantityEnergy, Ranked, Verdict,
};
use crate::explaining::band;
use crate::explaining::estimate::{increments, parameters, spread};
use crate::explaining::figures;
use crate::explaining::locate::locate;
use crate::explaining::map::maps;
use crate::explaining::on_vessel::on_vessel;
use crate::explaining::remainder::left;
use crate::explaining::series::{held_out, series};
use crate::fitting::fit::at_bound;
use crate::fitting::problem::Problem;
use crate::noise::floor::{Floor, FloorSource};
use crate::planning::experiment;
use crate::plant::{Plant, Point, Quantity};
use crate::scoring::candidate::Candidate;
use crate::scoring::criteria::{NEAR_FLOOR, NO_GAP};
use crate::scoring::folds::Folds;
use crate::scoring::metric::Metric;
use crate::scoring::score::{Score, root_mean_square};
use crate::selecting::impostor::unmasked;
use crate::selecting::select::Selector;
use crate::selecting::selection::Selection;

/// Share of the nominal RMS from which on an effect is material.
const MATERIAL: f64 = 0.05;
/// Energy that an explanation of a drive may leave, whatever it closes: its repeats agree better than
/// any model (the measured axis of EMPS is left some 60 times its floor's), but what closes nine tenths
/// or less and leaves more than this, 20 standard deviations of the floor, is of another kind.
const FAR_FROM_FLOOR_CHEAP: f64 = 300.0;

/// The answer while it grows.
pub struct Answer<'a> {
    plant: &'a dyn Plant,
    diagnosis: Diagnosis,
    /// Whether the floor rests on anything.
    floor_known: bool,
}

impl<'a> Answer<'a> {
    /// Before anything is known but the floor.
    pub fn new(plant: &'a dyn Plant, bundle: &str, floor: &Floor) -> Self {
        let mut remarks = plant.remarks().to_vec();
        let mut floor_known = true;
        for (channel, own) in plant.channels().iter().zip(&floor.channels) {
            if own.source == FloorSource::Unknown {
                floor_known = false;
                remarks.push(format!(
                    "{}: no noise is stated in rig.toml and no motion was repeated closely \
                     enough, so the floor is not known; every shrink is relative to an error of zero",
                    channel.name
                ));
            }
        }
        if floor.channels.iter().all(|own| own.source == FloorSource::Stated) {
            remarks.push(
                "no motion was repeated closely enough to compare runs: the floor is the noise of \
                 the sensor alone, and differences from run to run count as gap"
                    .to_owned(),
            );
        }
        let details = Details { compared: plant.compared().to_owned(), ..Details::default() };
        let diagnosis = Diagnosis { remarks, details, ..Diagnosis::unanswered(bundle) };
        Self { plant, diagnosis, floor_known }
    }

    /// One more thing that a reader must know.
    pub fn remark(&mut self, remark: String) {
        self.diagnosis.remarks.push(remark);
    }

    /// Names the trials that a model explains on another way past a fork than it would go itself.
    fn remark_on_forks(&mut self, of: &Candidate) {
        let ways = of.fit.point.anchor.ways.iter().enumerate();
        let trials = self.plant.trials();
        let aside: Vec<String> = ways
            .filter(|(_, way)| **way != 0)
            .map(|(trial, _)| trials[trial].number.to_string())
            .collect();
        if !aside.is_empty() {
            self.remark(format!(
                "trial {}: the tip may go either side of a dividing wall within the uncertainty of \
                 the setup; the trial is compared with the model on the side that fits better",
                aside.join(", ")
            ));
        }
    }

    /// Nothing can be concluded, for this reason, which comes before all other remarks.
    pub fn inconclusive(mut self, why: String) -> Diagnosis {
        self.diagnosis.remarks.insert(0, why);
        self.diagnosis
    }

    /// Selects an explanation, or takes the one that is given, and says all that there is about it.
    pub fn finish(
        mut self,
        problem: &Problem<'_>,
        selector: &Selector<'_>,
        nominal: Candidate,
        given: Option<&[usize]>,
    ) -> Diagnosis {
        self.diagnosis.places = locate(problem, &nominal.score);
        if nominal.score.worst() < NO_GAP && self.floor_known {
            return self.without_gap(problem, selector, &nominal);
        }
        self.diagnosis.details.maps = maps(problem, &nominal.score);
        self.diagnosis.details.on_vessel = on_vessel(problem, &nominal.score);
        let asked_for =
            given.unwrap_or_default().iter().map(|&e| self.plant.effects()[e].id.to_owned());
        self.diagnosis.asked_for = asked_for.collect();
        let before = nominal.clone();
        let selected = match given {
            None => selector.select(nominal).and_then(|found| identified(selector, found)),
            Some(effects) => selector.take(nominal, effects),
        };
        let Some(selection) = selected else {
            return self
                .inconclusive("a simulation broke down while candidates were fitted".to_owned());
        };
        let is_explained = selection.best.score.worst() < NO_GAP && given.is_none();
        if let Some(effect) = nuisance(self.plant, &selection.best.fit).filter(|_| is_explained) {
            self.remark(format!(
                "{} explains the error of the nominal model with a size that is within the \
                 uncertainty of any setup: it counts as a nuisance parameter, not as a gap",
                self.plant.effects()[effect].id
            ));
            return self.without_gap(problem, selector, &before);
        }
        self.rank(&selection);
        self.figures(selector, &before, &selection.best);
        self.diagnosis.details.held_out = held_out(problem, &selection);
        self.diagnosis.details.series = series(problem, &before, &selection.best);
        let shrink = selection.best.score.shrink(&before.score);
        self.diagnosis.details.shrink = shrink;
        self.path(problem, &selection);
        let named = self.effects(selector, &selection);
        let worst = selection.best.score.worst();
        let worst = if self.plant.cheap() && worst <= FAR_FROM_FLOOR_CHEAP { 0.0 } else { worst };
        self.diagnosis.verdict = if selection.best.fit.effects.is_empty() {
            Verdict::Unknown
        } else {
            let count = if self.plant.cheap() { 1 } else { named.len() };
            verdict(shrink, worst, self.lead(&named), count)
        };
        let objections = self.objections(problem, &selection, worst);
        if !objections.is_empty() && given.is_none() {
            self.diagnosis.verdict = Verdict::Unknown;
        }
        objections.into_iter().for_each(|objection| self.remark(objection));
        self.next_experiment(&selection, &named);
        if matches!(self.diagnosis.verdict, Verdict::Partial | Verdict::Unknown) {
            self.diagnosis.left = Some(left(selector, &selection));
            self.diagnosis.details.left_on_vessel = on_vessel(problem, &selection.best.score);
            unlike(problem, &before.score).into_iter().for_each(|remark| self.remark(remark));
        }
        if self.diagnosis.verdict == Verdict::Unknown {
            self.diagnosis.effects.clear();
            self.diagnosis.confusable.clear();
            if given.is_none() {
                // What is not named closes nothing; what it would is told of what is left.
                self.figures(selector, &before, &before);
                for own in &mut self.diagnosis.details.held_out {
                    own.after_n = own.before_n;
                }
            }
            self.band(problem, selector.folds, &before);
        } else {
            self.band(problem, selector.folds, &selection.best);
        }
        self.remark_on_explanation(&selection.best, given.is_some());
        self.diagnosis
    }

    /// The answer where the nominal model is at the floor, as far as that can be seen.
    fn without_gap(
        mut self,
        problem: &Problem<'_>,
        selector: &Selector<'_>,
        nominal: &Candidate,
    ) -> Diagnosis {
        let hidden = self.hidden(problem);
        self.diagnosis.verdict = if hidden.is_some() { Verdict::Unknown } else { Verdict::NoGap };
        hidden.into_iter().for_each(|why| self.remark(why));
        self.diagnosis.places.clear();
        self.diagnosis.details.maps.clear();
        self.diagnosis.details.on_vessel = None;
        self.figures(selector, nominal, nominal);
        self.diagnosis.details.series = series(problem, nominal, nominal);
        self.remark_on_forks(nominal);
        self.band(problem, selector.folds, nominal);
        self.diagnosis
    }

    /// What a reader of the explanation must know of it, however good it is.
    fn remark_on_explanation(&mut self, best: &Candidate, is_given: bool) {
        self.remark_on_forks(best);
        for (name, nuisances) in self.outside(best) {
            let verb = if nuisances.len() > 1 {
                "lie at the limits of their priors"
            } else {
                "lies at the limit of its prior"
            };
            self.remark(format!(
                "{} {verb}: the cause may be {name}, not a nuisance parameter",
                nuisances.join(", ")
            ));
        }
        let point = &best.fit.point;
        let named = best.fit.effects.iter();
        let misstated = named.filter_map(|&e| self.plant.misstated(e, &point.effects[e]));
        let misstated: Vec<String> = misstated.collect();
        misstated.into_iter().for_each(|remark| self.remark(remark));
        if is_given {
            self.remark("these effects were requested; no other effect was tried".to_owned());
        }
        if !self.diagnosis.effects.is_empty() && !is_given {
            self.remark(format!(
                "confidence is the share of bootstrap resamples of the blocks in which an effect \
                 wins, calibrated on {} effects that were named in {} cases with known effects",
                calibration::NAMED,
                calibration::CASES
            ));
        }
    }

    /// Why the floor of the force hides what a verdict would be about, if so.
    fn hidden(&self, problem: &Problem<'_>) -> Option<String> {
        let rms = |of: &dyn Fn(usize, usize) -> f64| {
            root_mean_square(problem, Quantity::Force, |trial, i| Some(of(trial, i)))
        };
        let floor_n = rms(&|trial, i| 1.0 / problem.weights(trial)[i])?;
        let measured_n = rms(&|trial, i| self.plant.trials()[trial].samples[i].value)?;
        self.plant.hidden(floor_n, measured_n)
    }

    /// What speaks against an explanation, however much it closes. `worst`: energy that it leaves in
    /// a quantity.
    fn objections(&self, problem: &Problem<'_>, selection: &Selection, worst: f64) -> Vec<String> {
        let best = &selection.best.fit;
        let id = |effect: usize| self.plant.effects()[effect].id;
        let at_bound = best.effects.iter().find(|e| at_bound(self.plant, **e, &best.point));
        // The floor of a drive says little of what is left, its share of the gap more.
        let leaves_much = match self.plant.cheap() {
            true => selection.best.score.shrink(&selection.nominal.score) < NEARLY_ALL,
            false => worst > NEAR_FLOOR,
        };
        let at_bound = at_bound.filter(|_| leaves_much).map(|&effect| {
            format!(
                "{} fits best at a bound of its parameters and leaves a large error: another cause \
                 is more likely",
                id(effect)
            )
        });
        let unmasked = unmasked(problem, selection).map(|(effect, what)| {
            format!("it looks like {}, but the data say it is {what}", id(effect))
        });
        at_bound.into_iter().chain(unmasked).collect()
    }

    fn rank(&mut self, selection: &Selection) {
        let effects = self.plant.effects();
        for &effect in &selection.failed {
            let id = effects[effect].id;
            self.remark(format!("the fit of {id} failed; it is not ranked"));
        }
        let scored = selection.singles.iter().enumerate().filter_map(|(effect, single)| {
            let shrink = single.as_ref()?.score.shrink_of_loss(&selection.nominal.score);
            Some(Ranked { id: effects[effect].id.to_owned(), shrink })
        });
        let mut ranking: Vec<Ranked> = scored.collect();
        ranking.sort_by(|a, b| b.shrink.total_cmp(&a.shrink));
        self.diagnosis.ranking = ranking;
    }

    fn lead(&self, named: &[(usize, Vec<usize>)]) -> Lead {
        let Some(first) = self.diagnosis.effects.first() else { return Lead::default() };
        let id = |effect: usize| self.plant.effects()[effect].id;
        let alike = named.iter().filter(|(effect, _)| id(*effect) == first.id);
        let alike: Vec<&str> = alike.flat_map(|(_, set)| set).map(|&effect| id(effect)).collect();
        let lead = Lead::of(&self.diagnosis.ranking, &first.id, &alike);
        // All that an axis does shows in one force: what cannot be told apart there is another name
        // of the effect, and is reported with it.
        if self.plant.cheap() { Lead { all: lead.told_apart, ..lead } } else { lead }
    }

    fn figures(&mut self, selector: &Selector<'_>, before: &Candidate, after: &Candidate) {
        let pairs = before.score.quantities.iter().zip(&after.score.quantities);
        let energy = pairs.map(|(&(quantity, before, _), &(_, after, _))| QuantityEnergy {
            quantity,
            before,
            after,
        });
        self.diagnosis.details.energy = energy.collect();
        self.diagnosis.gap = figures::gap(selector, before, after);
        self.diagnosis.held_out = self.plant.trials().iter().map(|trial| trial.number).collect();
    }

    /// How far the forces of a model may be off, and how many of those that were held out it holds.
    fn band(&mut self, problem: &Problem<'_>, folds: &Folds, of: &Candidate) {
        self.diagnosis.band = band::of(problem, folds, of);
    }

    fn path(&mut self, problem: &Problem<'_>, selection: &Selection) {
        let step = |(effects, score): &(Vec<usize>, Score)| PathStep {
            effects: effects.iter().map(|&e| self.plant.effects()[e].id.to_owned()).collect(),
            shrink: score.shrink(&selection.nominal.score),
            force_rms_n: score.rms(problem, Quantity::Force),
        };
        let path = &mut self.diagnosis.details.path;
        *path = selection.path.iter().map(step).collect();
        // The last step is the model that is reported, whose fit was refined since: its share is the
        // same everywhere.
        if let Some(last) = path.last_mut().filter(|last| !last.effects.is_empty()) {
            last.shrink = self.diagnosis.details.shrink;
        }
    }

    /// Fills in the named effects; gives them with what they are confused with.
    fn effects(
        &mut self,
        selector: &Selector<'_>,
        selection: &Selection,
    ) -> Vec<(usize, Vec<usize>)> {
        let problem = selector.problem;
        let has_rivals = self.diagnosis.asked_for.is_empty();
        let Some(nuisances) = &selection.nuisances else { return Vec::new() };
        let metric = Metric::new(nuisances, &selection.best.score);
        let sets = confusable(problem, selection, &metric);
        let spread = spread(problem, selector.folds, &selection.best, &metric);
        let increments = increments(selection);
        let (best, nominal) = (&selection.best.score, &selection.nominal.score);
        let id = |effect: usize| self.plant.effects()[effect].id.to_owned();
        let mut effects = Vec::new();
        for (effect, near) in &sets {
            let alone = selection.best.fit.effects.len() == 1;
            let without = if alone {
                Some(nominal.clone())
            } else {
                let own = selection.without.iter().find(|(e, _)| e == effect);
                own.map(|(_, candidate)| candidate.score.clone())
            };
            let step = selection.steps.iter().find(|step| step.effect == *effect);
            let frequency =
                step.map_or(0.0, |step| win_frequency(step, without.as_ref(), best, near));
            let open = without.as_ref().map_or(0.0, |w| (w.energy - best.energy).max(0.0));
            effects.push(NamedEffect {
                id: id(*effect),
                parameters: parameters(self.plant, &selection.best, *effect, &spread),
                confidence: has_rivals.then(|| calibration::probability(frequency)),
                shrink: increments.get(effect).copied().unwrap_or_default(),
                material: open.sqrt() > MATERIAL * nominal.energy.sqrt(),
            });
        }
        effects.sort_by(|a, b| b.shrink.total_cmp(&a.shrink));
        let set = |(effect, near): &(usize, Vec<usize>)| {
            let members = std::iter::once(*effect).chain(near.iter().copied());
            (!near.is_empty()).then(|| members.map(id).collect())
        };
        self.diagnosis.confusable = sets.iter().filter_map(set).collect();
        self.diagnosis.effects = effects;
        sets
    }

    /// The motion that separates the first confusable pair, else the best effect from the
    /// runner-up.
    fn next_experiment(&mut self, selection: &Selection, named: &[(usize, Vec<usize>)]) {
        let pairs = named.iter().filter_map(|(effect, near)| Some((*effect, *near.first()?)));
        let runner_up = selection
            .steps
            .first()
            .and_then(|step| Some((step.effect, step.rivals.first()?.effect)));
        for (effect, rival) in pairs.chain(runner_up) {
            let Some(step) = selection.steps.iter().find(|step| step.effect == effect) else {
                continue;
            };
            let known = step.rivals.iter().find(|r| r.effect == rival).map(|r| r.point.clone());
            let point = known.unwrap_or_else(|| self.swapped(selection, effect, rival));
            let chosen = (&step.point, effect);
            if let Some(next) = experiment::next(self.plant, chosen, (&point, rival)) {
                self.diagnosis.next_experiment = Some(next);
                return;
            }
        }
    }

    /// The best model with one effect replaced by another at the size that it had alone.
    fn swapped(&self, selection: &Selection, effect: usize, rival: usize) -> Point {
        let mut point = selection.best.fit.point.clone();
        let off = self.plant.effects()[effect].parameters.iter().map(|p| p.off);
        point.effects[effect] = off.collect();
        if let Some(single) = &selection.singles[rival] {
            point.effects[rival].clone_from(&single.fit.point.effects[rival]);
        }
        point
    }

    /// Nuisances that are at the limit of their prior in most trials, by the effect that they are.
    fn outside(&self, best: &Candidate) -> BTreeMap<&'static str, Vec<&'static str>> {
        let trials = best.fit.trials.len();
        let limit = 0.99 * crate::fitting::nuisance::NUISANCE_LIMIT;
        let mut outside: BTreeMap<&'static str, Vec<&'static str>> = BTreeMap::new();
        for (k, nuisance) in self.plant.nuisances().iter().enumerate() {
            let at = best.fit.trials.iter().filter(|t| t.refit.estimate[k].abs() >= limit).count();
            if let (true, Some(effect)) = (2 * at > trials, nuisance.effect) {
                outside.entry(effect).or_default().push(nuisance.name);
            }
        }
        outside
    }
}
