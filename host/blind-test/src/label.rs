//! The label of a case: which effects are really there.

use serde::{Deserialize, Serialize};

use crate::change::Truth;
use crate::draw::Kind;

/// What is true of a case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Label {
    pub case: String,
    /// Of the blind test.
    #[serde(default)]
    pub seed: u64,
    pub kind: Kind,
    pub rig: String,
    pub effects: Vec<Truth>,
    pub severity: f64,
    /// RMS of what the effects change, with the noise, over the noise alone, in the channel that
    /// shows them best: 1 is invisible.
    pub gap_over_noise: f64,
    /// The same of every effect beside the others: of what it adds to them.
    #[serde(default)]
    pub added_over_noise: Vec<f64>,
    /// Both over the floor: the noise, and what a wall does that is nearer than anybody knows. Labels of seeds
    /// before 20000 have neither.
    #[serde(default)]
    pub gap_over_floor: Option<f64>,
    #[serde(default)]
    pub added_over_floor: Vec<f64>,
    /// Random, so that nobody finds the label by trying.
    pub salt: String,
}
