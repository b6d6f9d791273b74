//! One candidate fitted to all trials: maximum a posteriori by damped Gauss–Newton steps.
//!
//! > minimise Σ_trials |r(θ, ν̂(θ))|² + Σ_p ((θ_p − off_p)/scale_p)²,   low ≤ θ ≤ high
//!
//! over the parameters of some effects, the nuisances refitted at every point. A fit starts
//! from the better of identity (the new effect off) and its switch-on values, so that it never
//! ends above the model that it extends; where no step helps, a compass search without
//! derivatives tries again.

use nalgebra::{DMatrix, DVector};

use crate::nuisance::{Nuisances, Refit};
use crate::plant::Point;
use crate::problem::{Coordinate, Problem};

/// Gauss–Newton steps at most.
const STEPS: usize = 12;
/// A step that lowers the loss by less than this share ends the fit.
const CONVERGED: f64 = 1e-4;
/// Attempts at one step with ever more damping.
const ATTEMPTS: usize = 4;
/// Points of one compass search.
const COMPASS_POINTS: usize = 12;

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
) -> Option<Fit> {
    let search = Search { problem, nuisances, coordinates: problem.coordinates(effects) };
    let identity = search.place(start.clone())?;
    let limit = identity.loss;
    let mut best = identity;
    if let Some(effect) = fresh {
        for values in &problem.plant.effects()[effect].starts {
            let mut point = start.clone();
            point.effects[effect].clone_from(values);
            match search.place(point) {
                Some(place) if place.loss < best.loss => best = place,
                _ => {}
            }
        }
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

struct Search<'a> {
    problem: &'a Problem<'a>,
    nuisances: &'a Nuisances,
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
        for _ in 0..STEPS {
            let before = place.loss;
            match self.step(&place, &jacobian, &mut damping) {
                Some(better) => place = better,
                None if !searched => {
                    searched = true;
                    match self.compass(&place) {
                        Some(better) => place = better,
                        None => break,
                    }
                }
                None => break,
            }
            jacobian = jacobian_at(&place)?;
            if before - place.loss < CONVERGED * before {
                break;
            }
        }
        Some((place, jacobian))
    }

    /// One damped Gauss–Newton step that lowers the loss.
    fn step(&self, place: &Place, jacobian: &[DMatrix<f64>], damping: &mut f64) -> Option<Place> {
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
        for _ in 0..ATTEMPTS {
            let free = self.free(&place.point, &gradient);
            let mut damped = normal.clone();
            for i in 0..k {
                damped[(i, i)] *= 1.0 + *damping;
            }
            let reduced = damped.select_columns(&free).select_rows(&free);
            let step = reduced.cholesky()?.solve(&-gradient.select_rows(&free));
            let mut point = place.point.clone();
            for (&i, step) in free.iter().zip(step.iter()) {
                self.add(&mut point, i, step * scales[i]);
            }
            if let Some(better) = self.place(point).filter(|p| p.loss < place.loss) {
                *damping = (*damping * 0.1).max(1e-9);
                return Some(better);
            }
            *damping = (*damping * 100.0).max(1e-3);
        }
        None
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
        while points < COMPASS_POINTS {
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
