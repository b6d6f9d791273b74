//! One candidate fitted to all trials: maximum a posteriori by damped Gauss–Newton steps.
//!
//! > minimise Σ_trials |r(θ, ν̂(θ))|² + Σ_p ((θ_p − off_p)/scale_p)²,   low ≤ θ ≤ high
//!
//! over the parameters of some effects, the nuisances refitted at every point. A fit starts
//! from the better of identity (the new effect off) and its switch-on values, so that it never
//! ends above the model that it extends; where no step helps, a compass search without
//! derivatives tries again.

use nalgebra::{DMatrix, DVector};

use crate::fitting::nuisance::Nuisances;
use crate::fitting::problem::{Coordinate, Problem};
use crate::fitting::refit::{Refit, telling};
use crate::fitting::search::{Effort, Found, Place, Search};
use crate::plant::{Plant, Point};

/// Where simulations cost nothing, and where they do.
const THOROUGH: Effort = Effort {
    steps: 20,
    converged: 1e-7,
    attempts: 4,
    compass: 12,
    exact: true,
    renewals: 0,
    rounds: 0,
};
const SPARING: Effort = Effort {
    steps: 8,
    converged: 2e-3,
    attempts: 2,
    compass: 4,
    exact: false,
    renewals: 1,
    rounds: 0,
};

/// Parameters from which on updated derivatives may lead astray.
const UPDATED_LONG: usize = 3;

/// How far a fit goes, where simulations cost something; where they do not, it goes to the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// Two steps on the trials that have most of the gap: enough to see who may win.
    Glance,
    /// As far as it pays to compare models.
    Whole,
    /// Until parameters and derivatives are those of the minimum.
    Polished,
}

impl Depth {
    fn effort(self, cheap: bool) -> Effort {
        match self {
            _ if cheap => THOROUGH,
            Self::Glance => Effort { steps: 2, compass: 0, renewals: 0, ..SPARING },
            Self::Whole => SPARING,
            Self::Polished => Effort { steps: 4, converged: 2e-4, rounds: 2, ..SPARING },
        }
    }
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

impl FitTrial {
    /// What the nuisances cost: their squares in standard deviations of their priors.
    pub fn penalty(&self) -> f64 {
        self.refit.residual.rows_range(self.raw.len()..).norm_squared()
    }
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
    /// The new effect's switch-on value that promised most, whether or not it led here.
    pub tried: Option<Point>,
    /// Whether the fit started above the model that it extends and never came below it.
    pub failed: bool,
}

/// Where a fit begins.
#[derive(Clone, Copy)]
pub enum Start<'a> {
    Point(&'a Point),
    /// Where another fit ended, which need not be simulated again.
    Fit(&'a Fit),
    /// Where another fit of the same parameters ended, with simulations that are corrected there:
    /// derivatives are those that it ended with.
    Corrected {
        fit: &'a Fit,
        point: &'a Point,
    },
}

impl Start<'_> {
    pub fn point(&self) -> &Point {
        match self {
            Self::Point(point) | Self::Corrected { point, .. } => point,
            Self::Fit(fit) => &fit.point,
        }
    }
}

/// Fits the parameters of `effects`, beginning at `start` and at the switch-on values of
/// `fresh` (one of `effects`). `None` when not even the start can be simulated.
///
/// See docs/explanation/diagnosis.md (D5).
pub fn fit(
    problem: &Problem<'_>,
    nuisances: &Nuisances,
    start: Start<'_>,
    effects: &[usize],
    fresh: Option<usize>,
    depth: Depth,
) -> Option<Fit> {
    let coordinates = problem.coordinates(effects);
    let mut effort = depth.effort(problem.plant.cheap());
    if coordinates.len() < UPDATED_LONG {
        effort.renewals = 0;
    }
    let search = Search {
        problem,
        nuisances,
        effort,
        coordinates,
        trials: (0..problem.plant.trials().len()).collect(),
    };
    let identity = match start {
        Start::Point(point) | Start::Corrected { point, .. } => search.place(point.clone())?,
        Start::Fit(fit) => {
            let raw = fit.trials.iter().map(|trial| trial.raw.clone()).collect();
            search.known(fit.point.clone(), raw)?
        }
    };
    let limit = identity.loss;
    let Found { place: best, jacobian, tried } = match start {
        Start::Corrected { fit, .. } => {
            let known = fit.trials.iter().map(|trial| trial.raw_jacobian.clone()).collect();
            let (place, jacobian) = search.descend_with(identity, known, false)?;
            Found { place, jacobian, tried: None }
        }
        _ if depth == Depth::Glance && !problem.plant.cheap() => glance(&search, identity, fresh)?,
        _ => search.begin(identity, fresh)?,
    };
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
        tried,
    })
}

/// Steps on the trials that tell most, and where they lead on all. Derivatives of the others are
/// left at 0: a parameter that is only glanced at counts as known there.
fn glance(search: &Search<'_>, identity: Place, fresh: Option<usize>) -> Option<Found> {
    let watched = telling(identity.refits.iter());
    let part =
        Search { trials: watched.clone(), coordinates: search.coordinates.clone(), ..*search };
    let raw = watched.iter().map(|&trial| identity.raw[trial].clone()).collect();
    let off = part.known(identity.point.clone(), raw)?;
    let Found { place: found, jacobian: derivatives, tried } = part.begin(off, fresh)?;
    let everywhere = search.place(found.point).filter(|place| place.loss < identity.loss);
    let better = everywhere.is_some();
    let place = everywhere.unwrap_or(identity);
    let mut jacobian: Vec<DMatrix<f64>> =
        place.raw.iter().map(|raw| DMatrix::zeros(raw.len(), search.coordinates.len())).collect();
    if better {
        for (trial, derivatives) in watched.into_iter().zip(derivatives) {
            jacobian[trial] = derivatives;
        }
    }
    Some(Found { place, jacobian, tried })
}

impl Fit {
    /// Whether it has derivatives in every trial: a glance leaves those of most trials out.
    pub fn is_whole(&self) -> bool {
        self.trials.iter().all(|trial| trial.raw_jacobian.iter().any(|x| *x != 0.0))
    }

    /// Whether a parameter ended at a bound where its effect is not off, or a nuisance at its limit: the effect has
    /// turned into a limit of itself, which usually is another effect, or there is another cause beside it.
    pub fn at_bound(&self, plant: &dyn Plant) -> bool {
        let is_at = |&effect: &usize| at_bound(plant, effect, &self.point);
        self.effects.iter().any(is_at) || !self.stretched().is_empty()
    }

    /// Nuisances, by index, that ended at the limit of their prior in most trials. What differs from run to run does
    /// not do that; a cause that the trials share does.
    pub fn stretched(&self) -> Vec<usize> {
        let all = self.trials.first().map_or(0, |own| own.refit.estimate.len());
        let is_at = |k: usize| {
            let at = self.trials.iter().filter(|own| own.refit.is_at_limit(k)).count();
            2 * at > self.trials.len()
        };
        (0..all).filter(|&k| is_at(k)).collect()
    }
}

/// The same of one effect at a point. A bound that is within one standard deviation of off limits a shape and
/// not a size: friction without presliding is Coulomb friction.
pub fn at_bound(plant: &dyn Plant, effect: usize, point: &Point) -> bool {
    plant.effects()[effect].parameters.iter().zip(&point.effects[effect]).any(|(p, &value)| {
        let margin = AT_BOUND_SD * p.scale;
        let is_at = |bound: f64| (value - bound).abs() <= margin && (bound - p.off).abs() > p.scale;
        is_at(p.low) || is_at(p.high)
    })
}

/// Nearer to a bound than this, in standard deviations of the prior, is at it.
const AT_BOUND_SD: f64 = 0.01;
