//! Removes effects that are not needed any more, and fits the best model without each of the others.

use crate::fitting::fit::{Depth, Start, is_slight};
use crate::fitting::nuisance::Nuisances;
use crate::plant::{Plant, Point};
use crate::scoring::candidate::Candidate;
use crate::scoring::criteria::{Parsimony, predicts_less};
use crate::scoring::score::Score;
use crate::selecting::select::Selector;
use crate::selecting::selection::Selection;

/// Share of the gap from which on one of two effects may be all there is: it is fitted by the finer
/// model before the other is said to be needed, which may stand for what its fit had left.
const MAYBE_ALL: f64 = 0.6;
/// And the most that the other may close then: more is not what a fit leaves.
const MAYBE_LEFT: f64 = 0.15;

impl Selector<'_> {
    /// Fits the best model to the end, with its nuisances linearised there, and takes out what
    /// does not pay any more, one after the other. `None` when a simulation breaks down.
    pub fn finish(&self, selection: &mut Selection) -> Option<()> {
        let plant = self.problem.plant;
        let parsimony = Parsimony::of(plant, &selection.nominal.score);
        loop {
            let nuisances = self.polish(selection)?;
            let effects = selection.best.fit.effects.clone();
            selection.without.clear();
            if effects.len() < 2 {
                selection.nuisances = Some(nuisances);
                return Some(());
            }
            let mut idle: Option<(usize, Candidate)> = None;
            for effect in effects {
                let Some(without) = self.without(selection, &nuisances, effect) else { continue };
                alone_after_all(selection, &without);
                let parameters = self.parameters(effect);
                let point = &selection.best.fit.point;
                let slight = match plant.cheap() {
                    true => is_within_prior(plant, effect, point),
                    false => is_slight(plant, effect, point),
                };
                let needed = !slight
                    && parsimony.is_needed(&without.score, &selection.best.score, parameters);
                let energy = |c: &Candidate| c.score.energy;
                if !needed && idle.as_ref().is_none_or(|(_, i)| energy(&without) < energy(i)) {
                    idle = Some((effect, without));
                } else if needed {
                    selection.without.push((effect, without));
                }
            }
            let Some((effect, candidate)) = idle else {
                selection.nuisances = Some(nuisances);
                return Some(());
            };
            selection.path.push((candidate.fit.effects.clone(), candidate.score.clone()));
            selection.best = candidate;
            selection.steps.retain(|step| step.effect != effect);
        }
    }

    /// The same without taking anything out.
    pub fn complete(&self, selection: &mut Selection) -> Option<()> {
        let nuisances = self.polish(selection)?;
        let effects =
            selection.best.fit.effects.iter().filter(|_| selection.best.fit.effects.len() > 1);
        let without = |&effect| Some((effect, self.without(selection, &nuisances, effect)?));
        let without: Vec<_> = effects.filter_map(without).collect();
        (selection.without, selection.nuisances) = (without, Some(nuisances));
        Some(())
    }

    /// Gives the nuisances at the best model, which it fits to the end.
    fn polish(&self, selection: &mut Selection) -> Option<Nuisances> {
        let best = &selection.best.fit;
        let nuisances = self.nuisances_at(best)?;
        if !best.effects.is_empty() && !self.problem.plant.cheap() {
            let start = Start::Fit(best);
            let polished = self.candidate(Depth::Polished, &nuisances, start, &best.effects, None);
            // Near a threshold, the last of the way down may be the noise of one trial.
            let gap = selection.nominal.score.excess();
            let keeps = |p: &Candidate| !predicts_less(&selection.best.score, &p.score, gap);
            if let Some(polished) = polished.filter(keeps) {
                selection.best = polished;
            }
        }
        Some(nuisances)
    }

    /// The best model with one effect taken out, the others refitted.
    fn without(
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
        let start = start.anchored();
        let own = self.candidate(Depth::Whole, nuisances, Start::Point(&start), &left, None)?;
        // One that is left alone may have found another way down by itself.
        let alone = match left.as_slice() {
            [other] => selection.singles[*other].as_ref(),
            _ => None,
        };
        let again = alone.filter(|alone| alone.fit.loss < own.fit.loss).and_then(|alone| {
            self.candidate(Depth::Whole, nuisances, Start::Fit(&alone.fit), &left, None)
        });
        let best = again.filter(|again| again.fit.loss < own.fit.loss).unwrap_or(own);
        let shrink = |score: &Score| score.shrink(&selection.nominal.score);
        let (alone, both) = (shrink(&best.score), shrink(&selection.best.score));
        let maybe_all = alone >= MAYBE_ALL && both - alone <= MAYBE_LEFT;
        if left.len() != 1 || !maybe_all || self.problem.plant.cheap() {
            return Some(best);
        }
        Some(self.to_the_end(best))
    }
}

/// Whether an effect of a drive does no more than the nuisance that stands for it may: nuisances are
/// linear, and where friction turns over what a millisecond does is not.
fn is_within_prior(plant: &dyn Plant, effect: usize, point: &Point) -> bool {
    let own = &plant.effects()[effect];
    let [parameter] = &own.parameters[..] else { return false };
    let size = (point.effects[effect][0] - parameter.off).abs();
    plant.nuisances().iter().any(|nuisance| nuisance.effect == Some(own.id) && size <= nuisance.sd)
}

/// Takes note of a single effect that lies lower than where its own fit had ended.
fn alone_after_all(selection: &mut Selection, found: &Candidate) {
    let [effect] = found.fit.effects[..] else { return };
    let known = selection.singles[effect].as_ref();
    if known.is_none_or(|known| found.score.energy < known.score.energy) {
        selection.singles[effect] = Some(found.clone());
    }
}

#[cfg(test)]
mod tests {
    use crate::plant::Point;
    use crate::toy::{Toy, effect, explained_by, noise, parameter};

    const SAMPLES: usize = 400;
    const NOISE: f64 = 0.01;

    fn along(i: usize) -> f64 {
        i as f64 / SAMPLES as f64
    }

    /// Effects that are named where a slope of 2 standard deviations and a curve of some were put in.
    fn named(curve: f64, cheap: bool) -> Vec<usize> {
        let shape = |i: usize| (20.0 * along(i)).sin();
        let measured = |i: usize| 2.0 * along(i) + curve * shape(i) + NOISE * noise(i);
        let predict = move |i: usize, point: &Point| {
            point.effects[0][0] * along(i) + point.effects[1][0] * shape(i)
        };
        let mut toy = Toy::new(0.01, NOISE, (0..SAMPLES).map(measured), predict).times(4);
        toy.effects =
            ["slope", "curve"].map(|id| effect(id, vec![parameter(id)], vec![vec![1.0]])).into();
        toy.cheap = cheap;
        explained_by(&toy, &[0, 1], |selector, mut selection| {
            selector.finish(&mut selection).unwrap();
            selection.best.fit.effects.clone()
        })
    }

    #[test]
    fn a_second_effect_of_a_catheter_that_is_slight_is_taken_out() {
        assert_eq!(named(0.4, false), [0, 1]);
        assert_eq!(named(0.1, false), [0]);
        // The same is plain in the data, and a drive has it.
        assert_eq!(named(0.1, true), [0, 1]);
    }
}
