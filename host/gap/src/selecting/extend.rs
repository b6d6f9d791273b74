//! Adds one effect to the best model.

use nalgebra::{DMatrix, DVector};

use crate::fitting::fit::{Depth, Fit, Start};
use crate::fitting::nuisance::{Nuisances, most_left, telling};
use crate::fitting::swing::guess;
use crate::parallel::each_some;
use crate::scoring::candidate::Candidate;
use crate::scoring::criteria::{Parsimony, by_cost};
use crate::selecting::select::{MOST_EFFECTS, Selector};
use crate::selecting::selection::{Rival, Selection, Step};

/// Candidates that are refitted in every round.
const REFITTED_MORE: usize = 3;
/// Effects of which two are tried together.
const SCREENED_FOR_TWO: usize = 6;
/// Of the evidence that the first one promises, what another must promise to be refitted.
const WORTH_A_FIT: f64 = 0.4;

impl Selector<'_> {
    /// Adds the effect that helps most, if it pays; where simulations cost nothing, the two that help
    /// most together, where neither pays without the other.
    pub fn extend(&self, selection: &mut Selection) -> bool {
        selection.extended.push(selection.best.fit.effects.clone());
        let base = &selection.best;
        let Some(nuisances) = self.nuisances_at(&base.fit) else { return false };
        let more = (0..self.problem.plant.effects().len())
            .filter(|effect| !base.fit.effects.contains(effect));
        let mut screened: Vec<(f64, usize)> = each_some(more, |effect| {
            Some((self.promise(selection, base, &nuisances, effect)?, effect))
        });
        screened.sort_by(|a, b| b.0.total_cmp(&a.0));
        let enough = screened.first().map_or(0.0, |(best, _)| best.max(0.0) * WORTH_A_FIT);
        let worth = screened.iter().filter(|(promise, _)| *promise > enough);
        let one = worth.take(REFITTED_MORE).map(|(_, effect)| vec![*effect]).collect();
        let ways = self.refitted(selection, &nuisances, one);
        if selection.best.fit.effects.len() == 1 {
            selection.pairs.extend(ways.iter().map(|(_, candidate)| candidate.clone()));
        }
        if self.add(selection, ways) {
            return true;
        }
        if !self.problem.plant.cheap() || selection.best.fit.effects.len() + 2 > MOST_EFFECTS {
            return false;
        }
        let mut first: Vec<usize> =
            screened.iter().take(SCREENED_FOR_TWO).map(|(_, effect)| *effect).collect();
        // The last one of two is searched for from its switch-on values: what is linear goes before.
        first.sort_unstable();
        let with = |(k, a): (usize, &usize)| first[k + 1..].iter().map(|b| vec![*a, *b]).collect();
        let two = first.iter().enumerate().flat_map::<Vec<_>, _>(with).collect();
        let ways = self.refitted(selection, &nuisances, two);
        self.add(selection, ways)
    }

    /// The best model with more effects, in each of some ways; the least costly first.
    fn refitted(
        &self,
        selection: &Selection,
        nuisances: &Nuisances,
        ways: Vec<Vec<usize>>,
    ) -> Vec<(Vec<usize>, Candidate)> {
        let base = &selection.best.fit;
        let fitted = |added: Vec<usize>| {
            let effects = [&base.effects[..], &added].concat();
            let (start, last) = (Start::Fit(base), added.last().copied());
            let candidate = self.candidate(Depth::Whole, nuisances, start, &effects, last);
            Some((added, candidate.filter(|c| !c.fit.failed)?))
        };
        let mut refitted = each_some(ways, fitted);
        // What acts on the plant comes before what acts on its sensors.
        refitted.sort_by(|(a, _), (b, _)| a.cmp(b));
        let gap = selection.nominal.score.excess();
        by_cost(self.problem.plant, gap, &mut refitted, |(_, candidate)| candidate);
        refitted
    }

    /// Takes the first of these ways to extend the best model, if it pays.
    fn add(&self, selection: &mut Selection, ways: Vec<(Vec<usize>, Candidate)>) -> bool {
        let Some((added, best)) = ways.first() else { return false };
        let parsimony = Parsimony::of(self.problem.plant, &selection.nominal.score);
        let parameters = added.iter().map(|effect| self.parameters(*effect)).sum();
        if !parsimony.pays(&selection.best.score, &best.score, parameters) {
            return false;
        }
        let steps: Vec<Step> = added
            .iter()
            .map(|effect| {
                // A rival takes the place of one effect, beside the same other one.
                let beside = |way: &[usize]| added.iter().all(|e| e == effect || way.contains(e));
                let rival = |(way, candidate): &(Vec<usize>, Candidate)| {
                    let other = way.iter().find(|e| !added.contains(e))?;
                    beside(way).then(|| Rival::of(*other, candidate))
                };
                Step::of(*effect, best, ways[1..].iter().filter_map(rival).collect())
            })
            .collect();
        self.accept(selection, best.clone(), steps);
        true
    }

    /// What an effect on top of a model promises to first order, in the terms of evidence: by its
    /// derivatives there, and by what it does where it would begin. Where simulations cost
    /// something, the trials decide that have most of the gap left.
    pub fn promise(
        &self,
        selection: &Selection,
        base: &Candidate,
        nuisances: &Nuisances,
        effect: usize,
    ) -> Option<f64> {
        let base = &base.fit;
        let mut watched: Vec<usize> = (0..base.trials.len()).collect();
        if !self.problem.plant.cheap() {
            let refits = base.trials.iter().map(|trial| &trial.refit);
            watched = telling(refits);
        }
        let raw: Vec<_> = watched.iter().map(|&trial| base.trials[trial].raw.clone()).collect();
        let own = self.problem.coordinates(&[effect]);
        let derivatives = self.problem.sensitivities(&watched, &base.point, &raw, &own)?;
        let begins = self.beginning(selection, base, nuisances, effect);
        let shown = begins.and_then(|values| {
            let mut point = base.point.clone();
            point.effects[effect] = values;
            self.problem.residuals_of(&watched, &point)
        });
        let known = base.coordinates.len();
        let k = known + own.len() + usize::from(shown.is_some());
        let (mut normal, mut slope) = (DMatrix::zeros(k, k), DVector::zeros(k));
        let mut loss = 0.0;
        for (i, &trial) in watched.iter().enumerate() {
            let trial = &base.trials[trial];
            let does = shown.as_ref().map(|on| trial.refit.project_column(&(&on[i] - &raw[i])));
            let derived = trial.refit.project(&derivatives[i]);
            let columns = trial.jacobian.column_iter().chain(derived.column_iter());
            let mut columns: Vec<DVector<f64>> = columns.map(|c| c.into_owned()).collect();
            columns.extend(does);
            let columns = DMatrix::from_columns(&columns);
            normal += columns.tr_mul(&columns);
            slope += columns.tr_mul(&trial.refit.pull);
            loss += trial.refit.energy();
        }
        let gain = explained(&normal, &slope, k) - explained(&normal, &slope, known);
        let share = (gain / loss.max(f64::MIN_POSITIVE)).clamp(0.0, 0.999_999);
        let effective = selection.best.score.effective.max(2.0);
        Some(-effective * (1.0 - share).ln() - own.len() as f64 * effective.ln())
    }

    /// Where an effect would begin on top of a model: as it swings there; else as it shows alone,
    /// or at the switch-on value whose doing explains most of the trial with most of the gap left.
    /// What is at a place shows alone at another place than beside the effect that hides it.
    fn beginning(
        &self,
        selection: &Selection,
        base: &Fit,
        nuisances: &Nuisances,
        effect: usize,
    ) -> Option<Vec<f64>> {
        let refits: Vec<_> = base.trials.iter().map(|trial| &trial.refit).enumerate().collect();
        if let Some(values) = guess(self.problem, effect, nuisances, &refits) {
            return Some(values);
        }
        let refits = base.trials.iter().map(|trial| &trial.refit);
        let deciding = *most_left(refits, 1).first()?;
        let off = &base.trials[deciding];
        let explains = |values: &Vec<f64>| -> Option<f64> {
            let mut point = base.point.clone();
            point.effects[effect].clone_from(values);
            let raw = self.problem.residual(deciding, &point)?;
            let does = off.refit.project_column(&(&raw - &off.raw));
            let slope = does.dot(&off.refit.pull);
            Some(slope * slope / does.norm_squared().max(f64::MIN_POSITIVE))
        };
        let alone = selection.shown[effect].as_ref().map(|shown| &shown.point.effects[effect]);
        let starts = self.problem.plant.effects()[effect].starts.iter().chain(alone);
        let scored = starts.filter_map(|values| Some((explains(values)?, values)));
        let (_, best) = scored.max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(best.clone())
    }
}

/// What the first `k` of some columns explain of a residual, from their inner products with each
/// other and with it. Columns of any size, and some of them zero or alike.
fn explained(normal: &DMatrix<f64>, slope: &DVector<f64>, k: usize) -> f64 {
    /// Columns that differ by less than the square root of this count as equal.
    const EQUAL: f64 = 1e-6;
    let size: Vec<f64> =
        (0..k).map(|i| normal[(i, i)].sqrt().max(f64::MIN_POSITIVE.sqrt())).collect();
    let scaled = DMatrix::from_fn(k, k, |i, j| {
        normal[(i, j)] / (size[i] * size[j]) + if i == j { EQUAL } else { 0.0 }
    });
    let slope = DVector::from_fn(k, |i, _| slope[i] / size[i]);
    scaled.cholesky().map_or(0.0, |c| slope.dot(&c.solve(&slope)))
}

#[cfg(test)]
mod tests {
    use crate::plant::{Parameter, Point};
    use crate::toy::{Toy, effect, explained_by, noise, parameter};

    const SAMPLES: usize = 400;
    const NOISE: f64 = 0.01;
    const WIDTH: f64 = 0.04;
    /// Where there is a bump.
    const PLACE: f64 = 0.78;

    fn along(i: usize) -> f64 {
        i as f64 / SAMPLES as f64
    }

    fn bump(i: usize, place: f64) -> f64 {
        let off = (along(i) - place) / WIDTH;
        (-0.5 * off * off).exp()
    }

    /// What a bump promises beside an inclination. `places`: where its fit begins.
    fn promised(bump_in_data: f64, places: &[f64]) -> f64 {
        let measured = |i: usize| 3.0 * along(i) + bump_in_data * bump(i, PLACE) + NOISE * noise(i);
        let predict = |i: usize, point: &Point| {
            let (slope, own) = (point.effects[0][0], &point.effects[1]);
            slope * along(i) + own[0] * bump(i, own[1])
        };
        let mut toy = Toy::new(0.01, NOISE, (0..SAMPLES).map(measured), predict);
        let place = Parameter { low: 0.0, high: 1.0, off: 0.5, scale: 0.05, ..parameter("place") };
        let starts = places.iter().map(|place| vec![1.0, *place]).collect();
        toy.effects = vec![
            effect("slope", vec![parameter("slope")], vec![vec![1.0]]),
            effect("bump", vec![parameter("size"), place], starts),
        ];
        explained_by(&toy, &[0], |selector, selection| {
            let nuisances = selection.nuisances.as_ref().unwrap();
            selector.promise(&selection, &selection.best, nuisances, 1).unwrap()
        })
    }

    #[test]
    fn what_is_at_a_place_promises_by_the_place_that_explains_most_beside_the_others() {
        // No single effect was fitted, and where the bump is off it has no derivative there.
        let near = promised(0.3, &[0.2, 0.5, 0.8]);
        assert!(near > 6.0, "{near}");
        let far = promised(0.3, &[0.2, 0.5]);
        assert!(far < 0.0, "{far}");
        let absent = promised(0.0, &[0.2, 0.5, 0.8]);
        assert!(absent < 0.0, "{absent}");
    }
}
