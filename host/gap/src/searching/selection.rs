//! The result of the search: the sets of effects that were fitted, and the best one of them.

use serde::Serialize;

use crate::deciding::detectable::Detectable;
use crate::deciding::posterior::Posterior;
use crate::fitting::nuisance::Nuisances;
use crate::scoring::candidate::Candidate;
use crate::scoring::score::Score;

/// A set that was fitted, as the priors are learned from it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SetRow {
    pub effects: Vec<&'static str>,
    /// Share of the gap above the floor that it closes.
    pub shrink: f64,
    /// Energy of the quantity that is farthest above its floor.
    pub worst: f64,
    pub at_bound: bool,
    /// Whether a channel scatters far more than its sensor is said to.
    pub is_beyond_stated: bool,
    /// Of each trial, over all channels.
    pub bins: Vec<usize>,
    pub channels: usize,
    /// a, κ, ω and ln p of each trial, of every choice of the amplitudes.
    pub cells: Vec<Vec<f64>>,
}

/// What the search found.
#[derive(Clone)]
pub struct Selection {
    pub nominal: Candidate,
    /// Every single effect, in the order of the library; `None` where the fit failed.
    pub singles: Vec<Option<Candidate>>,
    /// The most probable set of effects, fitted to the end; the nominal model if that is the empty set.
    pub best: Candidate,
    /// Linearised at the best model.
    pub nuisances: Option<Nuisances>,
    /// How probable each set is that was fitted; nothing where effects were requested.
    pub posterior: Posterior,
    /// How the best set grows, for the report: effects and score of each step.
    pub path: Vec<(Vec<usize>, Score)>,
    /// The best model without each of its effects, where it has several.
    pub without: Vec<(usize, Candidate)>,
    /// Effects whose fit failed.
    pub failed: Vec<usize>,
    /// What would have been seen of each effect.
    pub detectable: Vec<Detectable>,
    /// Every set that was fitted.
    pub sets: Vec<SetRow>,
}
