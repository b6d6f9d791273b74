//! The label of a case: which effects are really there.

use serde::{Deserialize, Serialize};

use crate::change::Truth;
use crate::draw::Kind;
use crate::nuisance::Spread;
use crate::strangers::{Electronics, MotionKind, RigTruth, Set};

/// What is strange about a case beside its effects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Strangeness {
    pub set: Set,
    /// Severity of each effect, adjusted to a gap that can be seen and is not all too large.
    #[serde(default)]
    pub severities: Vec<f64>,
    /// Family of the shape of each effect.
    pub families: Vec<String>,
    /// Each effect with its sizes, for whoever explains an answer.
    pub forms: Vec<String>,
    pub rig: RigTruth,
    pub motion: MotionKind,
    /// Trials, the withheld one among them.
    pub trials: usize,
    pub nuisances: Spread,
    pub sensors: Electronics,
}

impl Strangeness {
    /// Kinds that a score is split by, each with what it is a kind of.
    pub fn kinds(&self) -> Vec<(&'static str, String)> {
        let own = [
            ("nuisances", self.nuisances.name().to_owned()),
            ("motion", self.motion.name().to_owned()),
        ];
        let sensors = self.sensors.kinds().into_iter().map(|kind| ("sensors", kind.to_owned()));
        own.into_iter().chain(sensors).collect()
    }
}

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
    /// Of a stranger alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stranger: Option<Strangeness>,
    /// Random, so that the label cannot be found from its hash by trial.
    pub salt: String,
}
