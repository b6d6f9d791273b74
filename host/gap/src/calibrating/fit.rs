//! The fit: a global search, then steps that follow the finer model, and how sure the result is.
//!
//! > minimise Σ_trials |r(θ, ν̂(θ))|² + Σ_p ((θ_p − start_p)/scale_p)²,   low ≤ θ ≤ high
//!
//! as a diagnosis does for an effect (docs/explanation/diagnosis.md, D5), from any method of
//! `cathforce-calibration`.

use std::sync::atomic::AtomicBool;

use cathforce_calibration::{
    Certainty, Descent, NINETY, Objective, Options, Outcome, Pair, Parameter, Progress, Residuals,
    RunError, jackknife, jacobian, minimise, optimise, without_each,
};
use rayon::prelude::*;

use super::case::Case;
use crate::plant::{Plant, Quantity};
use crate::rules::Rules;

/// Step of differences in scales of a parameter's prior, as a diagnosis takes.
const STEP_SD: f64 = 0.02;
/// Rounds in which the finer model follows the fit, and how far a fit that still moves goes, in scales:
/// a tenth of what two models differ by ([`OfInterval::other_model`](crate::rules::OfInterval::other_model)).
const ROUNDS: usize = 3;
const STILL_SD: f64 = 0.003;
/// A step of such a round that gains less than this share of the cost is its last.
const LEAST_GAIN: f64 = 1e-4;
/// Evaluations of a round for each parameter and one more.
const ROUND_EACH: usize = 20;
/// Nearer to a bound than this share of the way between both is at it.
const AT_BOUND: f64 = 1e-3;
/// A parameter whose whole range moves the residuals of all data by less than a tenth of a standard
/// deviation together has no influence.
const INFLUENCE: f64 = 0.1;

const QUANTITIES: [Quantity; 4] =
    [Quantity::Force, Quantity::DriveForce, Quantity::Tip, Quantity::Shape];

/// Plants with the same first effect, and which of their trials are fitted.
pub struct Calibration<P> {
    cases: Vec<Case<P>>,
    parameters: Vec<Parameter>,
    off: Vec<f64>,
    scales: Vec<f64>,
    /// By case and trial.
    held_back: Vec<Vec<bool>>,
}

/// A fitted parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Value {
    pub start: f64,
    pub fitted: f64,
    /// The 90 % interval, within the bounds.
    pub low: f64,
    pub high: f64,
    pub at_bound: bool,
    /// Whether the data say less of it than its prior.
    pub is_told: bool,
}

/// Root mean square errors of one quantity, in its unit, the nuisances refitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    pub quantity: Quantity,
    pub before: f64,
    pub after: f64,
    /// Over trials that the values were not fitted to.
    pub held_out: Option<f64>,
    /// Of a perfect model.
    pub floor: f64,
}

/// The result.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    pub values: Vec<Value>,
    pub errors: Vec<Errors>,
    /// Of which the data tell a combination only.
    pub pairs: Vec<Pair>,
    pub singular_values: Vec<f64>,
    /// Whether each trial was held out in turn; otherwise those that were held back, or none.
    pub in_turn: bool,
    /// Evaluations of the steps that follow the finer model.
    pub evaluations: usize,
}

impl<P: Plant> Calibration<P> {
    /// `starts`: where the search begins, by parameter of the first effect; `is_held_back`: by case and
    /// trial, whether it is not fitted.
    pub fn new(
        cases: Vec<Case<P>>,
        starts: &[f64],
        is_held_back: impl Fn(usize, usize) -> bool,
    ) -> Self {
        let own = cases.first().and_then(|case| case.plant().effects().first());
        let own = own.map_or(&[][..], |effect| &effect.parameters);
        let parameter = |(p, start): (&crate::plant::Parameter, &f64)| Parameter {
            name: p.name.to_owned(),
            low: p.low,
            high: p.high,
            start: *start,
            step: (STEP_SD * p.scale).min(0.1 * (p.high - p.low)),
            logarithmic: false,
        };
        let held_back = cases.iter().enumerate().map(|(c, case)| {
            (0..case.plant().trials().len()).map(|trial| is_held_back(c, trial)).collect()
        });
        Self {
            parameters: own.iter().zip(starts).map(parameter).collect(),
            off: own.iter().map(|p| p.off).collect(),
            scales: own.iter().map(|p| p.scale).collect(),
            held_back: held_back.collect(),
            cases,
        }
    }

    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// Case and trial of those that are fitted, or of those that are not.
    fn trials(&self, held_back: bool) -> Vec<(usize, usize)> {
        let all = self.held_back.iter().enumerate();
        let all =
            all.flat_map(|(c, own)| own.iter().enumerate().map(move |(t, held)| (c, t, *held)));
        all.filter(|(.., held)| *held == held_back).map(|(c, t, _)| (c, t)).collect()
    }

    /// Trials that are fitted.
    pub fn fitted_trials(&self) -> usize {
        self.trials(false).len()
    }

    /// Residuals of all fitted trials, then those of the priors.
    fn residuals(&self, values: &[f64]) -> Option<Vec<f64>> {
        let of = |(case, trial): (usize, usize)| self.cases[case].residuals(trial, values);
        let own: Option<Vec<Vec<f64>>> = self.trials(false).into_par_iter().map(of).collect();
        let priors = values.iter().zip(&self.parameters).zip(&self.scales);
        let priors = priors.map(|((value, p), scale)| (value - p.start) / scale);
        Some(own?.into_iter().flatten().chain(priors).collect())
    }

    /// Names of parameters that change nothing of what was measured, wherever they are within their
    /// bounds: from the start, and from half of the way to the farther bounds, where effects are on.
    pub fn without_influence(&self) -> Vec<&str> {
        let start: Vec<f64> = self.parameters.iter().map(|p| p.start).collect();
        let half = |p: &Parameter| {
            let far = if p.high - p.start > p.start - p.low { p.high } else { p.low };
            0.5 * (p.start + far)
        };
        let bases = [start, self.parameters.iter().map(half).collect()];
        let raw = |values: &[f64]| -> Option<Vec<f64>> {
            let of = |(case, trial): (usize, usize)| self.cases[case].raw(trial, values);
            let own: Option<Vec<_>> = self.trials(false).into_par_iter().map(of).collect();
            Some(own?.iter().flat_map(|own| own.iter().copied()).collect())
        };
        let moved = |base: &Vec<f64>, k: usize, to: f64| {
            let mut moved = base.clone();
            moved[k] = to;
            let (a, b) = (raw(base)?, raw(&moved)?);
            Some(a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt())
        };
        let has_influence = |k: usize| {
            let p = &self.parameters[k];
            let mut tried = bases.iter().flat_map(|base| [(base, p.low), (base, p.high)]);
            // Where nothing can be computed nothing is known.
            tried.any(|(base, to)| moved(base, k, to).is_none_or(|size| size > INFLUENCE))
        };
        let names = self.parameters.iter().enumerate();
        names.filter(|(k, _)| !has_influence(*k)).map(|(_, p)| p.name.as_str()).collect()
    }

    /// The global search.
    pub fn search(
        &self,
        options: &Options,
        interrupted: &AtomicBool,
        tell: &(dyn Fn(Progress) + Sync),
    ) -> Result<Outcome, RunError> {
        let objective = Residuals(|values: &[f64]| self.residuals(values));
        minimise(&self.parameters, &objective, options, interrupted, tell)
    }

    /// Follows the finer model from where a search ended, and says how sure the result is. `None` where a
    /// simulation breaks down beside it.
    pub fn finish(&mut self, best: &[f64]) -> Result<Option<Fitted>, RunError> {
        let never = AtomicBool::new(false);
        let (mut values, mut evaluations) = (best.to_vec(), 0);
        for _ in 0..ROUNDS {
            for case in &mut self.cases {
                case.anchor(&values);
            }
            let start: Vec<f64> = self
                .parameters
                .iter()
                .zip(&values)
                .map(|(p, value)| p.coordinate(*value))
                .collect();
            let mut descent = Descent::from(start).with_least_gain(LEAST_GAIN);
            let objective = Residuals(|values: &[f64]| self.residuals(values));
            let budget = ROUND_EACH * (1 + values.len());
            let (found, _, count, _) =
                optimise(&self.parameters, &objective, &mut descent, budget, &never, &|_| {})?;
            evaluations += count;
            let moved = found.iter().zip(&values).zip(&self.scales);
            let most = moved.map(|((a, b), scale)| (a - b).abs() / scale).fold(0.0, f64::max);
            values = found;
            if most < STILL_SD {
                break;
            }
        }
        Ok(self.certain(values, evaluations))
    }

    fn certain(&self, values: Vec<f64>, evaluations: usize) -> Option<Fitted> {
        let objective = Residuals(|values: &[f64]| self.residuals(values));
        let objective: &dyn Objective = &objective;
        let (residuals, slopes) = jacobian(&self.parameters, objective, &values)?;
        let fitted = self.trials(false);
        let (mut cluster, mut group) = (Vec::new(), Vec::new());
        for (g, (case, trial)) in fitted.iter().enumerate() {
            let blocks = self.cases[*case].blocks(*trial);
            let first = cluster.iter().max().map_or(0, |last: &usize| last + 1);
            group.extend(std::iter::repeat_n(Some(g), blocks.len()));
            cluster.extend(blocks.into_iter().map(|block| first + block));
        }
        let data = cluster.len();
        group.extend(std::iter::repeat_n(None, self.scales.len()));
        let certainty = Certainty::of(
            &slopes.rows(0, data).into_owned(),
            &residuals[..data],
            &cluster,
            &self.scales,
            true,
        );
        let without = without_each(&values, &slopes, &residuals, &group, fitted.len());
        let without: Vec<Vec<f64>> = without
            .into_iter()
            .map(|own| {
                own.iter().zip(&self.parameters).map(|(v, p)| v.clamp(p.low, p.high)).collect()
            })
            .collect();
        let between = match fitted.len() {
            0 | 1 => vec![0.0; values.len()],
            _ => jackknife(&without),
        };
        let share = self.cases.iter().map(|case| case.plant().spread_share()).fold(0.0, f64::max);
        let value = |k: usize| {
            let (p, scale, fitted) = (&self.parameters[k], self.scales[k], values[k]);
            let models = (Rules::USED.interval.other_model * scale).powi(2)
                + (Rules::USED.interval.other_answer * (fitted - self.off[k])).powi(2);
            let variance =
                certainty.sd[k].powi(2) + Rules::USED.interval.wider.powi(2) * between[k] + models;
            let half = NINETY * share * variance.sqrt();
            let margin = AT_BOUND * (p.high - p.low);
            Value {
                start: p.start,
                fitted,
                low: (fitted - half).max(p.low),
                high: (fitted + half).min(p.high),
                at_bound: fitted <= p.low + margin || fitted >= p.high - margin,
                // Of a prior that the data halve, they say three times what it says.
                is_told: certainty.sd[k] < 0.5 * scale,
            }
        };
        Some(Fitted {
            errors: self.errors(&values, &without)?,
            values: (0..values.len()).map(value).collect(),
            pairs: certainty.pairs,
            singular_values: certainty.singular_values,
            in_turn: self.trials(true).is_empty() && fitted.len() > 1,
            evaluations,
        })
    }

    /// `without`: values without each of the fitted trials.
    fn errors(&self, values: &[f64], without: &[Vec<f64>]) -> Option<Vec<Errors>> {
        let (fitted, held_back) = (self.trials(false), self.trials(true));
        let all = |trials: &[(usize, usize)], of: &(dyn Fn(usize) -> Vec<f64> + Sync)| {
            let errors = |(k, (case, trial)): (usize, &(usize, usize))| {
                Some((*case, *trial, self.cases[*case].errors(*trial, &of(k))?))
            };
            trials.par_iter().enumerate().map(errors).collect::<Option<Vec<_>>>()
        };
        let before = all(&fitted, &|_| self.off.clone())?;
        let after = all(&fitted, &|_| values.to_vec())?;
        let held_out = match (held_back.is_empty(), fitted.len()) {
            (false, _) => Some(all(&held_back, &|_| values.to_vec())?),
            (true, 0 | 1) => None,
            (true, _) => Some(all(&fitted, &|k| without[k].clone())?),
        };
        let floor = |&(case, trial): &(usize, usize)| (case, trial, self.cases[case].noise(trial));
        let floor: Vec<_> = fitted.iter().map(floor).collect();
        let errors = |quantity: Quantity| {
            Some(Errors {
                quantity,
                before: self.rms(quantity, &before)?,
                after: self.rms(quantity, &after)?,
                held_out: held_out.as_ref().and_then(|own| self.rms(quantity, own)),
                floor: self.rms(quantity, &floor)?,
            })
        };
        Some(QUANTITIES.into_iter().filter_map(errors).collect())
    }

    /// Over all cases, each by the number of its samples.
    fn rms(&self, quantity: Quantity, errors: &[(usize, usize, Vec<f64>)]) -> Option<f64> {
        let (mut sum, mut count) = (0.0, 0);
        for (c, case) in self.cases.iter().enumerate() {
            let mut own = vec![None; case.plant().trials().len()];
            for (_, trial, errors) in errors.iter().filter(|(case, ..)| *case == c) {
                own[*trial] = Some(errors.clone());
            }
            if let Some((rms, samples)) = case.rms(quantity, &own) {
                sum += rms * rms * samples as f64;
                count += samples;
            }
        }
        (count > 0).then(|| (sum / count as f64).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{self, Point};
    use crate::toy::{Toy, effect, noise};

    const SAMPLES: usize = 300;
    const NOISE: f64 = 0.02;

    fn parameter(name: &'static str) -> plant::Parameter {
        plant::Parameter { name, unit: "1", low: -4.0, high: 4.0, off: 0.0, scale: 1.0 }
    }

    /// Three trials of a wave and a slope, with an amplitude of 1.5 and a rise of −0.8; `shapes` says what
    /// the model's parameters do.
    fn calibration(shapes: fn(f64) -> [f64; 2]) -> Calibration<impl Plant> {
        let along = |i: usize| i as f64 / SAMPLES as f64;
        let predict = move |i: usize, point: &Point| {
            let [a, b] = shapes(along(i));
            let [x, y] = point.effects[0][..] else { return f64::NAN };
            let (anchor_x, anchor_y) = (point.anchor.effects[0][0], point.anchor.effects[0][1]);
            // A coarse model that is a tenth off, corrected at the anchor.
            1.1 * (a * x + b * y) - 0.1 * (a * anchor_x + b * anchor_y)
        };
        let mut toy = Toy::new(0.01, NOISE, (0..SAMPLES).map(|_| 0.0), predict).times(3);
        toy = toy.each(|trial, i| {
            let u = along(i);
            1.5 * (9.0 * u).sin() - 0.8 * u + NOISE * noise(i + SAMPLES * trial)
        });
        toy.effects = vec![effect("settings", vec![parameter("wave"), parameter("rise")], vec![])];
        toy.cheap = false;
        Calibration::new(vec![Case::new(toy).unwrap()], &[0.0, 0.0], |_, _| false)
    }

    fn options() -> Options {
        let objective = "toy".to_owned();
        Options { method: None, budget: 300, seed: 1, objective, state: None, resume: false }
    }

    fn fitted(calibration: &mut Calibration<impl Plant>) -> Fitted {
        let never = AtomicBool::new(false);
        let found = calibration.search(&options(), &never, &|_| {}).unwrap();
        calibration.finish(&found.best).unwrap().unwrap()
    }

    #[test]
    fn parameters_are_found_within_their_intervals_though_the_coarse_model_is_off() {
        let mut own = calibration(|u| [(9.0 * u).sin(), u]);
        assert!(own.without_influence().is_empty());
        let found = fitted(&mut own);
        for (value, truth) in found.values.iter().zip([1.5, -0.8]) {
            assert!(value.low < truth && truth < value.high, "{value:?}");
            assert!((value.fitted - truth).abs() < 0.02 && !value.at_bound && value.is_told);
        }
        let [errors] = found.errors[..] else { panic!("{:?}", found.errors) };
        assert!(errors.before > 0.8 && errors.after < 1.2 * NOISE, "{errors:?}");
        assert!(found.in_turn && errors.held_out.unwrap() < 1.2 * NOISE, "{errors:?}");
        assert!(found.pairs.is_empty());
    }

    #[test]
    fn what_is_held_back_is_not_fitted_and_scored() {
        let mut own = calibration(|u| [(9.0 * u).sin(), u]);
        own.held_back[0][2] = true;
        assert_eq!(own.fitted_trials(), 2);
        let found = fitted(&mut own);
        assert!(!found.in_turn && found.errors[0].held_out.unwrap() < 1.2 * NOISE);
    }

    #[test]
    fn parameters_that_do_the_same_are_named_as_a_pair() {
        let mut own = calibration(|u| [(9.0 * u).sin() + 0.001 * u, (9.0 * u).sin()]);
        let found = fitted(&mut own);
        assert_eq!((found.pairs[0].first, found.pairs[0].second), (0, 1));
        assert!(found.values.iter().all(|value| value.high - value.low > 0.5), "{found:?}");
        assert!(found.values.iter().any(|value| !value.is_told));
    }

    #[test]
    fn what_changes_nothing_is_named() {
        let own = calibration(|u| [(9.0 * u).sin(), 0.0]);
        assert_eq!(own.without_influence(), ["rise"]);
    }
}
