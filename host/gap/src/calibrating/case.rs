//! The residuals of a plant with one effect at given values, its nuisances refitted.

use nalgebra::DVector;

use crate::fitting::nuisance::Nuisances;
use crate::fitting::problem::Problem;
use crate::noise::floor::Floor;
use crate::plant::{Plant, Point, Quantity};
use crate::scoring::score::root_mean_square;

/// A plant whose first effect holds the parameters that are fitted, with its noise and the derivatives
/// of its nuisances.
pub struct Case<P> {
    plant: P,
    floor: Floor,
    nuisances: Nuisances,
    /// Where the finer model corrects the coarse one.
    anchor: Point,
}

impl<P: Plant> Case<P> {
    /// `None` when the nominal model breaks down.
    pub fn new(plant: P) -> Option<Self> {
        let floor = Floor::of(&plant);
        let anchor = Point::nominal(&plant);
        let problem = Problem::new(&plant, &floor, &crate::unwatched);
        let base = problem.residuals(&anchor)?;
        let nuisances = Nuisances::at(&problem, &anchor, &base)?;
        Some(Self { plant, floor, nuisances, anchor })
    }

    pub fn plant(&self) -> &P {
        &self.plant
    }

    /// Lets the finer model correct the coarse one at these values from now on.
    pub fn anchor(&mut self, values: &[f64]) {
        self.anchor = self.at(values).anchored();
    }

    fn at(&self, values: &[f64]) -> Point {
        let mut point = self.anchor.clone();
        if let Some(own) = point.effects.first_mut() {
            own.clear();
            own.extend_from_slice(values);
        }
        point
    }

    /// Robust residuals of a trial at these values, then what its nuisances cost, as
    /// [`crate::diagnose`] minimises them; `None` when the simulation breaks down.
    pub fn residuals(&self, trial: usize, values: &[f64]) -> Option<Vec<f64>> {
        let raw = self.raw(trial, values)?;
        let refit = self.nuisances.refit(trial, &raw);
        Some(refit.residual.iter().copied().collect())
    }

    /// (y − f)/σ of a trial with nuisances at 0.
    pub fn raw(&self, trial: usize, values: &[f64]) -> Option<DVector<f64>> {
        Problem::new(&self.plant, &self.floor, &crate::unwatched).residual(trial, &self.at(values))
    }

    /// To which part of its trial each of [`Case::residuals`] belongs, from 0 on; what nuisances cost
    /// belongs to the first.
    pub fn blocks(&self, trial: usize) -> Vec<usize> {
        let samples = &self.plant.trials()[trial].samples;
        let nuisances = std::iter::repeat_n(0, self.plant.nuisances().len());
        samples.iter().map(|sample| sample.block).chain(nuisances).collect()
    }

    /// Measured less predicted, of every sample of a trial in the unit of its channel, with its nuisances
    /// refitted; `None` when the simulation breaks down.
    pub fn errors(&self, trial: usize, values: &[f64]) -> Option<Vec<f64>> {
        let raw = self.raw(trial, values)?;
        let estimate = DVector::from_vec(self.nuisances.refit(trial, &raw).estimate);
        let left = &raw + self.nuisances.scaled(trial) * estimate;
        let samples = &self.plant.trials()[trial].samples;
        let sds = samples.iter().map(|sample| self.floor.sd_of(sample));
        Some(left.iter().zip(sds).map(|(r, sd)| r * sd).collect())
    }

    /// Root mean square over the trials that have errors, the axes of a vector together, and how many
    /// samples it is of; `None` where this is not measured.
    pub fn rms(&self, quantity: Quantity, errors: &[Option<Vec<f64>>]) -> Option<(f64, usize)> {
        let problem = Problem::new(&self.plant, &self.floor, &crate::unwatched);
        let error = |trial: usize, i: usize| Some(errors.get(trial)?.as_ref()?[i]);
        let rms = root_mean_square(&problem, quantity, error)?;
        let channels = self.plant.channels();
        let trials = self.plant.trials().iter().zip(errors).filter(|(_, own)| own.is_some());
        let samples = trials.flat_map(|(trial, _)| &trial.samples);
        let count = samples.filter(|own| channels[own.channel].quantity == quantity).count();
        Some((rms, count))
    }

    /// Standard deviations of the noise of every sample of a trial, in the unit of its channel: the
    /// errors of a perfect model.
    pub fn noise(&self, trial: usize) -> Vec<f64> {
        let samples = &self.plant.trials()[trial].samples;
        samples.iter().map(|sample| self.floor.sd_of(sample)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::toy::{Toy, effect, noise, parameter};

    const SAMPLES: usize = 200;
    const SLOPE: f64 = 2.0;

    fn along(i: usize) -> f64 {
        i as f64 / SAMPLES as f64
    }

    /// A slope of 2, of which a coarse model predicts a tenth more.
    fn case() -> Case<impl Plant> {
        let predict = |i: usize, point: &Point| {
            let (here, anchor) = (point.effects[0][0], point.anchor.effects[0][0]);
            (1.1 * here - 0.1 * anchor) * along(i)
        };
        let measured = (0..SAMPLES).map(|i| SLOPE * along(i) + 0.01 * noise(i));
        let mut toy = Toy::new(0.01, 0.01, measured, predict).times(2);
        toy.effects = vec![effect("slope", vec![parameter("slope")], vec![vec![1.0]])];
        toy.cheap = false;
        Case::new(toy).unwrap()
    }

    /// Of the first of two trials.
    fn errors<P: Plant>(case: &Case<P>, value: f64) -> Vec<Option<Vec<f64>>> {
        vec![case.errors(0, &[value]), None]
    }

    fn rms<P: Plant>(case: &Case<P>, value: f64) -> (f64, usize) {
        case.rms(Quantity::Force, &errors(case, value)).unwrap()
    }

    #[test]
    fn errors_are_those_of_the_model_at_the_values() {
        let mut case = case();
        // The slope of nothing at all, over half of the way.
        let (before, count) = rms(&case, 0.0);
        assert!((before - SLOPE / 3.0_f64.sqrt()).abs() < 0.02, "{before}");
        assert_eq!(count, SAMPLES);
        assert_eq!(case.rms(Quantity::Tip, &errors(&case, 0.0)), None);
        // The coarse model is right at a tenth less, the corrected one where it is.
        assert!(rms(&case, SLOPE / 1.1).0 < 0.02 && rms(&case, SLOPE).0 > 0.05);
        case.anchor(&[SLOPE]);
        assert!(rms(&case, SLOPE).0 < 0.02);
        assert_eq!(case.noise(1).len(), SAMPLES);
    }

    #[test]
    fn residuals_have_their_parts_and_are_smallest_at_the_slope() {
        let case = case();
        let cost = |value: f64| -> f64 {
            case.residuals(0, &[value]).unwrap().iter().map(|r| r * r).sum()
        };
        assert!(cost(SLOPE / 1.1) < cost(SLOPE) && cost(SLOPE) < cost(0.0));
        let blocks = case.blocks(0);
        assert_eq!(blocks.len(), case.residuals(0, &[0.0]).unwrap().len());
    }
}
