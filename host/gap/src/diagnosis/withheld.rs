//! The shrink that an explanation achieves on a trial that its diagnosis has not seen, and whether the
//! forces of that trial lie in the stated band.

use cathforce_recording::Coverage;

use crate::diagnosis::report::Diagnosis;
use crate::explaining::band::columns;
use crate::fitting::nuisance::Nuisances;
use crate::fitting::problem::Problem;
use crate::noise::floor::Floor;
use crate::plant::{At, Plant, Point, Quantity};
use crate::scoring::score::{Energies, excess};

/// Share of a trial's gap above the floor that a diagnosis' effects close, with their parameters
/// as they were fitted and the trial's own nuisances. `None` when a simulation breaks down, or
/// when the trial has no gap.
///
/// `trial`: index into [`Plant::trials`].
pub fn achieved(plant: &dyn Plant, trial: usize, diagnosis: &Diagnosis) -> Option<f64> {
    let floor = Floor::of(plant);
    let problem = Problem::new(plant, &floor, &crate::unwatched);
    let before = above_floor(&problem, trial, &Point::nominal(plant))?;
    let after = above_floor(&problem, trial, &explained(plant, diagnosis)?)?;
    (before > 0.0).then(|| 1.0 - after / before)
}

/// How many forces of a trial lie within the band that a diagnosis states, about the model with its
/// effects, as a device has it: nothing is refitted. `None` when the simulation breaks down, or
/// without a band.
///
/// `trial`: index into [`Plant::trials`].
pub fn covered(plant: &dyn Plant, trial: usize, diagnosis: &Diagnosis) -> Option<Coverage> {
    let band = diagnosis.band.as_ref()?;
    let columns = columns(plant)?;
    let predicted = plant.simulate(trial, &explained(plant, diagnosis)?)?;
    let trial = &plant.trials()[trial];
    let mut coverage = Coverage::default();
    for ((sample, at), predicted) in
        trial.samples.iter().zip(At::of_samples(&trial.samples)).zip(predicted)
    {
        if let Some(column) = columns[sample.channel] {
            let width = band.half_width_n(at, column);
            coverage.channels[column].count(width, sample.value - predicted, sample.noise);
        }
    }
    Some(coverage)
}

/// The model with the effects of a diagnosis.
fn explained(plant: &dyn Plant, diagnosis: &Diagnosis) -> Option<Point> {
    let mut point = Point::nominal(plant);
    for named in &diagnosis.effects {
        let effect = plant.effects().iter().position(|own| own.id == named.id)?;
        let parameters = &plant.effects()[effect].parameters;
        for (value, parameter) in point.effects[effect].iter_mut().zip(parameters) {
            *value = named.parameters.get(parameter.name).map_or(*value, |own| own.value);
        }
    }
    Some(point.anchored())
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
