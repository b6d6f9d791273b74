//! Assembles the answer step by step: verdict, effects, figures and remarks.

use std::collections::BTreeMap;

use crate::data::unlike_trials::unlike;
use crate::deciding::confidence::confidence;
use crate::deciding::form::form;
use crate::deciding::interval::{parameters, spread};
use crate::deciding::verdict::{verdict, verdict_of_request};
use crate::diagnosis::report::{
    Details, Diagnosis, NamedEffect, PathStep, QuantityEnergy, Ranked, Verdict,
};
use crate::explaining::band;
use crate::explaining::figures;
use crate::explaining::increments::increments;
use crate::explaining::locate::locate;
use crate::explaining::map::maps;
use crate::explaining::on_vessel::on_vessel;
use crate::explaining::remainder::left;
use crate::explaining::series::{held_out, series};
use crate::fitting::fit::at_bound;
use crate::fitting::problem::Problem;
use crate::noise::floor::{Floor, FloorSource};
use crate::planning::experiment;
use crate::plant::{Plant, Quantity};
use crate::scoring::candidate::Candidate;
use crate::scoring::folds::Folds;
use crate::scoring::metric::Metric;
use crate::scoring::score::{Score, root_mean_square};
use crate::searching::selection::Selection;
use crate::searching::selector::Selector;

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

    /// Searches for an explanation, or takes the one that is given, and says all that there is about it.
    pub fn finish(
        mut self,
        problem: &Problem<'_>,
        selector: &Selector<'_>,
        nominal: Candidate,
        given: Option<&[usize]>,
    ) -> Diagnosis {
        let asked_for =
            given.unwrap_or_default().iter().map(|&e| self.plant.effects()[e].id.to_owned());
        self.diagnosis.asked_for = asked_for.collect();
        let before = nominal.clone();
        let selected = match given {
            None => selector.search(nominal),
            Some(effects) => selector.take(nominal, effects),
        };
        let Some(selection) = selected else {
            return self
                .inconclusive("a simulation broke down while candidates were fitted".to_owned());
        };
        self.rank(&selection);
        self.diagnosis.details.sets = selection.sets.clone();
        let shrink = selection.best.score.shrink(&before.score);
        let mut set = selection.best.fit.effects.clone();
        set.sort_unstable();
        let worst = before.score.worst();
        let is_stretched = !before.fit.stretched().is_empty();
        let closed = selection.best.score.shrink_of_loss(&before.score);
        let rules = &problem.rules.verdict;
        let mut verdict = match given {
            None => verdict(rules, &selection.posterior, &set, closed, worst, is_stretched),
            Some(_) => verdict_of_request(rules, &selection.posterior, &set, closed),
        };
        self.diagnosis.none_of_mine = selection.posterior.none_of_mine();
        self.diagnosis.detectable.clone_from(&selection.detectable);
        if problem.is_cut() {
            self.diagnosis.cut = true;
            self.remark(
                "the search was ended before its time: this is the best answer so far, and another \
                 effect may explain more"
                    .to_owned(),
            );
        }
        if verdict == Verdict::NoGap && given.is_none() {
            return self.without_gap(problem, selector, &before);
        }
        self.diagnosis.places = locate(problem, &before.score);
        self.diagnosis.details.maps = maps(problem, &before.score);
        self.diagnosis.details.on_vessel = on_vessel(problem, &before.score);
        self.figures(selector, &before, &selection.best);
        self.diagnosis.details.held_out = held_out(problem, &selection);
        self.diagnosis.series = series(problem, &before, &selection.best);
        self.diagnosis.details.shrink = shrink;
        self.path(problem, &selection);
        let named = self.effects(selector, &selection);
        let objections = self.objections(problem, &selection);
        if !objections.is_empty() && given.is_none() {
            if verdict != Verdict::Unknown {
                self.diagnosis.details.objection = objections.first().cloned();
            }
            verdict = Verdict::Unknown;
        }
        objections.into_iter().for_each(|objection| self.remark(objection));
        self.diagnosis.verdict = verdict;
        self.next_experiment(&selection, &named);
        if matches!(verdict, Verdict::Partial | Verdict::Unknown) {
            self.diagnosis.left = Some(left(selector, &selection));
            self.diagnosis.details.left_on_vessel = on_vessel(problem, &selection.best.score);
            unlike(problem, &before.score).into_iter().for_each(|remark| self.remark(remark));
        }
        if verdict == Verdict::Unknown && given.is_none() {
            self.diagnosis.effects.clear();
            self.diagnosis.confusable.clear();
            // What is not named closes nothing; what it would is told of what is left.
            self.figures(selector, &before, &before);
            for own in &mut self.diagnosis.details.held_out {
                own.after_n = own.before_n;
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
        let is_known = hidden.is_none() && self.floor_known && !self.is_blind();
        self.diagnosis.verdict = if is_known { Verdict::NoGap } else { Verdict::Inconclusive };
        hidden.into_iter().for_each(|why| self.remark(why));
        self.figures(selector, nominal, nominal);
        self.diagnosis.series = series(problem, nominal, nominal);
        self.remark_on_forks(nominal);
        self.band(problem, selector.folds, nominal);
        self.diagnosis
    }

    /// Whether most effects would have gone unnoticed at their usual size.
    fn is_blind(&self) -> bool {
        let all = &self.diagnosis.detectable;
        let seen = all.iter().filter(|own| own.is_seen_as_usual).count();
        2 * seen < all.len()
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

    /// What speaks against an explanation, however probable it is.
    fn objections(&self, problem: &Problem<'_>, selection: &Selection) -> Vec<String> {
        let best = &selection.best;
        let measured = |trial: usize, i: usize| Some(self.plant.trials()[trial].samples[i].value);
        // Where a sensor shows little but its noise, any model leaves as much as was measured.
        let above = |energy: f64| energy > problem.rules.verdict.gap;
        let forces = best.score.quantities.iter().filter(|(own, ..)| own.is_force());
        let as_large = forces.filter(|(_, energy, _)| above(*energy)).find_map(|(own, ..)| {
            let left = best.score.rms(problem, *own)?;
            (left >= root_mean_square(problem, *own, measured)?).then_some(())
        });
        let as_large = as_large.map(|()| {
            "the error that is left is as large as what was measured: the model has the wrong units, \
             or it is of another rig"
                .to_owned()
        });
        let is_at = |e: &&usize| at_bound(self.plant, **e, &best.fit.point);
        let bound = best.fit.effects.iter().find(is_at);
        let bound = bound.filter(|_| problem.rules.search.refuses_bounds);
        let bound = bound.map(|&effect| {
            format!(
                "{} fits best at a bound of its parameters: another cause is more likely",
                self.plant.effects()[effect].id
            )
        });
        as_large.into_iter().chain(bound).collect()
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
        let Some(nuisances) = &selection.nuisances else { return Vec::new() };
        let (best, posterior) = (&selection.best, &selection.posterior);
        let has_rivals = self.diagnosis.asked_for.is_empty();
        let rules = &selector.problem.rules.confidence;
        let metric = Metric::new(nuisances, &best.score);
        let spread = spread(selector.problem, selector.folds, best, &metric);
        let increments = increments(selection);
        let mut set = best.fit.effects.clone();
        set.sort_unstable();
        let nominal = &selection.nominal.score;
        let named = |&effect: &usize| {
            let without = match selection.without.iter().find(|(e, _)| *e == effect) {
                Some((_, without)) => without.score.energy,
                None => nominal.energy,
            };
            let open = (without - best.score.energy).max(0.0);
            let own = NamedEffect {
                id: self.plant.effects()[effect].id.to_owned(),
                what: self.plant.effects()[effect].what,
                form: form(self.plant, posterior, effect),
                parameters: parameters(self.plant, best, effect, &spread),
                confidence: has_rivals.then(|| confidence(rules, self.plant, posterior, effect)),
                shrink: increments.get(&effect).copied().unwrap_or_default(),
                material: open.sqrt()
                    > selector.problem.rules.verdict.material * nominal.energy.sqrt(),
            };
            (own, effect, posterior.in_place_of(&set, effect))
        };
        let mut found: Vec<(NamedEffect, usize, Vec<usize>)> = set.iter().map(named).collect();
        found.sort_by(|a, b| b.0.shrink.total_cmp(&a.0.shrink));
        name_forms(self.plant, &mut found);
        let id = |effect: &usize| self.plant.effects()[*effect].id.to_owned();
        let alike = |(_, effect, rivals): &(NamedEffect, usize, Vec<usize>)| {
            let members = std::iter::once(effect).chain(rivals);
            (!rivals.is_empty()).then(|| members.map(id).collect())
        };
        self.diagnosis.confusable = found.iter().filter_map(alike).collect();
        let sets = found.iter().map(|(_, effect, rivals)| (*effect, rivals.clone())).collect();
        self.diagnosis.effects = found.into_iter().map(|(own, ..)| own).collect();
        sets
    }

    /// The motion that separates the first effect from one that it cannot be told apart from, else the
    /// most probable explanation from the next one.
    fn next_experiment(&mut self, selection: &Selection, named: &[(usize, Vec<usize>)]) {
        let best = &selection.best.fit;
        let other = |set: &[usize]| set.iter().copied().find(|e| !best.effects.contains(e));
        let alike = named.iter().find_map(|(effect, rivals)| Some((*effect, *rivals.first()?)));
        let next =
            selection.posterior.sets.iter().filter_map(|own| Some((own, other(&own.effects)?)));
        let rival = match alike {
            Some((_, rival)) => next.clone().find(|(_, effect)| *effect == rival),
            None => next.clone().next(),
        };
        let first = alike.map(|(effect, _)| effect).or(named.first().map(|(effect, _)| *effect));
        let (Some(effect), Some((own, rival))) = (first, rival) else { return };
        let chosen = (&best.point, effect);
        self.diagnosis.next_experiment = experiment::next(self.plant, chosen, (&own.point, rival));
    }

    /// Nuisances that are at the limit of their prior in most trials, by the effect that they are.
    fn outside(&self, best: &Candidate) -> BTreeMap<&'static str, Vec<&'static str>> {
        let mut outside: BTreeMap<&'static str, Vec<&'static str>> = BTreeMap::new();
        for k in best.fit.stretched() {
            let nuisance = &self.plant.nuisances()[k];
            if let Some(effect) = nuisance.effect {
                outside.entry(effect).or_default().push(nuisance.name);
            }
        }
        outside
    }
}

/// Names the forms that a parameter of an effect tells apart.
///
/// Dry friction that sets in over a presliding distance is that of Dahl; beside friction that falls as motion sets in it
/// is that of LuGre (Canudas de Wit and others 1995) without micro-damping, whose bristles have the stiffness of dry
/// friction over that distance. Bending of which a part relaxes is that of a standard linear solid.
fn name_forms(plant: &dyn Plant, named: &mut [(NamedEffect, usize, Vec<usize>)]) {
    /// Over the usual size of the parameter: what is smaller cannot be told from the plain form.
    const SEEN: f64 = 0.05;

    let falls = named.iter().any(|(own, ..)| own.id == "drive.stribeck");
    let with_presliding = if falls { "LuGre" } else { "Dahl" };
    let forms = [
        ("drive.coulomb", "presliding", with_presliding),
        ("instrument.viscoelastic", "ratio", "standard linear solid"),
    ];
    for (own, effect, _) in named {
        let Some((_, parameter, name)) = forms.iter().find(|(id, ..)| own.id == *id) else {
            continue;
        };
        let parameters = &plant.effects()[*effect].parameters;
        let is_seen = parameters.iter().find(|p| p.name.starts_with(parameter)).is_some_and(|p| {
            let found = own.parameters.get(p.name);
            found.is_some_and(|found| found.low > 0.0 && found.value > SEEN * p.scale)
        });
        if let Some(form) = own.form.as_mut().filter(|_| is_seen) {
            form.name = name;
        }
    }
}
