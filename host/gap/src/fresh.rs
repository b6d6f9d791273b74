//! What an explanation closes on a trial that its diagnosis has not seen.

use crate::floor::Floor;
use crate::nuisance::Nuisances;
use crate::plant::{Plant, Point, Quantity};
use crate::problem::Problem;
use crate::report::Diagnosis;
use crate::score::{Energies, excess};

/// Share of a trial's gap above the floor that a diagnosis' effects close, with their parameters
/// as they were fitted and the trial's own nuisances. `None` when a simulation breaks down, or
/// when the trial has no gap.
///
/// `trial`: index into [`Plant::trials`].
pub fn achieved(plant: &dyn Plant, trial: usize, diagnosis: &Diagnosis) -> Option<f64> {
    let floor = Floor::of(plant);
    let problem = Problem::new(plant, &floor, &|_| {});
    let nominal = Point::nominal(plant);
    let mut explained = nominal.clone();
    for named in &diagnosis.effects {
        let effect = plant.effects().iter().position(|own| own.id == named.id)?;
        let parameters = &plant.effects()[effect].parameters;
        for (value, parameter) in explained.effects[effect].iter_mut().zip(parameters) {
            *value = named.parameters.get(parameter.name).map_or(*value, |own| own.value);
        }
    }
    let before = above_floor(&problem, trial, &nominal)?;
    let after = above_floor(&problem, trial, &explained)?;
    (before > 0.0).then(|| 1.0 - after / before)
}

/// Energy of one trial above its floor, nuisances refitted.
fn above_floor(problem: &Problem<'_>, trial: usize, point: &Point) -> Option<f64> {
    let base = vec![problem.residual(trial, point)?];
    let nuisances = Nuisances::of_trials(problem, &[trial], point, &base)?;
    let refit = nuisances.refit(0, &base[0]);
    let samples = &problem.plant.trials()[trial].samples;
    let mut energies = Energies::default();
    for (sample, residual) in samples.iter().zip(refit.residual.iter()) {
        energies.add(problem.plant.channels()[sample.channel].quantity, *residual);
    }
    let penalty = refit.residual.rows_range(samples.len()..).norm_squared();
    let found: Vec<(Quantity, f64, usize)> = energies.per_sample(penalty);
    Some(excess(&found))
}
