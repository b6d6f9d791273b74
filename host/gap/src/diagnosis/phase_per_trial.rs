//! Effects that swing independently of when a trial begins, such as breathing and pulse: one phase for
//! each trial.
//!
//! If one common phase explains little and a phase for each trial explains much, to first order
//! ([`crate::fitting::swing`]), the trials are diagnosed again with these phases. The phases are refined by
//! fits of this effect alone, in which the phase of a trial is a nuisance parameter.

use crate::diagnosis::report::{Diagnosis, Verdict};
use crate::fitting::nuisance::Nuisances;
use crate::fitting::problem::Problem;
use crate::fitting::progress::Progress;
use crate::fitting::refit::Refit;
use crate::fitting::swing;
use crate::noise::floor::Floor;
use crate::plant::Altered;
use crate::plant::{Plant, Point};
use crate::rules::Rules;
use crate::scoring::folds::Folds;
use crate::searching::selector::Selector;

/// Fits by which phases are refined.
const REFINED: usize = 2;

/// The plant with a phase of its own in every trial, where an answer stays open and an effect swings so.
pub fn with_own_phases<'a>(
    rules: &Rules,
    plant: &'a dyn Plant,
    answer: &Diagnosis,
    progress: Progress<'_>,
) -> Option<Altered<'a>> {
    let is_open = matches!(answer.verdict, Verdict::Unknown | Verdict::Partial);
    // Without places, nothing was compared.
    if !rules.search.phases || plant.cheap() || !is_open || answer.places.is_empty() {
        return None;
    }
    let floor = Floor::of(plant);
    let problem = Problem::new(plant, &floor, progress).by(*rules);
    let point = Point::nominal(plant);
    let base = problem.residuals(&point)?;
    let nuisances = Nuisances::at(&problem, &point, &base)?;
    let refits: Vec<Refit> = base.iter().enumerate().map(|(t, r)| nuisances.refit(t, r)).collect();
    let trials: Vec<(usize, &Refit)> = refits.iter().enumerate().collect();
    let (effect, mut ahead_rad) = (0..plant.effects().len()).find_map(|effect| {
        Some((effect, swing::own_phases(&problem, effect, &nuisances, &trials)?))
    })?;
    for _ in 0..REFINED {
        ahead_rad = refined(rules, plant, effect, ahead_rad, progress)?;
    }
    Altered::with_phases(plant, effect, ahead_rad)
}

/// Phases by what a fit of the effect alone leaves of them. `None` when a simulation breaks down.
fn refined(
    rules: &Rules,
    plant: &dyn Plant,
    effect: usize,
    ahead_rad: Vec<f64>,
    progress: Progress<'_>,
) -> Option<Vec<f64>> {
    let altered = Altered::with_phases(plant, effect, ahead_rad.clone())?;
    let (phase, nuisance) = altered.nuisances().iter().enumerate().next_back()?;
    let floor = Floor::of(&altered);
    let problem = Problem::new(&altered, &floor, progress).by(*rules);
    let folds = Folds::of(&altered).ok()?;
    let selector = Selector { problem: &problem, folds: &folds };
    let found = selector.take(selector.nominal()?, &[effect])?.best.fit;
    let nuisances = selector.nuisances_at(&found)?;
    let left = found
        .trials
        .iter()
        .enumerate()
        .map(|(t, trial)| nuisances.refit(t, &trial.raw).estimate[phase] * nuisance.sd);
    Some(ahead_rad.iter().zip(left).map(|(ahead, left)| ahead + left).collect())
}

/// Whether an answer with phases names what swings, and closes more than the one without.
pub fn closes_more(rules: &Rules, without: &Diagnosis, with: &Diagnosis) -> bool {
    let has_name = matches!(with.verdict, Verdict::Named | Verdict::Partial);
    has_name && with.details.shrink > without.details.shrink + rules.search.phases_close_more
}
