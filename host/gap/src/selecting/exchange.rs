//! Exchanges an effect of an explanation for one that it is easily confused with.
//!
//! Effects are added one after the other, and costly fits are cut short, so an effect may have been chosen
//! only because a better one was not in the model yet.

use crate::fitting::fit::{Depth, Start};
use crate::parallel::each_some;
use crate::plant::are_confused;
use crate::scoring::candidate::Candidate;
use crate::scoring::criteria::by_cost;
use crate::selecting::select::Selector;
use crate::selecting::selection::{Rival, Selection, Step};

/// Of what an effect is confused with, how many take its place in a fit.
const EXCHANGED: usize = 2;

/// Share of the gap that one may leave more than the answer and still be fitted by the finer model, which
/// closes little more.
const FAR: f64 = 0.25;
/// Fits by the finer model, one after the other, and the share of the loss that one must leave for
/// another to follow.
const POLISHED_AGAIN: usize = 3;
const LED_FAR: f64 = 0.8;
/// Share of the gap that an effect with fewer parameters may leave more than the only one, which it is
/// confused with: so much do shapes and ways past a fork differ, and what has more parameters follows them.
const OF_SHAPE: f64 = 0.03;

impl Selector<'_> {
    /// Exchanges the effect of several whose exchange lowers the error most, or one for what has fewer
    /// parameters and leaves little more; gives whether there was one. What was tried and is no better
    /// is kept.
    pub fn exchange(&self, selection: &mut Selection) -> bool {
        selection.exchanged.clear();
        let mut tried: Vec<(usize, usize, Candidate)> = Vec::new();
        for (effect, without) in &selection.without {
            tried.extend(self.in_place_of(selection, *effect, without));
        }
        tried.sort_by(|a, b| a.2.fit.loss.total_cmp(&b.2.fit.loss));
        let simpler = |(effect, rival, _): &&(usize, usize, Candidate)| {
            self.parameters(*rival) < self.parameters(*effect)
        };
        let Some(least) = tried.first() else { return false };
        let simplest = tried[1..].iter().find(simpler);
        let mut sides = vec![(None, selection.best.clone())];
        for (effect, rival, found) in [Some(least), simplest].into_iter().flatten().cloned() {
            if !is_far(selection, &found) {
                sides.push((Some((effect, rival)), self.to_the_end(found)));
            }
        }
        if let (Some((effect, rival)), candidate) = self.preferred(selection, sides) {
            put(selection, effect, rival, candidate);
            return true;
        }
        let kept = tried.iter().map(|(effect, rival, c)| (*effect, Rival::of(*rival, c)));
        selection.exchanged = kept.collect();
        false
    }

    /// Fits of what may stand in the place of an effect, from the model without it.
    fn in_place_of(
        &self,
        selection: &Selection,
        effect: usize,
        without: &Candidate,
    ) -> Vec<(usize, usize, Candidate)> {
        let Some(nuisances) = self.nuisances_at(&without.fit) else { return Vec::new() };
        let effects = self.problem.plant.effects();
        let rivals = (0..effects.len())
            .filter(|rival| are_confused(self.problem.plant, effect, *rival))
            .filter(|rival| !selection.best.fit.effects.contains(rival));
        let mut promised: Vec<(f64, usize)> = each_some(rivals, |rival| {
            Some((self.promise(selection, without, &nuisances, rival)?, rival))
        });
        promised.retain(|(promise, _)| *promise > 0.0);
        promised.sort_by(|a, b| b.0.total_cmp(&a.0));
        promised.truncate(EXCHANGED);
        let fitted = |(_, rival): (f64, usize)| {
            let mut on = without.fit.effects.clone();
            on.push(rival);
            let start = Start::Fit(&without.fit);
            let found = self.candidate(Depth::Whole, &nuisances, start, &on, Some(rival))?;
            (!found.fit.failed).then_some((effect, rival, found))
        };
        each_some(promised, fitted)
    }

    /// What may take the place of the only effect of a catheter, fitted by the finer model: all that
    /// it is confused with where it has turned into a limit of itself, else what of that has fewer
    /// parameters. Where trials go other ways at a fork, a fit with corrected simulations is stuck
    /// before it, and one with more parameters gets round.
    pub fn heirs(&self, selection: &Selection) -> Vec<usize> {
        let plant = self.problem.plant;
        let best = &selection.best.fit;
        let [effect] = best.effects[..] else { return Vec::new() };
        if plant.cheap() {
            return Vec::new();
        }
        let at_bound = best.at_bound(plant);
        let simpler = |rival: usize| self.parameters(rival) < self.parameters(effect);
        (0..selection.singles.len())
            .filter(|&rival| are_confused(plant, effect, rival) && (at_bound || simpler(rival)))
            .collect()
    }

    /// Fits heirs of the only effect to the end, by the finer model; the better one is the answer, or one
    /// with fewer parameters that is nearly as good.
    /// `None` when a simulation breaks down.
    pub fn give_way(&self, selection: &mut Selection, heirs: Vec<usize>) -> Option<()> {
        let effect = *selection.best.fit.effects.first()?;
        let nominal = &selection.nominal.fit;
        let nuisances = self.nuisances_at(nominal)?;
        let ended = |rival: usize| {
            let (off, on) = (Start::Fit(nominal), [rival]);
            let glance = self.candidate(Depth::Glance, &nuisances, off, &on, Some(rival))?;
            let start = Start::Fit(&glance.fit);
            let found = self.candidate(Depth::Whole, &nuisances, start, &on, None)?;
            (!found.fit.failed).then(|| (Some(rival), self.to_the_end(found)))
        };
        let mut sides: Vec<(Option<usize>, Candidate)> = each_some(heirs, ended);
        sides.push((None, selection.best.clone()));
        if let (Some(rival), candidate) = self.preferred(selection, sides) {
            selection.singles[rival] = Some(candidate.clone());
            put(selection, effect, rival, candidate);
            self.finish(selection)?;
        }
        Some(())
    }

    /// Of the answer (`None`) and what may take its place: the least costly one, or one that has fewer
    /// parameters and leaves little more.
    fn preferred<T>(
        &self,
        selection: &Selection,
        mut sides: Vec<(Option<T>, Candidate)>,
    ) -> (Option<T>, Candidate) {
        let (plant, gap) = (self.problem.plant, selection.nominal.score.excess());
        by_cost(plant, gap, &mut sides, |(_, candidate)| candidate);
        let first = &sides[0].1;
        let is_as_good = |(_, candidate): &(Option<T>, Candidate)| {
            candidate.fit.coordinates.len() < first.fit.coordinates.len()
                && candidate.score.excess() - first.score.excess() < OF_SHAPE * gap
                && !candidate.fit.at_bound(plant)
        };
        let taken = sides.iter().position(is_as_good).unwrap_or(0);
        sides.swap_remove(taken)
    }

    /// Fitted by the finer model.
    pub fn polished(&self, candidate: &Candidate) -> Option<Candidate> {
        let nuisances = self.nuisances_at(&candidate.fit)?;
        let (start, on) = (Start::Fit(&candidate.fit), &candidate.fit.effects);
        self.candidate(Depth::Polished, &nuisances, start, on, None)
    }

    /// Fitted by the finer model, once more where that led far.
    pub fn to_the_end(&self, candidate: Candidate) -> Candidate {
        let mut best = candidate;
        for _ in 0..POLISHED_AGAIN {
            let Some(polished) = self.polished(&best) else { break };
            let far = polished.fit.loss < LED_FAR * best.fit.loss;
            best = polished;
            if !far {
                break;
            }
        }
        best
    }
}

/// Whether one leaves far more than the answer.
fn is_far(selection: &Selection, candidate: &Candidate) -> bool {
    let more = candidate.score.excess() - selection.best.score.excess();
    more > FAR * selection.nominal.score.excess()
}

fn put(selection: &mut Selection, effect: usize, rival: usize, found: Candidate) {
    let displaced = Rival::of(effect, &selection.best);
    selection.path.push((found.fit.effects.clone(), found.score.clone()));
    selection.steps.retain(|step| step.effect != effect);
    selection.steps.push(Step::of(rival, &found, vec![displaced]));
    selection.best = found;
}

#[cfg(test)]
mod tests {
    use crate::plant::{Parameter, Plant, Point};
    use crate::toy::{Toy, effect, explained_by, noise, parameter};

    const SAMPLES: usize = 400;
    const NOISE: f64 = 0.01;
    /// The effects by index.
    const ALIKE: usize = 0;
    const TRUE: usize = 1;
    const OTHER: usize = 2;

    /// What an effect of size 1 does. The first does almost the same as the second.
    fn does(effect: usize, i: usize) -> f64 {
        let along = i as f64 / SAMPLES as f64;
        match effect {
            ALIKE => along,
            TRUE => along + 0.3 * along * along,
            _ => (9.0 * along).sin(),
        }
    }

    /// Measured: the second effect and the third. `says`: what the catalogue says that the first is
    /// confused with.
    fn toy(says: &'static [&'static str]) -> impl Plant {
        let measured = |i: usize| 2.0 * does(TRUE, i) + does(OTHER, i) + NOISE * noise(i);
        let predict = |i: usize, point: &Point| {
            (0..3).map(|effect| point.effects[effect][0] * does(effect, i)).sum::<f64>()
        };
        let mut toy = Toy::new(0.01, NOISE, (0..SAMPLES).map(measured), predict);
        let own = |id| effect(id, vec![parameter("size")], vec![vec![1.0]]);
        toy.effects = vec![own("alike"), own("true"), own("other")];
        toy.effects[ALIKE].confused_with = says;
        toy
    }

    #[test]
    fn an_effect_gives_way_to_one_that_it_is_confused_with_and_that_explains_more() {
        explained_by(&toy(&["true"]), &[ALIKE, OTHER], |selector, mut selection| {
            assert!(selector.exchange(&mut selection));
            let mut effects = selection.best.fit.effects.clone();
            effects.sort_unstable();
            assert_eq!(effects, [TRUE, OTHER]);
            assert!(selection.best.score.energy < 1.2, "{}", selection.best.score.energy);
            let displaced: Vec<usize> = selection
                .steps
                .iter()
                .filter(|step| step.effect == TRUE)
                .flat_map(|step| step.rivals.iter().map(|rival| rival.effect))
                .collect();
            assert_eq!(displaced, [ALIKE]);
        });
    }

    #[test]
    fn what_explains_less_stays_a_rival() {
        explained_by(&toy(&["true"]), &[TRUE, OTHER], |selector, mut selection| {
            assert!(!selector.exchange(&mut selection));
            assert_eq!(selection.best.fit.effects, [TRUE, OTHER]);
            let tried: Vec<(usize, usize)> =
                selection.exchanged.iter().map(|(effect, rival)| (*effect, rival.effect)).collect();
            assert_eq!(tried, [(TRUE, ALIKE)]);
        });
    }

    #[test]
    fn what_nobody_confuses_is_not_exchanged() {
        explained_by(&toy(&[]), &[ALIKE, OTHER], |selector, mut selection| {
            assert!(!selector.exchange(&mut selection));
            assert!(selection.exchanged.is_empty());
        });
    }

    /// A power of the way along, of an exponent from `low`, that is to be found as `exponent`; a line
    /// itself does not show in coarse simulations.
    fn powers(low: f64, exponent: f64) -> impl Plant {
        let along = |i: usize| (i as f64 + 0.5) / SAMPLES as f64;
        let measured = move |i: usize| 2.0 * along(i).powf(exponent) + NOISE * noise(i);
        let predict = move |i: usize, point: &Point| {
            let (power, line) = (&point.effects[0], point.effects[1][0]);
            let shown = if point.anchor.is_everywhere { line } else { point.anchor.effects[1][0] };
            power[0] * along(i).powf(power[1]) + shown * along(i)
        };
        let mut toy = Toy::new(0.01, NOISE, (0..SAMPLES).map(measured), predict);
        toy.cheap = false;
        let exponent = Parameter { low, high: 3.0, off: 2.0, ..parameter("exponent") };
        toy.effects = vec![
            effect("power", vec![parameter("size"), exponent], vec![vec![1.0, 2.0]]),
            effect("line", vec![parameter("size")], vec![vec![1.0]]),
        ];
        toy.effects[0].confused_with = &["line"];
        toy
    }

    #[test]
    fn a_limit_of_itself_and_what_has_more_parameters_give_way_to_the_effect_that_it_is() {
        for low in [1.0, 0.2] {
            explained_by(&powers(low, 1.0), &[0], |selector, mut selection| {
                let is_limit = selection.best.fit.at_bound(selector.problem.plant);
                assert_eq!(is_limit, low == 1.0);
                let heirs = selector.heirs(&selection);
                assert_eq!(heirs, [1]);
                selector.give_way(&mut selection, heirs).unwrap();
                assert_eq!(selection.best.fit.effects, [1]);
                let size = selection.best.fit.point.effects[1][0];
                assert!((size - 2.0).abs() < 0.01, "{size}");
                assert!(selector.heirs(&selection).is_empty());
            });
        }
    }

    #[test]
    fn what_has_fewer_parameters_is_taken_where_it_leaves_little_more() {
        let named = |exponent: f64| {
            explained_by(&powers(0.2, exponent), &[0], |selector, mut selection| {
                let heirs = selector.heirs(&selection);
                selector.give_way(&mut selection, heirs).unwrap();
                selection.best.fit.effects.clone()
            })
        };
        assert_eq!(named(1.02), [1]);
        assert_eq!(named(1.5), [0]);
    }

    #[test]
    fn what_has_fewer_parameters_is_taken_beside_another_effect_too() {
        let along = |i: usize| (i as f64 + 0.5) / SAMPLES as f64;
        let wave = move |i: usize| (9.0 * along(i)).sin();
        let named = |exponent: f64| {
            let measured =
                move |i: usize| 2.0 * along(i).powf(exponent) + wave(i) + NOISE * noise(i);
            let predict = move |i: usize, point: &Point| {
                let (power, line) = (&point.effects[0], point.effects[1][0]);
                let wavy = point.effects[2][0] * wave(i);
                power[0] * along(i).powf(power[1]) + line * along(i) + wavy
            };
            let mut toy = Toy::new(0.01, NOISE, (0..SAMPLES).map(measured), predict);
            toy.cheap = false;
            let size = || vec![parameter("size")];
            let exponent = Parameter { low: 0.2, high: 3.0, off: 2.0, ..parameter("exponent") };
            toy.effects = vec![
                effect("power", vec![parameter("size"), exponent], vec![vec![1.0, 2.0]]),
                effect("line", size(), vec![vec![1.0]]),
                effect("wave", size(), vec![vec![1.0]]),
            ];
            toy.effects[0].confused_with = &["line"];
            explained_by(&toy, &[0, 2], |selector, mut selection| {
                selector.exchange(&mut selection);
                let mut effects = selection.best.fit.effects.clone();
                effects.sort_unstable();
                effects
            })
        };
        assert_eq!(named(1.02), [1, 2]);
        assert_eq!(named(1.5), [0, 2]);
    }
}
