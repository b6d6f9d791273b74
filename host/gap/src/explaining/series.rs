//! Measured and predicted forces of each trial, and their root mean square error.

use serde::{Serialize, Serializer};

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
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Series {
    pub channel: String,
    pub trial: u32,
    #[serde(rename = "unit", serialize_with = "unit_of_force")]
    pub units: Units,
    #[serde(serialize_with = "thinned")]
    pub t_s: Vec<f64>,
    #[serde(serialize_with = "thinned")]
    pub measured: Vec<f64>,
    #[serde(serialize_with = "thinned")]
    pub nominal: Vec<f64>,
    #[serde(rename = "corrected", serialize_with = "thinned")]
    pub best: Vec<f64>,
}

fn unit_of_force<S: Serializer>(units: &Units, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(units.force())
}

/// Values of a curve in a file at most: a plot shows no more.
const KEPT: usize = 500;

/// Every so many values in single precision, which is more than a sensor has.
fn thinned<S: Serializer>(values: &[f64], to: S) -> Result<S::Ok, S::Error> {
    let each = values.len().div_ceil(KEPT).max(1);
    to.collect_seq(values.iter().step_by(each).map(|value| *value as f32))
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

/// Measured and predicted forces: all channels of the first trial, and of each other trial the one whose
/// nominal error is largest.
pub fn series(problem: &Problem<'_>, nominal: &Candidate, best: &Candidate) -> Vec<Series> {
    let error = |own: &Series| -> f64 {
        own.measured.iter().zip(&own.nominal).map(|(a, b)| (a - b).powi(2)).sum()
    };
    let trials = 0..problem.plant.trials().len();
    let of = |t: usize| {
        let mut all = of_trial(problem, nominal, best, t);
        if t > 0 {
            all.sort_by(|a, b| error(b).total_cmp(&error(a)));
            all.truncate(1);
        }
        all
    };
    trials.flat_map(of).collect()
}

fn of_trial(problem: &Problem<'_>, nominal: &Candidate, best: &Candidate, t: usize) -> Vec<Series> {
    let plant = problem.plant;
    let trial = &plant.trials()[t];
    let loss = Loss::of(plant);
    let of = |range: std::ops::Range<usize>| {
        let channel = &plant.channels()[trial.samples[range.start].channel];
        let predicted = |candidate: &Candidate| {
            let refit = &candidate.fit.trials[t].refit.residual;
            let of =
                |i: usize| trial.samples[i].value - loss.residual(refit[i]) / problem.weights(t)[i];
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_in_a_file_has_as_many_values_as_a_plot_shows() {
        let values: Vec<f64> = (0..1200).map(|i| 0.1 * f64::from(i)).collect();
        let of = |values: &[f64]| Series {
            channel: "fx_N".into(),
            trial: 1,
            units: Units::Linear,
            t_s: values.to_vec(),
            measured: values.to_vec(),
            nominal: values.to_vec(),
            best: values.to_vec(),
        };
        let json = serde_json::to_value(of(&values)).unwrap();
        let curve = json["corrected"].as_array().unwrap();
        assert_eq!((curve.len(), &json["unit"]), (400, &"N".into()));
        assert!((curve[1].as_f64().unwrap() - 0.3).abs() < 1e-6);
        let short = serde_json::to_value(of(&values[..3])).unwrap();
        assert_eq!(short["t_s"].as_array().unwrap().len(), 3);
    }
}
