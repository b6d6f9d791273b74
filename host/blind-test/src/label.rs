//! The label of a case: which effects are really there.

use serde::{Deserialize, Serialize};

use crate::change::Truth;
use crate::draw::Kind;

/// What is true of a case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Label {
    pub case: String,
    /// Seed of the blind test.
    #[serde(default)]
    pub seed: u64,
    pub kind: Kind,
    pub rig: String,
    pub effects: Vec<Truth>,
    pub severity: f64,
    /// RMS of the change by all effects together with the noise, over the noise alone, in the channel
    /// that shows them best. 1 is invisible.
    pub gap_over_noise: f64,
    /// The same for what each effect adds to the others.
    #[serde(default)]
    pub added_over_noise: Vec<f64>,
    /// The same two over the floor: the noise, and the change by a wall that is nearer within its
    /// uncertainty. The first sets have neither.
    #[serde(default)]
    pub gap_over_floor: Option<f64>,
    #[serde(default)]
    pub added_over_floor: Vec<f64>,
    /// Random, so that the label cannot be found from its hash by trial.
    pub salt: String,
}
