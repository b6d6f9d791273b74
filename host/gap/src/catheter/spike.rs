//! Effects put into measured data: y' = y + f(θ) − f(0), where f is the device's model.
//!
//! The error of the model on the measurement stays in the data, so a diagnosis must find the effect
//! beside it. f has the links and the ticks of the device, which are finer than those of the diagnosis.

use cathforce_bundle::bundle::{CatheterTrial, Trial, TrialData, VectorColumn};
use cathforce_bundle::lumen::BuiltLumen;
use cathforce_bundle::{Bundle, SolverDefaults, to_description};
use cathforce_mechanics::Description;

use super::check::CatheterError;
use super::library::Library;
use super::plant::{Catheter, lumen};
use super::prepare::Prepared;
use super::simulate::{Inputs, Simulator, Trajectory, readings};
use crate::parallel::each;
use crate::planning::spike::{self, Changes, Spike, SpikeError, Spiked, Sum};
use crate::plant::{Effect, Point};
use crate::signal::interpolate;

/// A bundle into which effects can be put.
pub struct Spiking<'a> {
    bundle: &'a Bundle,
    lumen: BuiltLumen,
    model: Description<f64>,
    simulator: Simulator,
    inputs: Vec<Inputs>,
    library: Library,
}

impl<'a> Spiking<'a> {
    /// Plays every trial as rig.toml states the rig.
    pub fn new(bundle: &'a Bundle) -> Result<Self, CatheterError> {
        super::check::check(bundle)?;
        let defaults = SolverDefaults::default();
        let model = to_description::<f64>(bundle, &defaults).ok_or(CatheterError::NoTrials)?;
        let (lumen, _) = lumen(bundle, model.instrument.outer_radius_m)?;
        let prepared =
            bundle.trials.iter().map(|t| Prepared::of(t, &bundle.rig.sensor, defaults.tick_s));
        let inputs: Option<Vec<Inputs>> = prepared.map(|own| Some(own?.inputs)).collect();
        let mut spiking = Self {
            simulator: Simulator::new(
                lumen.header,
                lumen.bytes.clone(),
                model.instrument.outer_radius_m,
                bundle.trials.len(),
            ),
            inputs: inputs.ok_or(CatheterError::NoTrials)?,
            library: Library { effects: Vec::new(), keys: Vec::new() },
            bundle,
            lumen,
            model,
        };
        let nominal = spiking.play(&spiking.model).map_err(CatheterError::Nominal)?;
        let tips_m: Vec<[f64; 3]> =
            nominal.iter().flat_map(|found| found.trajectory.tip_m.iter().copied()).collect();
        spiking.library = Library::of(&spiking.model, &tips_m);
        Ok(spiking)
    }

    /// Effects that this rig can have.
    pub fn effects(&self) -> &[Effect] {
        &self.library.effects
    }

    /// Puts effects into the data of every trial.
    pub fn put_in(&self, spikes: &[Spike]) -> Result<Spiked, SpikeError> {
        let effects = &self.library.effects;
        let (point, parameters) = spike::point(effects, &Point::off(effects, 0), spikes)?;
        let number = |trial: usize| self.bundle.trials[trial].number;
        // Ranges are checked, so that only a combination of values can be refused.
        let altered =
            self.library.describe(&self.model, &point).ok_or(SpikeError::BreaksDown(number(0)))?;
        let before = self.play(&self.model).map_err(SpikeError::BreaksDown)?;
        let after = self.play(&altered).map_err(SpikeError::BreaksDown)?;
        let mut bundle = self.bundle.clone();
        let mut sums = Sums::default();
        for (trial, (before, after)) in bundle.trials.iter_mut().zip(before.iter().zip(&after)) {
            sums.add(trial, before, after);
        }
        Ok(Spiked { bundle, parameters, changes: sums.changes() })
    }

    /// A bundle of [`Spiking::put_in`] as something to diagnose, in the vessel that is known.
    pub fn plant(&self, spiked: &Bundle) -> Result<Catheter, CatheterError> {
        Catheter::in_lumen(spiked, self.lumen.header, self.lumen.bytes.clone())
    }

    /// What the sensors read without noise, trial by trial; else the number of the trial on which
    /// the model breaks down.
    fn play(&self, description: &Description<f64>) -> Result<Vec<Played<'_>>, u32> {
        let mut mechanics = description.clone();
        mechanics.effects.sensor = self.model.effects.sensor;
        let mechanics = mechanics.into();
        let one = |trial: usize| {
            let inputs = &self.inputs[trial];
            let trajectory = self.simulator.run(trial, &mechanics, 0.0, inputs);
            let trajectory = trajectory.ok_or(self.bundle.trials[trial].number)?;
            let force_n = readings(description, inputs, &trajectory);
            Ok(Played { inputs, trajectory, force_n })
        };
        // In their order: which trial is told of does not depend on which one is played first.
        let played: Vec<Result<_, u32>> = each(0..self.inputs.len(), one);
        played.into_iter().collect()
    }
}

/// One trial played by the model.
struct Played<'a> {
    inputs: &'a Inputs,
    trajectory: std::sync::Arc<Trajectory>,
    /// What the sensor reads, one a tick.
    force_n: Vec<[f64; 3]>,
}

impl Played<'_> {
    /// A vector of every tick, between ticks in a straight line.
    fn vector(&self, series: &[[f64; 3]], seconds: f64) -> [f64; 3] {
        let index = seconds / self.inputs.tick_s;
        let last = series.len().saturating_sub(1);
        let low = (index.max(0.0) as usize).min(last);
        let high = (low + 1).min(last);
        let share = (index - low as f64).clamp(0.0, 1.0);
        [0, 1, 2].map(|k| series[low][k] + share * (series[high][k] - series[low][k]))
    }

    /// Points on the shape at a row that has some.
    fn shape(&self, seconds: f64) -> Option<&[[f64; 3]]> {
        let last = self.inputs.insertion_m.len() - 1;
        let tick = ((seconds / self.inputs.tick_s).round() as usize).min(last);
        let at = self.inputs.shape_ticks.binary_search(&tick).ok()?;
        self.trajectory.shapes.get(at).map(Vec::as_slice)
    }
}

#[derive(Default)]
struct Sums {
    force: Sum,
    drive: Sum,
    tip: Sum,
    shape: Sum,
}

impl Sums {
    /// Adds the difference to every number that the trial measured, and counts it.
    fn add(&mut self, trial: &mut Trial, before: &Played<'_>, after: &Played<'_>) {
        let Trial { t_s, data: TrialData::Catheter(data), .. } = trial else { return };
        let start_s = t_s.first().copied().unwrap_or_default();
        let seconds: Vec<f64> = t_s.iter().map(|t| t - start_s).collect();
        let CatheterTrial { force_n, drive_force_n, tip_m, shape_m, .. } = data;
        let between = |a: &[[f64; 3]], b: &[[f64; 3]], s: f64| {
            let (a, b) = (before.vector(a, s), after.vector(b, s));
            Some([0, 1, 2].map(|k| b[k] - a[k]))
        };
        if let Some(column) = force_n {
            self.force.shift(column, &seconds, |s| between(&before.force_n, &after.force_n, s));
        }
        if let Some(column) = tip_m {
            let (a, b) = (&before.trajectory.tip_m, &after.trajectory.tip_m);
            self.tip.shift(column, &seconds, |s| between(a, b, s));
        }
        for (point, column) in shape_m.iter_mut().enumerate() {
            self.shape.shift(column, &seconds, |s| {
                let (a, b) = (before.shape(s)?.get(point)?, after.shape(s)?.get(point)?);
                Some([0, 1, 2].map(|k| b[k] - a[k]))
            });
        }
        for (value, s) in drive_force_n.iter_mut().flatten().zip(&seconds) {
            let at = |played: &Played<'_>| {
                interpolate(&played.trajectory.drive_force_n, s / played.inputs.tick_s)
            };
            if let Some(value) = value {
                let change = at(after) - at(before);
                *value += change;
                self.drive.add(&[change]);
            }
        }
    }

    fn changes(&self) -> Changes {
        Changes {
            force_n: self.force.rms(),
            drive_force_n: self.drive.rms(),
            tip_m: self.tip.rms(),
            shape_m: self.shape.rms(),
        }
    }
}

impl Sum {
    /// Adds to every row of a column what `change` says of its time since the first row.
    fn shift(
        &mut self,
        column: &mut VectorColumn,
        seconds: &[f64],
        change: impl Fn(f64) -> Option<[f64; 3]>,
    ) {
        for (value, s) in column.iter_mut().zip(seconds) {
            if let Some((value, change)) = value.as_mut().zip(change(*s)) {
                value.iter_mut().zip(change).for_each(|(x, d)| *x += d);
                self.add(&change);
            }
        }
    }
}
