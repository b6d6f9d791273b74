//! Which effects the data cannot tell apart, and how certain the named ones are.
//!
//! Isolation distance of effect i from effect j, given the others that are on:
//!
//! > D_ij = ‖(I − P_[s_j, others, ν]) s_i‖ / σ_eff
//!
//! s_i is what effect i does to the whitened predictions at its fitted size, P projects on what
//! j, the others and the nuisances can do; the norm is that of [`Metric`].

use nalgebra::{DMatrix, DVector};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::fit::FitTrial;
use crate::metric::Metric;
use crate::problem::{Coordinate, Problem};
use crate::score::Score;
use crate::select::{Candidate, Selection, Selector, Step};

/// Effects nearer than this cannot be told apart.
const ISOLATED: f64 = 5.0;
/// One of several effects that so many others could stand in for names nothing.
const ANYTHING: usize = 8;
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
