//! Nuisances: what differs from run to run on any rig. In every trial and for every candidate they are refitted within
//! their priors ([`Refit`]).
//!
//! They are linear over their priors, so that refitting costs no simulation. Where one is not, its derivatives are taken
//! again nearer to where it is found.

use nalgebra::{DMatrix, DVector};

use crate::fitting::loss::Loss;
use crate::fitting::problem::{Coordinate, Problem};
use crate::fitting::refit::Refit;
use crate::plant::Point;

/// Root mean square by which whitened residuals may be off the line before derivatives are taken again. It adds
/// 5 % to the error at the floor.
const BENT: f64 = 0.3;

/// Derivatives of the whitened residuals with respect to the nuisances, times their priors.
#[derive(Clone, Debug)]
pub struct Nuisances {
    scaled: Vec<DMatrix<f64>>,
    /// What a residual differs by from the linear one where the nuisances were found to be.
    bend: Vec<DVector<f64>>,
    loss: Loss,
}

/// A simulation at an estimate of the nuisances: how far from linear it is, and its loss with the penalty.
struct Seen {
    bend: DVector<f64>,
    loss: f64,
}

/// A point with the nuisances of one trial, in standard deviations of their priors.
fn moved(point: &Point, estimate: &[f64], problem: &Problem<'_>) -> Point {
    let mut there = point.clone();
    let known = problem.plant.nuisances();
    for ((value, z), known) in there.nuisances.iter_mut().zip(estimate).zip(known) {
        *value += z * known.sd;
    }
    there
}

impl Nuisances {
    /// Derivatives at a point where the residuals are `base`; `None` when a simulation breaks
    /// down.
    pub fn at(problem: &Problem<'_>, point: &Point, base: &[DVector<f64>]) -> Option<Self> {
        Self::of_trials(problem, &problem.trials(), point, base)
    }

    /// The same of some trials, which are counted from 0 on afterwards.
    pub fn of_trials(
        problem: &Problem<'_>,
        trials: &[usize],
        point: &Point,
        base: &[DVector<f64>],
    ) -> Option<Self> {
        let nuisances = problem.plant.nuisances();
        let coordinates: Vec<_> = (0..nuisances.len()).map(Coordinate::Nuisance).collect();
        let mut scaled = if point.anchor.is_everywhere {
            // What they do is the same by the model that costs less.
            let point = point.clone().anchored();
            let base = problem.residuals_of(trials, &point)?;
            problem.sensitivities(trials, &point, &base, &coordinates)?
        } else {
            problem.sensitivities(trials, point, base, &coordinates)?
        };
        for matrix in &mut scaled {
            for (mut column, nuisance) in matrix.column_iter_mut().zip(nuisances) {
                column *= nuisance.sd;
            }
        }
        let bend = base.iter().map(|own| DVector::zeros(own.len())).collect();
        let mut own = Self { scaled, bend, loss: Loss::of(problem.plant) };
        if !problem.plant.cheap() {
            own.follow(problem, trials, point, base)?;
        }
        Some(own)
    }

    /// Takes derivatives nearer to where the nuisances are found to be, in trials in which they are not linear up to
    /// there: a Gauss–Newton step more.
    fn follow(
        &mut self,
        problem: &Problem<'_>,
        trials: &[usize],
        point: &Point,
        base: &[DVector<f64>],
    ) -> Option<()> {
        let all: Vec<usize> = (0..trials.len()).collect();
        let found = crate::parallel::each_or_none(&all, |&at| {
            Some(self.followed(problem, at, trials[at], point, &base[at]))
        })?;
        for (at, (scaled, bend)) in found.into_iter().enumerate() {
            self.bend[at] = bend;
            if let Some(scaled) = scaled {
                self.scaled[at] = scaled;
            }
        }
        Some(())
    }

    /// Derivatives S of a trial where they are others, and its bend r(ẑ) − r(0) − S ẑ, with which the residual is
    /// right at ẑ too and not only where the nuisances are 0. Where the bend is larger than S ẑ itself, no expansion
    /// holds (a contact was lost, the other branch was taken), and the first line is kept.
    fn followed(
        &self,
        problem: &Problem<'_>,
        at: usize,
        trial: usize,
        point: &Point,
        base: &DVector<f64>,
    ) -> (Option<DMatrix<f64>>, DVector<f64>) {
        let straight = || DVector::zeros(base.len());
        let estimate = self.refit(at, base).estimate;
        let Some(own) = self.seen_from(problem, trial, point, base, &estimate, &self.scaled[at])
        else {
            return (None, straight());
        };
        if own.bend.norm_squared() > BENT.powi(2) * base.len() as f64 {
            // Where the way to the estimate leads past a fork, a part of it may not.
            let from = |share: f64| {
                let part: Vec<f64> = estimate.iter().map(|z| share * z).collect();
                let again = self.once_more(problem, trial, point, base, &part);
                again.filter(|(_, again)| again.loss < own.loss)
            };
            if let Some((scaled, again)) = from(1.0).or_else(|| from(0.5)) {
                return (Some(scaled), again.bend);
            }
        }
        let line = &self.scaled[at] * DVector::from_column_slice(&estimate);
        let holds = own.bend.norm() < line.norm();
        (None, if holds { own.bend } else { straight() })
    }

    /// Derivatives at an estimate, and what is seen where they lead to.
    fn once_more(
        &self,
        problem: &Problem<'_>,
        trial: usize,
        point: &Point,
        base: &DVector<f64>,
        estimate: &[f64],
    ) -> Option<(DMatrix<f64>, Seen)> {
        let known = problem.plant.nuisances();
        let there = moved(point, estimate, problem);
        let residual = problem.residual(trial, &there)?;
        let coordinates: Vec<_> = (0..known.len()).map(Coordinate::Nuisance).collect();
        let from = std::slice::from_ref(&residual);
        let mut scaled = problem.sensitivities(&[trial], &there, from, &coordinates)?.pop()?;
        for (mut column, nuisance) in scaled.column_iter_mut().zip(known) {
            column *= nuisance.sd;
        }
        let line = &scaled * DVector::from_column_slice(estimate);
        let from_there =
            Self { bend: vec![residual - base - line], scaled: vec![scaled], loss: self.loss };
        let estimate = from_there.refit(0, base).estimate;
        let scaled = &from_there.scaled[0];
        let seen = self.seen_from(problem, trial, point, base, &estimate, scaled)?;
        Some((from_there.scaled[0].clone(), seen))
    }

    /// What a simulation at an estimate tells.
    fn seen_from(
        &self,
        problem: &Problem<'_>,
        trial: usize,
        point: &Point,
        base: &DVector<f64>,
        estimate: &[f64],
        scaled: &DMatrix<f64>,
    ) -> Option<Seen> {
        let residual = problem.residual(trial, &moved(point, estimate, problem))?;
        let of = |r: &f64| self.loss.of_residual(*r).0.powi(2);
        let penalty: f64 = estimate.iter().map(|z| z * z).sum();
        let loss = residual.iter().map(of).sum::<f64>() + penalty;
        let line = scaled * DVector::from_column_slice(estimate);
        Some(Seen { bend: residual - base - line, loss })
    }

    /// From S of every trial, which somebody else has computed.
    pub fn of(scaled: Vec<DMatrix<f64>>) -> Self {
        let bend = scaled.iter().map(|own| DVector::zeros(own.nrows())).collect();
        Self { scaled, bend, loss: Loss::SQUARES }
    }

    /// Number of trials.
    pub fn trials(&self) -> usize {
        self.scaled.len()
    }

    /// S of one trial, samples × nuisances.
    pub fn scaled(&self, trial: usize) -> &DMatrix<f64> {
        &self.scaled[trial]
    }

    /// What is added to a residual of one trial before it is linear in the nuisances.
    pub fn bend(&self, trial: usize) -> &DVector<f64> {
        &self.bend[trial]
    }

    /// Refits the nuisances of one trial to its whitened residual.
    pub fn refit(&self, trial: usize, residual: &DVector<f64>) -> Refit {
        Refit::of(&self.scaled[trial], self.loss, &(residual + &self.bend[trial]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::floor::Floor;
    use crate::plant::Nuisance;
    use crate::toy::Toy;

    const SAMPLES: usize = 200;

    /// A second Gauss–Newton step: along the line at 0 alone, the estimate would be 1.81.
    #[test]
    fn a_nuisance_that_is_not_linear_is_found_where_it_is() {
        let stretched = |i: usize, z: f64| 0.01 * i as f64 * (z + 0.2 * z * z);
        let measured = (0..SAMPLES).map(|i| stretched(i, 2.0));
        let mut toy = Toy::new(0.01, 0.01, measured, |i, point| stretched(i, point.nuisances[0]));
        toy.nuisances = vec![Nuisance { name: "stretch", unit: "1", sd: 1.0, effect: None }];
        toy.cheap = false;
        let floor = Floor::of(&toy);
        let problem = Problem::new(&toy, &floor, &crate::unwatched);
        let point = Point::nominal(&toy);
        let base = problem.residuals(&point).unwrap();
        let found = Nuisances::at(&problem, &point, &base).unwrap().refit(0, &base[0]).estimate[0];
        assert!((found - 2.0).abs() < 0.05, "{found}");
    }
}
