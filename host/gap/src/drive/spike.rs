//! Effects put into measured data: y' = y + f(θ) − f(θ₀) along the measured motion.
//!
//! A measured axis has friction of its own. θ₀ are the effects that are named in the unchanged data, and
//! the diagnosis looks for the added effect beside them.

use cathforce_bundle::bundle::{Bundle, DriveTrial, TrialData};

use super::course::Course;
use super::effects::{command, latency_s};
use super::error::DriveError;
use super::plant::Drive;
use crate::diagnosis::diagnose;
use crate::diagnosis::report::Diagnosis;
use crate::planning::spike::{Changes, Spike, SpikeError, Spiked, Sum, point};
use crate::plant::Altered;
use crate::plant::{Effect, Plant, Point};
use crate::signal::interpolate;

/// A row of a command of 1 in its column's unit.
fn one_unit(data: &DriveTrial) -> DriveTrial {
    let of = |value| vec![value];
    DriveTrial { position: of(0.0), command: of(1.0), setpoint: None, load: None, ..data.clone() }
}

/// A bundle into which effects can be put.
pub struct Spiking<'a> {
    bundle: &'a Bundle,
    drive: Drive,
    present: Vec<(String, Vec<f64>)>,
}

impl<'a> Spiking<'a> {
    /// Diagnoses what is there already.
    pub fn new(bundle: &'a Bundle) -> Result<Self, DriveError> {
        let drive = Drive::new(bundle)?;
        let present = diagnose(&drive, &bundle.rig.name, &crate::unwatched).values(&drive);
        Ok(Self { bundle, drive, present })
    }

    /// Effects that can be put in.
    pub fn effects(&self) -> &[Effect] {
        self.drive.effects()
    }

    /// Puts effects into the command of every trial.
    pub fn put_in(&self, spikes: &[Spike]) -> Result<Spiked, SpikeError> {
        let mut before = Point::nominal(&self.drive);
        for (values, effect) in before.effects.iter_mut().zip(self.effects()) {
            if let Some((_, present)) = self.present.iter().find(|(id, _)| id == effect.id) {
                values.clone_from(present);
            }
        }
        let (after, parameters) = point(self.effects(), &before, spikes)?;
        let mut bundle = self.bundle.clone();
        // A drive has no copies, and no trial in which it rests.
        let numbers = |trial: &cathforce_bundle::Trial| {
            self.drive.trials.iter().any(|own| own.number == trial.number)
        };
        bundle.trials.retain(numbers);
        let mut sum = Sum::default();
        for (trial, prepared) in bundle.trials.iter_mut().zip(&self.drive.motions) {
            let TrialData::Drive(data) = &mut trial.data else { continue };
            let start_s = trial.t_s[0];
            let course = Course::of(&self.drive.axis, &prepared.motion, &prepared.known, 1);
            let [old, new] = [&before, &after].map(|point| {
                let force_n = command(&course, point);
                let grid_s = self.drive.filters.grid_s;
                let later_s = latency_s(point) - start_s;
                move |t_s: f64| interpolate(&force_n, (t_s + later_s) / grid_s)
            });
            // In the unit of the column.
            let scale = self.drive.rig.driven(trial.number, &one_unit(data)).command[0];
            for (value, &t_s) in data.command.iter_mut().zip(&trial.t_s) {
                let change = new(t_s) - old(t_s);
                *value += change / scale;
                sum.add(&[change]);
            }
        }
        let changes = Changes { force_n: sum.rms(), ..Changes::default() };
        Ok(Spiked { bundle, parameters, changes })
    }

    /// What is named in a bundle of [`Spiking::put_in`] beside what was there.
    pub fn diagnose(&self, spiked: &Bundle) -> Result<Diagnosis, DriveError> {
        let present: Vec<(&str, &[f64])> =
            self.present.iter().map(|(id, values)| (id.as_str(), values.as_slice())).collect();
        let plant = Drive::new(spiked)?;
        Ok(diagnose(&Altered::assuming(&plant, &present), &spiked.rig.name, &crate::unwatched))
    }
}
