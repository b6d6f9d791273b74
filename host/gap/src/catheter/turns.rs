//! Finds rotations that do not follow the format: in degrees, or with the opposite sign.
//!
//! Rotation is an input of the model and is not compared with anything itself. The trials are simulated
//! with the rotation read in another way. If that explains most of the error, no effect is named for it.

use super::plant::Catheter;
use super::simulate::{Setup, readings};
use crate::noise::floor::Floor;

/// A trial that is turned by less tells nothing \[rad\] …
const LEAST_TURN_RAD: f64 = 0.5;
/// … and one by less than this is not in degrees.
const LEAST_TURN_IN_DEGREES: f64 = 10.0;
/// Mean square of the residuals, in floors, from which on another rotation is tried.
const FAR_OFF: f64 = 2.0;

/// What a stated rotation may be instead.
struct Other {
    /// It is to be multiplied by this.
    factor: f64,
    /// How far it must be turned for that \[rad\].
    least_rad: f64,
    /// It must leave less than this share of what the stated one leaves above the floor.
    leaves: f64,
    says: &'static str,
}

/// Turns of so many radians differ from those of as many degrees by less than a turn: less is asked for.
const OTHERS: [Other; 2] = [
    Other {
        factor: std::f64::consts::PI / 180.0,
        least_rad: LEAST_TURN_IN_DEGREES,
        leaves: 0.5,
        says: "rotation_rad looks like degrees: give it in radians",
    },
    Other {
        factor: -1.0,
        least_rad: LEAST_TURN_RAD,
        leaves: 0.3,
        says: "rotation_rad looks counted the other way round: +90° turns the bend from up to direction × \
               up; give it so, or, if it is, the axes of [entry]",
    },
];

impl Catheter {
    /// Why no verdict rests on these rotations; `None` of what may be as it is stated.
    pub(super) fn complaint_of_turns(&self) -> Option<String> {
        let floor = Floor::of(self);
        OTHERS.into_iter().find_map(|Other { factor, least_rad, leaves, says }| {
            let turned: Vec<usize> =
                (0..self.trials.len()).filter(|t| self.turned_rad(*t) >= least_rad).collect();
            let sum = |factor: f64| -> Option<f64> {
                turned.iter().map(|&trial| self.above_floor(&floor, trial, factor)).sum()
            };
            let samples: usize = turned.iter().map(|&t| self.trials[t].samples.len()).sum();
            let stated = sum(1.0).filter(|left| *left > (FAR_OFF - 1.0) * samples as f64)?;
            let other = sum(factor)?;
            (other < leaves * stated).then(|| {
                format!(
                    "{says}; with that change the error of the nominal model is {:.0} % of its error as \
                     stated, so nothing is concluded",
                    100.0 * other.max(0.0) / stated
                )
            })
        })
    }

    /// How far it is turned at most, from where the bend is up.
    fn turned_rad(&self, trial: usize) -> f64 {
        self.prepared[trial].inputs.rotation_rad.iter().fold(0.0, |most, rad| rad.abs().max(most))
    }

    /// Sum of squares of what the nominal model leaves in a trial with its rotation times a factor, in
    /// floors, above the floor.
    fn above_floor(&self, floor: &Floor, trial: usize, factor: f64) -> Option<f64> {
        let own = self.prepared.get(trial)?;
        let mut inputs = own.inputs.clone();
        inputs.rotation_rad.iter_mut().for_each(|rad| *rad *= factor);
        let found = self.simulator.simulate(&Setup::from(self.nominal.clone()), 0.0, &inputs)?;
        let predicted = own.read(&found, &readings(&self.nominal, &inputs, &found), 0.0);
        let samples = self.trials[trial].samples.iter();
        let squares = samples.zip(predicted).map(|(sample, predicted)| {
            ((sample.value - predicted) / floor.sd_of(sample)).powi(2) - 1.0
        });
        Some(squares.sum())
    }
}
