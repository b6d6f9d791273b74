//! Effects put into measured outputs: y' = y + f(θ) − f(θ₀) along the measured input.
//!
//! θ₀ are the effects that are named in the unchanged data, as of a drive.

use cathforce_bundle::bundle::{Bundle, TrialData};

use super::plant::{Transmission, TransmissionError, output};
use crate::diagnosis::diagnose;
use crate::diagnosis::report::Diagnosis;
use crate::planning::spike::{Changes, Spike, SpikeError, Spiked, Sum, point};
use crate::plant::{Altered, Effect, Plant, Point};
use crate::signal::interpolate;

/// A bundle into which effects can be put.
pub struct Spiking<'a> {
    bundle: &'a Bundle,
    transmission: Transmission,
    present: Vec<(String, Vec<f64>)>,
}

impl<'a> Spiking<'a> {
    /// Diagnoses what is there already.
    pub fn new(bundle: &'a Bundle) -> Result<Self, TransmissionError> {
        let transmission = Transmission::new(bundle)?;
        let answer = diagnose(&transmission, &bundle.rig.name, &crate::unwatched);
        let present = answer.values(&transmission);
        Ok(Self { bundle, transmission, present })
    }

    /// Effects that can be put in.
    pub fn effects(&self) -> &[Effect] {
        self.transmission.effects()
    }

    /// Puts effects into the output of every trial.
    pub fn put_in(&self, spikes: &[Spike]) -> Result<Spiked, SpikeError> {
        let own = &self.transmission;
        let mut before = Point::nominal(own);
        for (values, effect) in before.effects.iter_mut().zip(self.effects()) {
            if let Some((_, present)) = self.present.iter().find(|(id, _)| id == effect.id) {
                values.clone_from(present);
            }
        }
        let (after, parameters) = point(self.effects(), &before, spikes)?;
        let mut bundle = self.bundle.clone();
        // A transmission has no copies.
        let is_used = |trial: &cathforce_bundle::Trial| {
            own.trials().iter().any(|used| used.number == trial.number)
        };
        bundle.trials.retain(is_used);
        let mut sum = Sum::default();
        for (trial, motion) in bundle.trials.iter_mut().zip(own.motions()) {
            let TrialData::Transmission(data) = &mut trial.data else { continue };
            let start_s = trial.t_s[0];
            let [old, new] = [&before, &after].map(|point| {
                let model = own.model(point);
                let bend = motion.bend_rad.as_deref();
                let out = output(&model, motion.grid_s, &motion.input, &motion.load, bend);
                let earlier_s = start_s + model.latency_s;
                let grid_s = motion.grid_s;
                move |t_s: f64| interpolate(&out, (t_s - earlier_s) / grid_s)
            });
            for (value, &t_s) in data.output.iter_mut().zip(&trial.t_s) {
                let change = new(t_s) - old(t_s);
                *value += change;
                sum.add(&[change]);
            }
        }
        let changes = Changes { force_n: sum.rms(), ..Changes::default() };
        Ok(Spiked { bundle, parameters, changes })
    }

    /// What is named in a bundle of [`Spiking::put_in`] beside what was there.
    pub fn diagnose(&self, spiked: &Bundle) -> Result<Diagnosis, TransmissionError> {
        let present: Vec<(&str, &[f64])> =
            self.present.iter().map(|(id, values)| (id.as_str(), values.as_slice())).collect();
        let plant = Transmission::new(spiked)?;
        Ok(diagnose(&Altered::assuming(&plant, &present), &spiked.rig.name, &crate::unwatched))
    }
}
