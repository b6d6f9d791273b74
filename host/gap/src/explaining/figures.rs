//! Errors on held-out data, before and after, beside the noise floor.
//!
//! Root mean squares are taken over each channel and combined as the axes of a vector. The other figures
//! are of vectors at times at which every axis was compared. Their floor follows from no formula: it is the
//! figure of a perfect model whose measurement has errors that are drawn, sample by sample, with the
//! standard deviations of the floor.

use cathforce_bundle::geometry::frechet;
use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use crate::explaining::snaps::{self, SnapFigures};
use crate::fitting::problem::Problem;
use crate::plant::{Quantity, Units};
use crate::scoring::candidate::Candidate;
use crate::scoring::score::{Score, root_mean_square};
use crate::searching::selector::Selector;

/// Times that errors are drawn for a floor.
const DRAWS: usize = 8;
const SEED: u64 = 0x7065_616b;
/// Points of a path at most: the time that its distance takes grows with their square.
const POINTS: usize = 1000;
const AXES: usize = 3;

/// An error before and after, and the floor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Figures {
    pub before: f64,
    pub after: f64,
    pub floor: f64,
}

/// All errors on held-out data; `None` where not measured.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize)]
pub struct Gap {
    /// Of the forces below, which are torques on a rotary axis, and outputs of a transmission.
    #[serde(skip_serializing_if = "Units::is_linear")]
    pub units: Units,
    #[serde(rename = "force_rms_N")]
    pub force_rms_n: Option<Figures>,
    pub tip_rms_m: Option<Figures>,
    pub shape_rms_m: Option<Figures>,
    /// Mean absolute error.
    #[serde(rename = "force_mae_N")]
    pub force_mae_n: Option<Figures>,
    /// Error of a trial's largest force, mean over the trials.
    #[serde(rename = "force_peak_N")]
    pub force_peak_n: Option<Figures>,
    /// Discrete Fréchet distance of the tip's path, mean over the trials.
    pub tip_frechet_m: Option<Figures>,
    /// Where the force jumps, of trials that are held out whole.
    pub snaps: Option<SnapFigures>,
}

impl Gap {
    /// What was measured: name, figures and unit of each.
    pub fn rows(&self) -> Vec<(&'static str, Figures, &'static str)> {
        let names = match self.units.of_force() {
            "output" => ["output RMS", "output, mean absolute error", "largest output of a trial"],
            _ => ["force RMS", "force, mean absolute error", "largest force of a trial"],
        };
        let all = [
            (names[0], self.force_rms_n, self.units.force()),
            (names[1], self.force_mae_n, self.units.force()),
            (names[2], self.force_peak_n, self.units.force()),
            ("tip RMS", self.tip_rms_m, "m"),
            ("path of the tip, discrete Fréchet distance", self.tip_frechet_m, "m"),
            ("shape RMS", self.shape_rms_m, "m"),
        ];
        all.into_iter().filter_map(|(name, figures, unit)| Some((name, figures?, unit))).collect()
    }
}

/// All figures of a nominal model and of what explains the gap.
pub fn gap(selector: &Selector<'_>, nominal: &Candidate, best: &Candidate) -> Gap {
    let (problem, before, after) = (selector.problem, &nominal.score, &best.score);
    let rms = |quantity: Quantity| {
        let floor =
            root_mean_square(problem, quantity, |trial, i| Some(1.0 / problem.weights(trial)[i]))?;
        let (before, after) = (before.rms(problem, quantity)?, after.rms(problem, quantity)?);
        Some(Figures { before, after, floor })
    };
    let force = Compared::of(problem, before, after, Quantity::Force);
    let tip = Compared::of(problem, before, after, Quantity::Tip);
    Gap {
        units: problem.plant.units(),
        force_rms_n: rms(Quantity::Force),
        tip_rms_m: rms(Quantity::Tip),
        shape_rms_m: rms(Quantity::Shape),
        force_mae_n: force.figures(absolute),
        force_peak_n: force.figures(peak),
        tip_frechet_m: tip.figures(path),
        snaps: snaps::figures(problem, selector.folds, &nominal.fit, &best.fit),
    }
}

/// A vector at one time; an axis that is not measured is 0.
#[derive(Clone, Copy, Debug, Default)]
struct Instant {
    predicted: Vector3<f64>,
    /// Measured less predicted.
    error: Vector3<f64>,
    /// Standard deviation of the floor.
    sd: Vector3<f64>,
}

impl Instant {
    fn measured(&self) -> Vector3<f64> {
        self.predicted + self.error
    }

    /// The prediction of a perfect model, measured with an error.
    fn drawn(&self, rng: &mut ChaCha8Rng) -> Self {
        Self { error: self.sd.map(|sd| sd * normal(rng)), ..*self }
    }
}

/// Sum of a figure over what it counts in one trial, and how many these are.
type Figure = fn(&[Instant]) -> (f64, usize);

/// Size of the error, at every time.
fn absolute(trial: &[Instant]) -> (f64, usize) {
    (trial.iter().map(|at| at.error.norm()).sum(), trial.len())
}

/// How far the largest magnitude of a trial is off, whenever it is reached.
fn peak(trial: &[Instant]) -> (f64, usize) {
    let largest =
        |of: fn(&Instant) -> Vector3<f64>| trial.iter().map(|at| of(at).norm()).fold(0.0, f64::max);
    let off = largest(Instant::measured) - largest(|at| at.predicted);
    (off.abs(), usize::from(!trial.is_empty()))
}

/// How far the path of a trial is off, whatever the pace.
fn path(trial: &[Instant]) -> (f64, usize) {
    let every = trial.len().div_ceil(POINTS).max(1);
    let points = |of: fn(&Instant) -> Vector3<f64>| -> Vec<Vector3<f64>> {
        trial.iter().step_by(every).map(of).collect()
    };
    let distance = frechet(&points(Instant::measured), &points(|at| at.predicted));
    distance.map_or((0.0, 0), |distance| (distance, 1))
}

/// A quantity of all trials.
struct Compared {
    before: Vec<Vec<Instant>>,
    after: Vec<Vec<Instant>>,
}

impl Compared {
    fn of(problem: &Problem<'_>, before: &Score, after: &Score, quantity: Quantity) -> Self {
        let of = |score: &Score| {
            let trials = 0..problem.plant.trials().len();
            trials.map(|trial| instants(problem, score, quantity, trial)).collect()
        };
        Self { before: of(before), after: of(after) }
    }

    fn figures(&self, figure: Figure) -> Option<Figures> {
        let mut rng = ChaCha8Rng::seed_from_u64(SEED);
        let mut drawn = Vec::new();
        for trial in self.after.iter().flat_map(|trial| std::iter::repeat_n(trial, DRAWS)) {
            let perfect: Vec<Instant> = trial.iter().map(|at| at.drawn(&mut rng)).collect();
            drawn.push(figure(&perfect));
        }
        let of = |trials: &[Vec<Instant>]| mean(trials.iter().map(|trial| figure(trial)));
        Some(Figures {
            before: of(&self.before)?,
            after: of(&self.after)?,
            floor: mean(drawn.into_iter())?,
        })
    }
}

fn mean(sums: impl Iterator<Item = (f64, usize)>) -> Option<f64> {
    let (sum, count) = sums.fold((0.0, 0), |all, own| (all.0 + own.0, all.1 + own.1));
    (count > 0).then(|| sum / count as f64)
}

/// A quantity of a trial, by time, at the times at which every axis of it was held out.
fn instants(
    problem: &Problem<'_>,
    score: &Score,
    quantity: Quantity,
    trial: usize,
) -> Vec<Instant> {
    let channels = problem.plant.channels().iter().enumerate();
    let own = channels.filter(|(_, channel)| channel.quantity == quantity).take(AXES);
    let axes: Vec<usize> = own.map(|(index, _)| index).collect();
    let samples = &problem.plant.trials()[trial].samples;
    let mut found: Vec<(f64, usize, Instant)> = samples
        .iter()
        .enumerate()
        .filter_map(|(i, sample)| {
            let axis = axes.iter().position(|channel| *channel == sample.channel)?;
            let error = score.error(problem, trial, i)?;
            let sd = 1.0 / problem.weights(trial)[i];
            let along = |value: f64| Vector3::ith(axis, value);
            let predicted = along(sample.value - error);
            Some((sample.t_s, axis, Instant { predicted, error: along(error), sd: along(sd) }))
        })
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let together = |own: &[(f64, usize, Instant)]| {
        own.iter().fold(Instant::default(), |all, (_, _, at)| Instant {
            predicted: all.predicted + at.predicted,
            error: all.error + at.error,
            sd: all.sd + at.sd,
        })
    };
    let at_once = found.chunk_by(|a, b| a.0 == b.0);
    at_once.filter(|own| own.len() == axes.len()).map(together).collect()
}

/// Of standard deviation 1, by Box and Muller.
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let u: f64 = rng.random_range(f64::MIN_POSITIVE..1.0);
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * rng.random::<f64>()).cos()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_2_PI;

    use super::*;
    use crate::toy::{Toy, effect, explained_by, parameter};

    /// By time, what was predicted and by how much what was measured differs.
    fn trial(own: &[([f64; 3], [f64; 3])]) -> Vec<Instant> {
        let at = |(predicted, error): &([f64; 3], [f64; 3])| Instant {
            predicted: (*predicted).into(),
            error: (*error).into(),
            ..Instant::default()
        };
        own.iter().map(at).collect()
    }

    #[test]
    fn figures_are_those_of_a_calculation_by_hand() {
        let own = trial(&[
            ([0.0, 0.0, 0.0], [3.0, 4.0, 0.0]),
            // The largest force is predicted here, of 6 …
            ([0.0, 0.0, -6.0], [0.0, 0.0, 1.0]),
            // … and measured there, of 13.
            ([5.0, 0.0, 0.0], [0.0, 12.0, 0.0]),
        ]);
        assert_eq!(absolute(&own), (5.0 + 1.0 + 12.0, 3));
        assert_eq!(peak(&own), (7.0, 1));
        assert_eq!(mean([absolute(&own), absolute(&own[1..2])].into_iter()), Some(19.0 / 4.0));
        assert_eq!([absolute(&[]).1, peak(&[]).1, path(&[]).1], [0; 3]);
        assert_eq!(mean([peak(&[])].into_iter()), None);
    }

    #[test]
    fn a_path_that_is_only_late_is_nowhere_far_off() {
        // It waits for one sample, as each error shows, and is walked in the same steps.
        let late = trial(&[
            ([0.0, 0.0, 0.0], [0.0; 3]),
            ([1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]),
            ([2.0, 0.0, 0.0], [-1.0, 0.0, 0.0]),
            ([2.0, 0.0, 0.0], [0.0; 3]),
        ]);
        assert_eq!(path(&late), (0.0, 1));
        assert_eq!(absolute(&late), (2.0, 4));
        let aside: Vec<_> =
            (0..3000).map(|i| ([f64::from(i), 0.0, 0.0], [0.0, 0.25, 0.0])).collect();
        assert_eq!(path(&trial(&aside)), (0.25, 1), "of so many points some are taken");
    }

    #[test]
    fn the_floor_is_what_noise_alone_does() {
        const SD: f64 = 0.01;
        let predict = |_: usize, point: &crate::plant::Point| 1.0 + point.effects[0][0];
        let mut toy = Toy::new(0.01, SD, (0..1000).map(|_| 1.3), predict);
        toy.effects = vec![effect("size", vec![parameter("size")], vec![vec![1.0]])];
        let found = explained_by(&toy, &[0], |selector, selection| {
            gap(selector, &selection.nominal, &selection.best)
        });
        let (mae, peak) = (found.force_mae_n.unwrap(), found.force_peak_n.unwrap());
        for own in [mae, peak] {
            assert!((own.before - 0.3).abs() < 1e-9, "{own:?}");
            assert!(own.after < 1e-3, "{own:?}");
        }
        assert!((mae.floor / (FRAC_2_PI.sqrt() * SD) - 1.0).abs() < 0.03, "{mae:?}");
        // The largest of a thousand draws is 3.24 standard deviations off on average.
        assert!((peak.floor / (3.24 * SD) - 1.0).abs() < 0.1, "{peak:?}");
        assert_eq!(found.tip_frechet_m, None);
    }
}
