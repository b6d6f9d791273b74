//! Which effects the data cannot tell apart, and how certain the named effects are.
//!
//! The isolation distance of effect i from effect j, given the other effects of the model, is
//!
//! > D_ij = ‖(I − P_[s_j, others, ν]) s_i‖ / σ_eff
//!
//! s_i is the change that effect i makes to the whitened predictions at its fitted size. P projects on the
//! space that effect j, the other effects and the nuisance parameters span. The norm is that of [`Metric`].

use nalgebra::{DMatrix, DVector};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::fitting::fit::{FitTrial, at_bound};
use crate::fitting::problem::{Coordinate, Problem};
use crate::plant::{Plant, are_confused};
use crate::scoring::candidate::Candidate;
use crate::scoring::metric::Metric;
use crate::scoring::score::Score;
use crate::selecting::select::Selector;
use crate::selecting::selection::{Selection, Step};

/// Effects nearer than this cannot be told apart.
const ISOLATED: f64 = 5.0;
/// One of several effects that so many others could stand in for names nothing.
const ANYTHING: usize = 8;
/// How well the energy of the floor is taken to be known, in floors.
const FLOOR_KNOWN: f64 = 0.05;
/// Resamples of the blocks.
const RESAMPLES: usize = 1000;
/// The same data give the same answer.
const SEED: u64 = 0x6361_7468;

/// Per effect of the best model: those that could stand in its place, nearest first.
pub fn confusable(
    problem: &Problem<'_>,
    selection: &Selection,
    metric: &Metric<'_>,
) -> Vec<(usize, Vec<usize>)> {
    let best = &selection.best.fit;
    let of = |&effect: &usize| {
        let mut near: Vec<(f64, usize)> = Vec::new();
        if let Some(own) = signature(problem, selection, effect) {
            let others = others(&selection.best, effect);
            let step = selection.steps.iter().find(|step| step.effect == effect);
            for (rival, single) in selection.singles.iter().enumerate() {
                let free = |_: &&Candidate| !best.effects.contains(&rival);
                let Some(single) = single.as_ref().filter(free) else { continue };
                let distance = metric.distance(&own, &span(selection, &others, single));
                if distance < ISOLATED
                    || step.is_some_and(|step| as_good_at_its_step(step, rival))
                    || step.is_some_and(|step| leaves_as_little(problem.plant, step, rival))
                    || as_good_in_its_place(selection, effect, rival)
                {
                    near.push((distance, rival));
                }
            }
        }
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        (effect, near.into_iter().map(|(_, rival)| rival).collect())
    };
    best.effects.iter().map(of).collect()
}

/// Takes out of an explanation of several effects those that almost anything could stand in for:
/// they mend what the others leave, and say of what is there only that something is. `None` when
/// a simulation breaks down.
pub fn identified(selector: &Selector<'_>, mut selection: Selection) -> Option<Selection> {
    while selection.best.fit.effects.len() > 1 {
        let nuisances = selection.nuisances.as_ref()?;
        let metric = Metric::new(nuisances, &selection.best.score);
        let sets = confusable(selector.problem, &selection, &metric);
        let widest = sets.iter().max_by_key(|(_, near)| near.len());
        let Some(&(effect, _)) = widest.filter(|(_, near)| near.len() >= ANYTHING) else { break };
        let own = selection.without.iter().find(|(e, _)| *e == effect);
        let Some(without) = own.map(|(_, candidate)| candidate.clone()) else { break };
        selection.path.push((without.fit.effects.clone(), without.score.clone()));
        selection.best = without;
        selection.steps.retain(|step| step.effect != effect);
        selector.complete(&mut selection)?;
    }
    Some(selection)
}

/// Whether a rival was as good at the step at which an effect was chosen.
fn as_good_at_its_step(step: &Step, rival: usize) -> bool {
    let rival = step.rivals.iter().find(|r| r.effect == rival);
    rival.is_some_and(|rival| within_one_error(&step.score, &rival.score))
}

/// Whether what is easily mistaken for the chosen effect left as little at its step, without having
/// turned into a limit of itself: where a gap is hardly above the floor, resamples tell two effects
/// apart by less than the floor is known.
fn leaves_as_little(plant: &dyn Plant, step: &Step, rival: usize) -> bool {
    let tried = step.rivals.iter().find(|r| r.effect == rival);
    are_confused(plant, step.effect, rival)
        && tried.is_some_and(|tried| {
            tried.score.excess() - step.score.excess() < FLOOR_KNOWN
                && !at_bound(plant, rival, &tried.point)
        })
}

/// Whether the whole explanation is as good with the one effect exchanged for the other.
fn as_good_in_its_place(selection: &Selection, effect: usize, rival: usize) -> bool {
    let own = selection.exchanged.iter().find(|(e, r)| *e == effect && r.effect == rival);
    own.is_some_and(|(_, rival)| within_one_error(&selection.best.score, &rival.score))
}

/// Whether a rival's score is within one standard error of the chosen one's.
fn within_one_error(chosen: &Score, rival: &Score) -> bool {
    let (gain, error) = chosen.gain_over(rival);
    gain <= error
}

/// s_i by trial.
fn signature(
    problem: &Problem<'_>,
    selection: &Selection,
    effect: usize,
) -> Option<Vec<DVector<f64>>> {
    let best = &selection.best.fit;
    let mut off = best.point.clone();
    let parameters = &problem.plant.effects()[effect].parameters;
    off.effects[effect] = parameters.iter().map(|p| p.off).collect();
    let off = problem.residuals(&off)?;
    Some(best.trials.iter().zip(&off).map(|(trial, off)| off - &trial.raw).collect())
}

/// Derivatives with respect to the other effects that are on.
fn others(best: &Candidate, effect: usize) -> Vec<DMatrix<f64>> {
    let other = |&i: &usize| match best.fit.coordinates[i] {
        Coordinate::Effect { effect: own, .. } => own != effect,
        Coordinate::Nuisance(_) => false,
    };
    let columns: Vec<usize> = (0..best.fit.coordinates.len()).filter(other).collect();
    best.fit.trials.iter().map(|trial| trial.raw_jacobian.select_columns(&columns)).collect()
}

/// What the others and the rival can do: their derivatives, and the rival's whole effect at the
/// size of its own fit.
fn span(selection: &Selection, others: &[DMatrix<f64>], rival: &Candidate) -> Vec<DMatrix<f64>> {
    let nominal = &selection.nominal.fit.trials;
    let of = |((others, rival), nominal): ((&DMatrix<f64>, &FitTrial), &FitTrial)| {
        let columns = others.column_iter().chain(rival.raw_jacobian.column_iter());
        let mut columns: Vec<DVector<f64>> = columns.map(|column| column.into_owned()).collect();
        columns.push(&rival.raw - &nominal.raw);
        DMatrix::from_columns(&columns)
    };
    others.iter().zip(&rival.fit.trials).zip(nominal).map(of).collect()
}

/// How often an effect wins when the blocks are drawn again: it must lower the error of the
/// model that lacks it, and come before every rival at its step that is not confusable with it.
/// Within a confusable set the wins are shared.
pub fn win_frequency(
    step: &Step,
    without: Option<&Score>,
    best: &Score,
    confusable: &[usize],
) -> f64 {
    let blocks = best.blocks.len();
    if blocks == 0 {
        return 0.0;
    }
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let rivals: Vec<&Score> = step
        .rivals
        .iter()
        .filter(|rival| !confusable.contains(&rival.effect))
        .map(|rival| &rival.score)
        .collect();
    let mut wins = 0;
    for _ in 0..RESAMPLES {
        let drawn: Vec<usize> = (0..blocks).map(|_| rng.random_range(0..blocks)).collect();
        let total = |score: &Score| drawn.iter().map(|&b| score.blocks[b]).sum::<f64>();
        let helps = without.is_none_or(|without| total(best) < total(without));
        let chosen = total(&step.score);
        wins += usize::from(helps && rivals.iter().all(|rival| chosen < total(rival)));
    }
    // Laplace's rule: no number of resamples makes certain what few blocks have shown.
    let frequency = (wins as f64 + 1.0) / (RESAMPLES as f64 + 2.0);
    let few = (blocks as f64 + 1.0) / (blocks as f64 + 2.0);
    frequency.min(few) / (confusable.len() as f64 + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fitting::fit::{Depth, Start};
    use crate::plant::Point;
    use crate::selecting::selection::Rival;
    use crate::toy::{Toy, effect, explained_by, noise, parameter};

    const SAMPLES: usize = 400;

    /// Whether a step is taken for one with a ramp on it, which ends `times` as high as it begins.
    fn is_as_good(times: f64) -> bool {
        let along = |i: usize| i as f64 / SAMPLES as f64;
        let measured = (0..SAMPLES).map(|i| 0.02 + 0.01 * noise(i));
        let predict = |i: usize, point: &Point| {
            point.effects[0][0] + point.effects[1][0] * (1.0 + (times - 1.0) * along(i))
        };
        let mut toy = Toy::new(0.01, 0.01, measured, predict);
        let one = |name| effect(name, vec![parameter("size")], vec![vec![0.01]]);
        (toy.effects, toy.cheap) = (vec![one("step"), one("ramp")], false);
        toy.effects[0].confused_with = &["ramp"];
        explained_by(&toy, &[0], |selector, selection| {
            let nominal = &selection.nominal.fit;
            let nuisances = selector.nuisances_at(nominal).unwrap();
            let start = Start::Fit(nominal);
            let ramp = selector.candidate(Depth::Whole, &nuisances, start, &[1], Some(1)).unwrap();
            let step = Step::of(0, &selection.best, vec![Rival::of(1, &ramp)]);
            leaves_as_little(&toy, &step, 1)
        })
    }

    #[test]
    fn what_leaves_more_by_less_than_the_floor_is_known_is_not_told_apart() {
        assert!(is_as_good(1.2));
        assert!(!is_as_good(3.0));
    }
}
