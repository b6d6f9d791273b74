//! The result of the search: the chosen models, and those they were chosen over.

use nalgebra::DVector;

use crate::fitting::nuisance::Nuisances;
use crate::plant::Point;
use crate::scoring::candidate::Candidate;
use crate::scoring::score::Score;

/// A model that was refitted with another effect in the place of the chosen one.
#[derive(Clone, Debug)]
pub struct Rival {
    pub effect: usize,
    pub point: Point,
    pub score: Score,
}

impl Rival {
    pub fn of(effect: usize, candidate: &Candidate) -> Self {
        Self { effect, point: candidate.fit.point.clone(), score: candidate.score.clone() }
    }
}

/// An accepted effect, and what it was chosen over.
#[derive(Clone, Debug)]
pub struct Step {
    pub effect: usize,
    /// The model that it made.
    pub point: Point,
    pub score: Score,
    pub rivals: Vec<Rival>,
}

impl Step {
    pub fn of(effect: usize, candidate: &Candidate, rivals: Vec<Rival>) -> Self {
        let (point, score) = (candidate.fit.point.clone(), candidate.score.clone());
        Self { effect, point, score, rivals }
    }
}

/// What one effect does to the nominal model.
#[derive(Clone, Debug)]
pub struct Shown {
    pub point: Point,
    /// Change of the raw residuals, by trial.
    pub does: Vec<DVector<f64>>,
}

/// What selection found.
#[derive(Clone)]
pub struct Selection {
    pub nominal: Candidate,
    /// Every single effect, in the order of the library; `None` where the fit failed.
    pub singles: Vec<Option<Candidate>>,
    /// What each of them does; `None` where nothing is known.
    pub shown: Vec<Option<Shown>>,
    /// The best explanation; the nominal model when nothing pays.
    pub best: Candidate,
    /// How the explanation grew, for the report: effects and score after each step.
    pub path: Vec<(Vec<usize>, Score)>,
    pub steps: Vec<Step>,
    /// Effects whose fit failed.
    pub failed: Vec<usize>,
    /// Linearised at the best model.
    pub nuisances: Option<Nuisances>,
    /// The best model without each of its effects, where it has several.
    pub without: Vec<(usize, Candidate)>,
    /// Pairs that were fitted and not taken, as far as they were.
    pub pairs: Vec<Candidate>,
    /// The best model with one effect exchanged for another, and no better for it.
    pub exchanged: Vec<(usize, Rival)>,
    /// Effects of the models to which one more was tried to be added.
    pub extended: Vec<Vec<usize>>,
}
