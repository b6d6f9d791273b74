//! One candidate fitted to all trials: maximum a posteriori by damped Gauss–Newton steps.
//!
//! > minimise Σ_trials |r(θ, ν̂(θ))|² + Σ_p ((θ_p − off_p)/scale_p)²,   low ≤ θ ≤ high
//!
//! over the parameters of some effects, the nuisances refitted at every point. A fit starts
//! from the better of identity (the new effect off) and its switch-on values, so that it never
//! ends above the model that it extends; where no step helps, a compass search without
//! derivatives tries again.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::nuisance::{Nuisances, Refit};
use crate::plant::{Plant, Point};
use crate::problem::{Coordinate, Problem};

/// How much a fit may cost.
#[derive(Clone, Copy, Debug)]
struct Effort {
    /// Gauss–Newton steps at most.
    steps: usize,
    /// A step that lowers the loss by less than this share ends the fit.
    converged: f64,
    /// Attempts at one step with ever more damping.
    attempts: usize,
    /// Points of one compass search.
    compass: usize,
}

/// Where simulations cost nothing, and where they do.
const THOROUGH: Effort = Effort { steps: 20, converged: 1e-7, attempts: 4, compass: 12 };
const SPARING: Effort = Effort { steps: 3, converged: 1e-2, attempts: 2, compass: 4 };

/// How far a fit goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// As far as it pays.
    Whole,
    /// One step, where simulations cost something: enough to see who may win.
    Glance,
}

/// One trial at the end of a fit.
#[derive(Clone, Debug)]
pub struct FitTrial {
    /// Whitened residuals (y − f)/σ with nuisances at 0.
    pub raw: DVector<f64>,
    pub refit: Refit,
    /// Derivatives of the raw residual, samples × parameters.
    pub raw_jacobian: DMatrix<f64>,
    /// The same of the refitted residual.
    pub jacobian: DMatrix<f64>,
}

/// A fitted model.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Effects that are on.
    pub effects: Vec<usize>,
    /// Their parameters, the columns of the derivatives.
    pub coordinates: Vec<Coordinate>,
    pub point: Point,
    pub trials: Vec<FitTrial>,
    /// What was minimised.
    pub loss: f64,
    /// Whether the fit started above the model that it extends and never came below it.
    pub failed: bool,
}

/// A point and what it costs.
struct Place {
    point: Point,
    raw: Vec<DVector<f64>>,
    refits: Vec<Refit>,
    loss: f64,
}

/// Fits the parameters of `effects`, starting from `start` and from the switch-on values of
/// `fresh` (one of `effects`). `None` when not even the start can be simulated.
pub fn fit(
    problem: &Problem<'_>,
    nuisances: &Nuisances,
    start: &Point,
    effects: &[usize],
    fresh: Option<usize>,
    depth: Depth,
) -> Option<Fit> {
    let effort = match (problem.plant.cheap(), depth) {
        (true, _) => THOROUGH,
        (false, Depth::Whole) => SPARING,
        (false, Depth::Glance) => Effort { steps: 1, compass: 0, ..SPARING },
    };
    let search = Search { problem, nuisances, effort, coordinates: problem.coordinates(effects) };
    let identity = search.place(start.clone())?;
    let limit = identity.loss;
    let mut best = identity;
    if let Some(point) = fresh.and_then(|effect| search.switched_on(&best, effect)) {
        best = search.place(point).filter(|place| place.loss < limit).unwrap_or(best);
    }
    let (best, jacobian) = search.descend(best)?;
    let trials = best.raw.into_iter().zip(best.refits).zip(jacobian);
    let trials = trials.map(|((raw, refit), raw_jacobian)| {
        let jacobian = refit.project(&raw_jacobian);
        FitTrial { raw, refit, raw_jacobian, jacobian }
    });
    Some(Fit {
        effects: effects.to_vec(),
        failed: best.loss > limit,
        trials: trials.collect(),
        coordinates: search.coordinates,
        point: best.point,
        loss: best.loss,
    })
}

/// What became of a step.
enum Step {
    Better(Box<Place>),
    /// To first order there is nothing to gain.
    Flat,
    /// There should be, but no step got it.
    Stuck,
}

impl Fit {
    /// Whether a parameter ended at a bound where its effect is not off: the effect has turned
    /// into a limit of itself, which usually is another effect.
    pub fn at_bound(&self, plant: &dyn Plant) -> bool {
        self.coordinates.iter().any(|coordinate| match *coordinate {
            Coordinate::Effect { effect, parameter } => {
                let p = &plant.effects()[effect].parameters[parameter];
                let value = self.point.effects[effect][parameter];
                let margin = AT_BOUND_SD * p.scale;
                value != p.off && (value <= p.low + margin || value >= p.high - margin)
            }
            Coordinate::Nuisance(_) => false,
        })
    }
}

/// Nearer to a bound than this, in standard deviations of the prior, is at it.
const AT_BOUND_SD: f64 = 0.01;

struct Search<'a> {
    problem: &'a Problem<'a>,
    nuisances: &'a Nuisances,
    effort: Effort,
    coordinates: Vec<Coordinate>,
}

impl Search<'_> {
    fn place(&self, point: Point) -> Option<Place> {
        let raw = self.problem.residuals(&point)?;
        let refits: Vec<Refit> =
            raw.iter().enumerate().map(|(trial, r)| self.nuisances.refit(trial, r)).collect();
        let loss = refits.iter().map(Refit::energy).sum::<f64>() + self.prior(&point);
        loss.is_finite().then_some(Place { point, raw, refits, loss })
    }

    /// The best of the effect's switch-on values, if any is better than where the fit is. Where
    /// simulations cost something, every other trial decides.
    fn switched_on(&self, off: &Place, effect: usize) -> Option<Point> {
        let every = if self.problem.plant.cheap() { 1 } else { 2 };
        let trials: Vec<usize> = (0..off.refits.len()).step_by(every).collect();
        let loss_off = trials.iter().map(|&t| off.refits[t].energy()).sum::<f64>();
        let loss = |point: &Point| -> Option<f64> {
            let one = |&trial: &usize| {
                let raw = self.problem.residual(trial, point)?;
                Some(self.nuisances.refit(trial, &raw).energy())
            };
            let losses: Option<Vec<f64>> = trials.par_iter().map(one).collect();
            Some(losses?.into_iter().sum::<f64>() + self.prior(point))
        };
        let mut best = (loss_off + self.prior(&off.point), None);
        for values in &self.problem.plant.effects()[effect].starts {
            let mut point = off.point.clone();
            point.effects[effect].clone_from(values);
            match loss(&point) {
                Some(loss) if loss < best.0 => best = (loss, Some(point)),
                _ => {}
            }
        }
        best.1
    }

    fn prior(&self, point: &Point) -> f64 {
        self.deviations(point).norm_squared()
    }

    /// (θ − off)/scale of every coordinate.
    fn deviations(&self, point: &Point) -> DVector<f64> {
        let of = |&coordinate: &Coordinate| match coordinate {
            Coordinate::Effect { effect, parameter } => {
                let p = self.problem.parameter(effect, parameter);
                (point.effects[effect][parameter] - p.off) / p.scale
            }
            Coordinate::Nuisance(_) => 0.0,
        };
        DVector::from_iterator(self.coordinates.len(), self.coordinates.iter().map(of))
    }

    /// Steps down from `place`; gives the end and the raw derivatives there.
    fn descend(&self, mut place: Place) -> Option<(Place, Vec<DMatrix<f64>>)> {
        let jacobian_at =
            |p: &Place| self.problem.sensitivities(&p.point, &p.raw, &self.coordinates);
        let mut jacobian = jacobian_at(&place)?;
        if self.coordinates.is_empty() {
            return Some((place, jacobian));
        }
        let (mut damping, mut searched) = (1e-4, false);
        for _ in 0..self.effort.steps {
            let before = place.loss;
            match self.step(&place, &jacobian, &mut damping) {
                Step::Better(better) => place = *better,
                Step::Flat => break,
                Step::Stuck if searched => break,
                Step::Stuck => {
                    searched = true;
                    let Some(better) = self.compass(&place) else { break };
                    place = better;
                }
            }
            jacobian = jacobian_at(&place)?;
            if before - place.loss < self.effort.converged * before {
                break;
            }
        }
        Some((place, jacobian))
    }

    /// One damped Gauss–Newton step.
    fn step(&self, place: &Place, jacobian: &[DMatrix<f64>], damping: &mut f64) -> Step {
        let k = self.coordinates.len();
        // In units of the priors, so that damping means the same for every parameter.
        let scales = self.scales();
        let mut normal = DMatrix::identity(k, k);
        let mut gradient = self.deviations(&place.point);
        for (refit, jacobian) in place.refits.iter().zip(jacobian) {
            let mut j = refit.project(jacobian);
            for (mut column, scale) in j.column_iter_mut().zip(scales.iter()) {
                column *= *scale;
            }
            normal += j.tr_mul(&j);
            gradient += j.tr_mul(&refit.residual);
        }
        let free = self.free(&place.point, &gradient);
        let slope = gradient.select_rows(&free);
        for _ in 0..self.effort.attempts {
            let mut damped = normal.clone();
            for i in 0..k {
                damped[(i, i)] *= 1.0 + *damping;
            }
            let reduced = damped.select_columns(&free).select_rows(&free);
            let Some(step) = reduced.cholesky().map(|c| c.solve(&-&slope)) else {
                return Step::Stuck;
            };
            if -slope.dot(&step) < self.effort.converged * place.loss {
                return Step::Flat;
            }
            let mut point = place.point.clone();
            for (&i, step) in free.iter().zip(step.iter()) {
                self.add(&mut point, i, step * scales[i]);
            }
            if let Some(better) = self.place(point).filter(|p| p.loss < place.loss) {
                *damping = (*damping * 0.1).max(1e-9);
                return Step::Better(Box::new(better));
            }
            *damping = (*damping * 100.0).max(1e-2);
        }
        Step::Stuck
    }

    fn scales(&self) -> Vec<f64> {
        let of = |&coordinate: &Coordinate| match coordinate {
            Coordinate::Effect { effect, parameter } => {
                self.problem.parameter(effect, parameter).scale
            }
            Coordinate::Nuisance(nuisance) => self.problem.plant.nuisances()[nuisance].sd,
        };
        self.coordinates.iter().map(of).collect()
    }

    /// Coordinates that are not held by a bound against the descent.
    fn free(&self, point: &Point, gradient: &DVector<f64>) -> Vec<usize> {
        let held = |&i: &usize| match self.coordinates[i] {
            Coordinate::Effect { effect, parameter } => {
                let p = self.problem.parameter(effect, parameter);
                let value = point.effects[effect][parameter];
                (value <= p.low && gradient[i] > 0.0) || (value >= p.high && gradient[i] < 0.0)
            }
            Coordinate::Nuisance(_) => false,
        };
        (0..self.coordinates.len()).filter(|i| !held(i)).collect()
    }

    fn add(&self, point: &mut Point, coordinate: usize, step: f64) {
        if let Coordinate::Effect { effect, parameter } = self.coordinates[coordinate] {
            let p = self.problem.parameter(effect, parameter);
            let value = &mut point.effects[effect][parameter];
            *value = (*value + step).clamp(p.low, p.high);
        }
    }

    /// Steps along the axes, halved when none helps.
    fn compass(&self, place: &Place) -> Option<Place> {
        let scales = self.scales();
        let mut best: Option<Place> = None;
        let (mut size, mut points) = (0.5, 0);
        while points < self.effort.compass {
            let from = best.as_ref().unwrap_or(place);
            let mut found = None;
            for (i, scale) in scales.iter().enumerate() {
                for sign in [1.0, -1.0] {
                    let mut point = from.point.clone();
                    self.add(&mut point, i, sign * size * scale);
                    if point == from.point {
                        continue;
                    }
                    points += 1;
                    let limit = found.as_ref().map_or(from.loss, |p: &Place| p.loss);
                    found = self.place(point).filter(|p| p.loss < limit).or(found);
                }
            }
            match found {
                Some(better) => best = Some(better),
                None if size > 0.02 => size *= 0.4,
                None => break,
            }
        }
        best
    }
}
