//! Trial by trial: forces as they were measured and predicted, and how far these are apart.

use crate::loss::Loss;
use crate::plant::Quantity;
use crate::problem::Problem;
use crate::report::{HeldOut, Series};
use crate::score::Score;
use crate::select::{Candidate, Selection};

/// Of every trial with forces.
pub fn held_out(problem: &Problem<'_>, selection: &Selection) -> Vec<HeldOut> {
    let of = |(t, trial): (usize, &crate::plant::Trial)| {
        let rms = |score: &Score| score.rms_of(problem, Quantity::Force, t);
        let before_n = rms(&selection.nominal.score)?;
        Some(HeldOut { trial: trial.number, before_n, after_n: rms(&selection.best.score)? })
    };
    problem.plant.trials().iter().enumerate().filter_map(of).collect()
}

/// Measured and predicted forces of the first trial, for the page.
pub fn series(problem: &Problem<'_>, nominal: &Candidate, best: &Candidate) -> Vec<Series> {
    let plant = problem.plant;
    let Some(trial) = plant.trials().first() else { return Vec::new() };
    let loss = Loss::of(plant);
    let of = |range: std::ops::Range<usize>| {
        let channel = &plant.channels()[trial.samples[range.start].channel];
        let predicted = |candidate: &Candidate| {
            let refit = &candidate.fit.trials[0].refit.residual;
            let of =
                |i: usize| trial.samples[i].value - loss.residual(refit[i]) / problem.weights(0)[i];
            range.clone().map(of).collect()
        };
        channel.quantity.is_force().then(|| Series {
            channel: channel.name.clone(),
            trial: trial.number,
            t_s: trial.samples[range.clone()].iter().map(|s| s.t_s).collect(),
            measured: trial.samples[range.clone()].iter().map(|s| s.value).collect(),
            nominal: predicted(nominal),
            best: predicted(best),
        })
    };
    trial.channel_ranges().into_iter().filter_map(of).collect()
}
