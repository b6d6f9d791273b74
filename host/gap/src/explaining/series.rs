//! Measured and predicted forces of each trial, and their root mean square error.

use crate::fitting::loss::Loss;
use crate::fitting::problem::Problem;
use crate::plant::{Quantity, Units};
use crate::scoring::candidate::Candidate;
use crate::scoring::score::Score;
use crate::searching::selection::Selection;

/// Force error of one trial that was held out, root mean square \[N\].
#[derive(Clone, Debug, PartialEq)]
pub struct HeldOut {
    pub trial: u32,
    pub before_n: f64,
    pub after_n: f64,
}

/// One channel of one trial over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    pub channel: String,
    pub trial: u32,
    pub units: Units,
    pub t_s: Vec<f64>,
    pub measured: Vec<f64>,
    pub nominal: Vec<f64>,
    pub best: Vec<f64>,
}

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
            units: plant.units(),
            t_s: trial.samples[range.clone()].iter().map(|s| s.t_s).collect(),
            measured: trial.samples[range.clone()].iter().map(|s| s.value).collect(),
            nominal: predicted(nominal),
            best: predicted(best),
        })
    };
    trial.channel_ranges().into_iter().filter_map(of).collect()
}
