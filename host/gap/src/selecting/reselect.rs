//! A second look where an answer stays open: some pairs are fitted again with the finer model, and the
//! search continues from the best single effect.
//!
//! Pairs are first tried briefly and with corrected simulations. Near a bifurcation these fits stay on the
//! branch on which they began. They also begin with both effects at their single fits, which do not fit
//! together if the two bend the tip in opposite directions. Here each effect also begins beside the other.

use crate::fitting::fit::{Depth, Start};
use crate::parallel::each_some;
use crate::scoring::candidate::Candidate;
use crate::scoring::criteria::{NEAR_FLOOR, Parsimony, by_cost};
use crate::selecting::select::{DOMINANT, EXPLAINED, Selector};
use crate::selecting::selection::{Rival, Selection, Step};

/// Pairs that are fitted by the finer model: of those that promise most, and of those that came
/// lowest so far.
const PROMISING: usize = 2;
const LOWEST: usize = 1;
/// Shrink from which on the lowest of them is fitted to the end.
const WORTH_THE_END: f64 = 0.6;

impl Selector<'_> {
    /// Takes the pair that explains what the answer leaves open, if one does. `None` when a
    /// simulation breaks down.
    pub fn look_again(&self, selection: &mut Selection) -> Option<()> {
        if self.problem.plant.cheap() || !is_open(selection) {
            return Some(());
        }
        let polished = |pair: Candidate| {
            let pair = self.lower_from_singles(selection, pair);
            self.polished(&pair).filter(|found| !found.fit.failed)
        };
        let pairs = worth_a_look(selection);
        let mut found: Vec<Candidate> = each_some(pairs, polished);
        found.sort_by(|a, b| a.fit.loss.total_cmp(&b.fit.loss));
        let nominal = &selection.nominal.score;
        let worth = |pair: &&mut Candidate| pair.score.shrink(nominal) >= WORTH_THE_END;
        if let Some(lowest) = found.first_mut().filter(worth) {
            *lowest = self.to_the_end(lowest.clone());
        }
        by_cost(self.problem.plant, nominal.excess(), &mut found, |pair| pair);
        let Some(best) = found.first().filter(|pair| self.explains(selection, pair)) else {
            return Some(());
        };
        let steps = best.fit.effects.iter().map(|&effect| {
            let rivals = found[1..].iter().filter_map(|pair| rival(effect, best, pair)).collect();
            Step::of(effect, best, rivals)
        });
        let (best, steps) = (best.clone(), steps.collect());
        selection.steps.clear();
        selection.exchanged.clear();
        self.accept(selection, best, steps);
        self.finish(selection)
    }

    /// The pair, or what it comes to from either of its effects alone, the other one begun beside that, where
    /// that is lower.
    fn lower_from_singles(&self, selection: &Selection, pair: Candidate) -> Candidate {
        let effects = &pair.fit.effects;
        let begun = |fresh: usize| -> Option<Candidate> {
            let alone = effects.iter().find(|effect| **effect != fresh)?;
            let single = &selection.singles[*alone].as_ref()?.fit;
            let nuisances = self.nuisances_at(single)?;
            let (from, on) = (Start::Fit(single), [*alone, fresh]);
            let glance = self.candidate(Depth::Glance, &nuisances, from, &on, Some(fresh))?;
            self.candidate(Depth::Whole, &nuisances, Start::Fit(&glance.fit), &on, None)
        };
        let others = each_some(effects, |effect| begun(*effect));
        let lower = others.into_iter().filter(|own| own.fit.loss < pair.fit.loss);
        lower.min_by(|a, b| a.fit.loss.total_cmp(&b.fit.loss)).unwrap_or(pair)
    }

    /// Back from several effects to the best single one, or to none; on from that one if it was not tried
    /// yet and explains the gap: a pair that was better kept it from being extended.
    ///
    /// Where the answer closes enough, it stays. `None` when a simulation breaks down.
    pub fn single_again(&self, selection: &mut Selection) -> Option<()> {
        let closed = selection.best.score.shrink(&selection.nominal.score);
        if self.problem.plant.cheap() || closed >= EXPLAINED {
            return Some(());
        }
        if self.extended_single(selection)? {
            return Some(());
        }
        if selection.best.fit.effects.len() > 1 {
            self.back_to_single(selection);
            self.finish(selection)?;
        }
        Some(())
    }

    /// Whether the best single effect with others explains the gap, which then are the answer; else
    /// nothing is changed. `None` when a simulation breaks down.
    fn extended_single(&self, selection: &mut Selection) -> Option<bool> {
        let mut own = selection.clone();
        self.back_to_single(&mut own);
        let from = &own.best.fit.effects;
        if from.is_empty() || own.extended.contains(from) || !self.extend(&mut own) {
            return Some(false);
        }
        self.finish(&mut own)?;
        let explains = own.best.score.shrink(&own.nominal.score) >= EXPLAINED;
        if explains {
            *selection = own;
        }
        Some(explains)
    }

    fn back_to_single(&self, selection: &mut Selection) {
        selection.best = selection.nominal.clone();
        selection.steps.clear();
        selection.exchanged.clear();
        selection.path.push((Vec::new(), selection.nominal.score.clone()));
        self.first(selection);
    }

    /// Whether a pair leaves nothing open, and is better than what there was.
    fn explains(&self, selection: &Selection, pair: &Candidate) -> bool {
        let (plant, nominal, before) =
            (self.problem.plant, &selection.nominal.score, &selection.best);
        let pays = || {
            let more = pair.fit.parameters(plant).saturating_sub(before.fit.parameters(plant));
            Parsimony::of(plant, nominal).pays(&before.score, &pair.score, more)
        };
        pair.score.worst() <= NEAR_FLOOR
            && pair.score.shrink(nominal) >= EXPLAINED
            && match before.fit.effects.len() {
                0 | 1 => pays(),
                2 => pair.score.energy < before.score.energy,
                // Fewer effects that explain it go before more.
                _ => true,
            }
    }
}

/// Whether an answer leaves much, or needs many effects for little.
fn is_open(selection: &Selection) -> bool {
    let best = &selection.best;
    let shrink = best.score.shrink(&selection.nominal.score);
    let many = best.fit.effects.len() > 2;
    shrink < DOMINANT && (many || shrink < EXPLAINED || best.score.worst() > NEAR_FLOOR)
}

/// Pairs that were not taken, and those of the answer if it has more effects.
fn worth_a_look(selection: &Selection) -> Vec<Candidate> {
    let parts = selection.without.iter().map(|(_, without)| without);
    let mut pairs: Vec<&Candidate> = Vec::new();
    for pair in selection.pairs.iter().chain(parts).filter(|c| c.fit.effects.len() == 2) {
        let same =
            |known: &&Candidate| pair.fit.effects.iter().all(|e| known.fit.effects.contains(e));
        if !pairs.iter().any(same) {
            pairs.push(pair);
        }
    }
    let mut others = pairs.split_off(pairs.len().min(PROMISING));
    others.sort_by(|a, b| a.fit.loss.total_cmp(&b.fit.loss));
    pairs.into_iter().chain(others.into_iter().take(LOWEST)).cloned().collect()
}

/// What takes the place of an effect of the best pair, beside the same other one.
fn rival(effect: usize, best: &Candidate, pair: &Candidate) -> Option<Rival> {
    let beside = best.fit.effects.iter().find(|e| **e != effect)?;
    let other = pair.fit.effects.iter().find(|e| *e != beside)?;
    (pair.fit.effects.contains(beside) && *other != effect).then(|| Rival::of(*other, pair))
}

#[cfg(test)]
mod tests {
    use crate::fitting::fit::{Depth, Start};
    use crate::plant::Point;
    use crate::toy::{Toy, effect, explained_by, noise, parameter};

    const SAMPLES: usize = 400;
    const NOISE: f64 = 0.01;

    fn along(i: usize) -> f64 {
        i as f64 / SAMPLES as f64
    }

    fn curve(i: usize) -> f64 {
        (20.0 * along(i)).sin()
    }

    /// What is named where a slope was put in and something else, and the slope was found first. The
    /// coarse model has curves the wrong way round.
    fn named(more: impl Fn(usize) -> f64) -> Vec<usize> {
        let measured = |i: usize| 2.0 * along(i) + more(i) + NOISE * noise(i);
        let predict = |i: usize, point: &Point| {
            let (slope, here) = (point.effects[0][0], point.effects[1][0]);
            let at = point.anchor.effects[1][0];
            let curved = if point.anchor.is_everywhere { here } else { at - (here - at) };
            slope * along(i) + curved * curve(i)
        };
        let mut toy = Toy::new(0.01, NOISE, (0..SAMPLES).map(measured), predict).times(4);
        toy.effects =
            ["slope", "curve"].map(|id| effect(id, vec![parameter(id)], vec![vec![1.0]])).into();
        toy.cheap = false;
        explained_by(&toy, &[0], |selector, mut selection| {
            let nominal = &selection.nominal.fit;
            let nuisances = selector.nuisances_at(nominal).unwrap();
            let start = Point::nominal(&toy).anchored();
            let brief = |start| selector.candidate(Depth::Brief, &nuisances, start, &[0, 1], None);
            let brief = brief(Start::Point(&start)).unwrap();
            assert!(brief.fit.point.effects[1][0] <= 0.0, "the coarse model goes the wrong way");
            selection.pairs = vec![brief];
            selector.look_again(&mut selection).unwrap();
            selection.best.fit.effects.clone()
        })
    }

    #[test]
    fn a_pair_that_only_the_finer_model_can_fit_is_found() {
        assert_eq!(named(curve), [0, 1]);
    }

    #[test]
    fn a_pair_is_found_of_which_one_begins_where_both_together_never_come() {
        // The curve sets in above 2: below, nothing tells where it is.
        let measured = |i: usize| 2.0 * along(i) + 3.0 * curve(i) + NOISE * noise(i);
        let predict = |i: usize, point: &Point| {
            let (slope, here) = (point.effects[0][0], point.effects[1][0]);
            slope * along(i) + 3.0 * (here - 2.0).max(0.0) * curve(i)
        };
        let mut toy = Toy::new(0.01, NOISE, (0..SAMPLES).map(measured), predict).times(4);
        toy.effects = [("slope", 1.0), ("curve", 3.5)]
            .map(|(id, start)| effect(id, vec![parameter(id)], vec![vec![start]]))
            .into();
        toy.cheap = false;
        let named = explained_by(&toy, &[0], |selector, mut selection| {
            let nuisances = selector.nuisances_at(&selection.nominal.fit).unwrap();
            let mut start = Point::nominal(&toy).anchored();
            start.effects = vec![vec![2.0], vec![0.5]];
            let start = Start::Point(&start);
            let brief = selector.candidate(Depth::Brief, &nuisances, start, &[0, 1], None).unwrap();
            assert!(brief.fit.point.effects[1][0] < 2.0, "there is no way up");
            selection.pairs = vec![brief];
            selector.look_again(&mut selection).unwrap();
            selection.best.fit.effects.clone()
        });
        assert_eq!(named, [0, 1]);
    }

    /// Effects of the answer where a slope and a curve were put in, no pair is taken, and the slope was
    /// `tried` to be extended before.
    fn after_all(tried: bool) -> Vec<usize> {
        let measured = |i: usize| 2.0 * along(i) + curve(i) + NOISE * noise(i);
        let predict = |i: usize, point: &Point| {
            point.effects[0][0] * along(i) + point.effects[1][0] * curve(i)
        };
        let mut toy = Toy::new(0.01, NOISE, (0..SAMPLES).map(measured), predict).times(4);
        toy.effects =
            ["slope", "curve"].map(|id| effect(id, vec![parameter(id)], vec![vec![1.0]])).into();
        toy.cheap = false;
        explained_by(&toy, &[0], |selector, mut selection| {
            if tried {
                selection.extended.push(vec![0]);
            }
            selector.single_again(&mut selection).unwrap();
            selection.best.fit.effects.clone()
        })
    }

    #[test]
    fn the_best_single_effect_is_gone_on_from_where_that_was_not_tried() {
        assert_eq!(after_all(false), [0, 1]);
        assert_eq!(after_all(true), [0]);
    }

    #[test]
    fn what_no_pair_explains_stays_open() {
        assert_eq!(named(|i| (45.0 * along(i)).cos()), [0]);
        // Half of what is there is no curve.
        assert_eq!(named(|i| curve(i) + (45.0 * along(i)).cos()), [0]);
    }
}
