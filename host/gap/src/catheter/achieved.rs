//! The gap that is left on a device, scored as the diagnosis scores: with the same samples, noise and
//! nuisance parameters. The device's estimates take the place of the model's predictions.

use cathforce_mechanics::Description;
use cathforce_recording::{COLUMNS, Coverage, Estimate};
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::plant::Catheter;
use super::prepare::Prepared;
use super::simulate::{Trajectory, readings};
use crate::data::sanity::complaints_of_trial;
use crate::explaining::band::columns;
use crate::fitting::nuisance::Nuisances;
use crate::fitting::refit::Refit;
use crate::noise::floor::Floor;
use crate::parallel::each_or_none;
use crate::plant::Quantity;

/// Estimates farther apart than this are not bridged \[s\].
const MAX_GAP_S: f64 = 0.2;

/// Root mean squares over the scored samples of one trial, nuisances refitted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Left {
    /// The device as rig.toml states it.
    pub before: f64,
    /// The device with the settings.
    pub achieved: f64,
    /// The diagnosis' finer model with the settings: double precision, the device's tick, computed
    /// on this host. It is not the device's program, so its figures differ from the device's.
    pub finer_model: f64,
    pub floor: f64,
}

/// Shares of the gap above the floor that the settings close.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shrink {
    /// On the device.
    pub achieved: f64,
    /// By the diagnosis' finer model.
    pub finer_model: f64,
}

/// Mean squares over the floor's variance, of all channels: 1 is the floor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Energy {
    /// The device as rig.toml states it.
    pub before: f64,
    /// With the settings.
    pub achieved: f64,
}

/// The gap of one trial, before and after.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Achieved {
    #[serde(rename = "force_rms_N")]
    pub force_rms_n: Option<Left>,
    #[serde(rename = "drive_force_rms_N")]
    pub drive_force_rms_n: Option<Left>,
    pub tip_rms_m: Option<Left>,
    pub energy: Energy,
    /// `None` where the device as rig.toml states it has no gap above the floor.
    #[serde(skip)]
    pub shrink: Option<Shrink>,
    /// How many of them lie within the band that the device stated with the settings; `None` where
    /// it stated none. Nothing is refitted for that.
    pub coverage: Option<Coverage>,
    /// Samples that are compared.
    pub samples: usize,
}

/// Why nothing can be said about a trial.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AchievedError {
    #[error("there is no trial {0:03} in the bundle")]
    NoTrial(u32),
    #[error("{0} cannot be set in this rig's model")]
    Setting(String),
    #[error("the diagnosis' model breaks down with these settings")]
    BreaksDown,
    #[error(
        "no sample of the trial can be compared: it is too short, feeds less than 3 mm, or \
         measures nothing"
    )]
    NothingCompared,
}

/// What a device estimated, once as rig.toml states the rig and once with the settings.
#[derive(Clone, Copy, Debug)]
pub struct Runs<'a> {
    pub before: &'a [Estimate],
    pub after: &'a [Estimate],
}

impl Catheter {
    /// Why nothing can be concluded from what a trial measured, whatever a device makes of it;
    /// empty where nothing is the matter. What a diagnosis would object to, with the model of
    /// rig.toml or else with the settings.
    ///
    /// `number`: of the trial; `settings`: parameters of the description by key.
    pub fn objections(
        &self,
        number: u32,
        settings: &[(String, f64)],
    ) -> Result<Vec<String>, AchievedError> {
        let trial = self.position(number)?;
        let is_force = |what: &&&str| what.contains("force");
        let dead = self.prepared[trial].dead().iter().filter(is_force).map(|what| {
            format!("{what} has the same value in every row: its sensor was off or not connected")
        });
        let none = vec![0.0; self.nuisances.len()];
        let complaints = |description: &Description<f64>| {
            let setup = description.clone().into();
            let predicted = self.predict(trial, &setup, &none, (&setup, 0))?;
            Some(complaints_of_trial(self, trial, &predicted))
        };
        let broken = AchievedError::BreaksDown;
        let mut found = complaints(&self.nominal).ok_or(broken.clone())?;
        if found.is_empty() {
            found = complaints(&self.applied(settings)?).ok_or(broken)?;
        }
        Ok(dead.chain(found).collect())
    }

    fn position(&self, number: u32) -> Result<usize, AchievedError> {
        let trial = self.trials.iter().position(|trial| trial.number == number);
        trial.ok_or(AchievedError::NoTrial(number))
    }

    /// The nominal model with settings.
    fn applied(&self, settings: &[(String, f64)]) -> Result<Description<f64>, AchievedError> {
        let mut applied = self.nominal.clone();
        for (key, value) in settings {
            let set = applied.set_parameter(key, *value);
            set.map_err(|_| AchievedError::Setting(key.clone()))?;
        }
        Ok(applied)
    }

    /// Compares what a device estimated while it played a trial.
    ///
    /// `number`: of the trial; `settings`: parameters of the description by key.
    pub fn achieved(
        &self,
        number: u32,
        settings: &[(String, f64)],
        runs: Runs<'_>,
    ) -> Result<Achieved, AchievedError> {
        let trial = self.position(number)?;
        let applied = self.applied(settings)?;
        let floor = Floor::of(self);
        let sd = self.trials[trial].samples.iter().map(|sample| floor.sd_of(sample));
        let own = &self.prepared[trial];
        let device =
            [(&self.nominal, runs.before), (&applied, runs.after)].map(|(d, estimates)| {
                let played = own.played(estimates);
                own.read(&played, &readings(d, &own.inputs, &played), 0.0)
            });
        let until_s = own.end_of(runs.before).min(own.end_of(runs.after));
        let compared = Compared { catheter: self, trial, sd: sd.collect(), until_s };
        if compared.samples() == 0 {
            return Err(AchievedError::NothingCompared);
        }
        let broken = AchievedError::BreaksDown;
        let nominal = compared.score(&self.nominal, &device[0]).ok_or(broken.clone())?;
        let applied = compared.score(&applied, &device[1]).ok_or(broken)?;
        let left = |quantity: Quantity| {
            Some(Left {
                before: compared.rms(quantity, &nominal.device)?,
                achieved: compared.rms(quantity, &applied.device)?,
                finer_model: compared.rms(quantity, &applied.model)?,
                floor: compared.floor(quantity)?,
            })
        };
        // The floor's energy is 1.
        let share = |before: &Refit, after: &Refit| {
            let (before, after) = (compared.energy(before) - 1.0, compared.energy(after) - 1.0);
            (before > 0.0).then(|| 1.0 - after.max(0.0) / before)
        };
        let finer_model = share(&nominal.model, &applied.model);
        let achieved = share(&nominal.device, &applied.device);
        Ok(Achieved {
            force_rms_n: left(Quantity::Force),
            drive_force_rms_n: left(Quantity::DriveForce),
            tip_rms_m: left(Quantity::Tip),
            energy: Energy {
                before: compared.energy(&nominal.device),
                achieved: compared.energy(&applied.device),
            },
            shrink: achieved
                .zip(finer_model)
                .map(|(achieved, finer_model)| Shrink { achieved, finer_model }),
            coverage: compared.coverage(runs.after, &device[1]),
            samples: compared.samples(),
        })
    }
}

/// One trial, and what of it is compared.
struct Compared<'a> {
    catheter: &'a Catheter,
    trial: usize,
    /// Standard deviation of every sample.
    sd: Vec<f64>,
    /// What the device played.
    until_s: f64,
}

/// Model and device with the same settings, nuisances refitted.
struct Pair {
    model: Refit,
    device: Refit,
}

impl Compared<'_> {
    /// Whether a sample counts: a device tells of its shape too seldom.
    fn counts(&self, i: usize) -> bool {
        let sample = &self.catheter.trials[self.trial].samples[i];
        let quantity = self.catheter.channels[sample.channel].quantity;
        quantity != Quantity::Shape && sample.t_s < self.until_s
    }

    fn samples(&self) -> usize {
        (0..self.sd.len()).filter(|&i| self.counts(i)).count()
    }

    /// (y − f)/σ, 0 where it does not count.
    fn residual(&self, predicted: &[f64]) -> DVector<f64> {
        let samples = &self.catheter.trials[self.trial].samples;
        let of = |i: usize| {
            if self.counts(i) { (samples[i].value - predicted[i]) / self.sd[i] } else { 0.0 }
        };
        DVector::from_iterator(samples.len(), (0..samples.len()).map(of))
    }

    fn score(&self, description: &Description<f64>, device: &[f64]) -> Option<Pair> {
        let priors = &self.catheter.nuisances;
        let setup = description.clone().into();
        let predict = |moved: Option<usize>| {
            let mut nuisances = vec![0.0; priors.len()];
            if let Some(k) = moved {
                nuisances[k] = priors[k].sd;
            }
            self.catheter.predict(self.trial, &setup, &nuisances, (&setup, 0))
        };
        let model = self.residual(&predict(None)?);
        let column = |k: usize| Some(self.residual(&predict(Some(k))?) - &model);
        let columns = each_or_none(0..priors.len(), column)?;
        let nuisances = Nuisances::of(vec![DMatrix::from_columns(&columns)]);
        let device = self.residual(device);
        if !device.iter().all(|x| x.is_finite()) {
            return None;
        }
        Some(Pair { model: nuisances.refit(0, &model), device: nuisances.refit(0, &device) })
    }

    /// The forces that a device predicted, and those that lie within its band.
    fn coverage(&self, estimates: &[Estimate], predicted: &[f64]) -> Option<Coverage> {
        let own = &self.catheter.prepared[self.trial];
        let columns = columns(self.catheter)?;
        let mut coverage = Coverage::default();
        for (i, sample) in self.catheter.trials[self.trial].samples.iter().enumerate() {
            let Some(column) = columns[sample.channel].filter(|_| self.counts(i)) else { continue };
            let after = estimates.partition_point(|e| own.start_s() + e.t_s < sample.t_s);
            let width = estimates.get(after).and_then(|estimate| half_width_n(estimate, column));
            coverage.channels[column].count(width, sample.value - predicted[i], sample.noise);
        }
        coverage.channels.iter().any(|own| own.stated > 0).then_some(coverage)
    }

    /// Energy per sample, what the nuisances cost included.
    fn energy(&self, of: &Refit) -> f64 {
        of.energy() / self.samples() as f64
    }

    fn rms(&self, quantity: Quantity, of: &Refit) -> Option<f64> {
        self.root_mean_square(quantity, |i| of.residual[i] * self.sd[i])
    }

    fn floor(&self, quantity: Quantity) -> Option<f64> {
        self.root_mean_square(quantity, |i| self.sd[i])
    }

    /// Of a vector its norm, as [`crate::scoring::score`] has it.
    fn root_mean_square(&self, quantity: Quantity, error: impl Fn(usize) -> f64) -> Option<f64> {
        let mut sums = vec![(0.0, 0_usize); self.catheter.channels.len()];
        for (i, sample) in self.catheter.trials[self.trial].samples.iter().enumerate() {
            let wanted = self.catheter.channels[sample.channel].quantity == quantity;
            if wanted && self.counts(i) {
                sums[sample.channel].0 += error(i).powi(2);
                sums[sample.channel].1 += 1;
            }
        }
        let measured = sums.iter().filter(|(_, n)| *n > 0);
        let sum: f64 = measured.clone().map(|(sum, n)| sum / *n as f64).sum();
        (measured.count() > 0).then(|| sum.sqrt())
    }
}

/// The half width that a device stated in a tick \[N\].
fn half_width_n(estimate: &Estimate, column: usize) -> Option<f64> {
    match estimate.force_half_width_n {
        _ if column + 1 == COLUMNS => estimate.drive_force_half_width_n,
        Some(xyz) => xyz.get(column).copied(),
        None => None,
    }
}

impl Prepared {
    /// A device's estimates at the ticks of the diagnosis.
    fn played(&self, estimates: &[Estimate]) -> Trajectory {
        let force: Vec<_> = estimates.iter().map(|e| (e.t_s, e.force_n)).collect();
        let drive: Vec<_> =
            estimates.iter().filter_map(|e| Some((e.t_s, [e.drive_force_n?]))).collect();
        let tip: Vec<_> = estimates.iter().filter_map(|e| Some((e.t_s, e.tip_m?))).collect();
        let mut played = Trajectory::default();
        for tick in 0..self.inputs.insertion_m.len() {
            let t_s = tick as f64 * self.inputs.tick_s;
            played.force_n.push(at(&force, t_s));
            played.drive_force_n.push(at(&drive, t_s)[0]);
            played.tip_m.push(at(&tip, t_s));
        }
        played
    }

    /// Time of the trial at which estimates end or break off \[s\].
    fn end_of(&self, estimates: &[Estimate]) -> f64 {
        let gap = estimates.windows(2).find(|pair| pair[1].t_s - pair[0].t_s > MAX_GAP_S);
        let end = gap.map(|pair| pair[0].t_s).or(estimates.last().map(|last| last.t_s));
        // Samples reach a little to either side of their time.
        end.map_or(f64::NEG_INFINITY, |end| self.start_s() + end - 0.02)
    }
}

/// Linear interpolation; held at both ends. NaN of nothing.
fn at<const N: usize>(series: &[(f64, [f64; N])], t_s: f64) -> [f64; N] {
    let after = series.partition_point(|(t, _)| *t <= t_s);
    let low = series.get(after.saturating_sub(1));
    let high = series.get(after).or(series.last());
    let (Some((t0, x0)), Some((t1, x1))) = (low, high) else { return [f64::NAN; N] };
    let share = if t1 > t0 { ((t_s - t0) / (t1 - t0)).clamp(0.0, 1.0) } else { 0.0 };
    std::array::from_fn(|k| x0[k] + share * (x1[k] - x0[k]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_are_interpolated_and_held_at_their_ends() {
        let series = [(1.0, [0.0, 2.0]), (2.0, [1.0, 4.0])];
        assert_eq!(at(&series, 0.0), [0.0, 2.0]);
        assert_eq!(at(&series, 1.5), [0.5, 3.0]);
        assert_eq!(at(&series, 9.0), [1.0, 4.0]);
        assert!(at::<1>(&[], 0.0)[0].is_nan());
    }
}
