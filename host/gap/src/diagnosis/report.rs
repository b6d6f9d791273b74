//! The answer, in the layout of the diagnosis format (`gap-diagnosis/2`).

use std::collections::BTreeMap;
use std::time::Instant;

use serde::Serialize;

pub use crate::deciding::detectable::Detectable;
pub use crate::deciding::form::Form;
pub use crate::deciding::interval::Estimate;
pub use crate::deciding::verdict::{Ranked, Verdict};
pub use crate::explaining::band::Band;
pub use crate::explaining::figures::{Figures, Gap};
pub use crate::explaining::locate::Cell;
pub use crate::explaining::map::Map;
pub use crate::explaining::on_vessel::{OnVessel, Square, VesselMap};
pub use crate::explaining::remainder::Left;
pub use crate::explaining::series::{HeldOut, Series};
pub use crate::explaining::snaps::{SnapFigures, SnapsOff};
pub use crate::planning::experiment::Experiment;
use crate::plant::{Parameter, Plant, Quantity};
pub use crate::rounding::quantity;
pub use crate::searching::selection::SetRow;

/// Name of the format.
pub const FORMAT: &str = "gap-diagnosis/2";

/// One effect of the explanation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NamedEffect {
    pub id: String,
    /// What it is, in a sentence.
    #[serde(skip)]
    pub what: &'static str,
    pub form: Option<Form>,
    pub parameters: BTreeMap<String, Estimate>,
    /// Calibrated probability that it is there; `None` for what was asked for, which had no rival.
    pub confidence: Option<f64>,
    /// Share of the held-out gap above the floor that it closed when it was added; those of all
    /// effects add up to the shrink of the explanation.
    pub shrink: f64,
    pub material: bool,
}

/// How to get the same answer again.
#[derive(Clone, Debug, PartialEq, Default, Serialize)]
pub struct Reproduce {
    pub command: String,
    pub version: String,
    pub bundle_sha256: String,
    /// Trials of the bundle that were left out.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub held_back: Vec<u32>,
}

/// The whole answer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Diagnosis {
    pub format: &'static str,
    pub bundle: String,
    pub verdict: Verdict,
    /// The answer in plain words: where, which, how far.
    pub sentence: String,
    /// The requested effects, if no others were tried.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub asked_for: Vec<String>,
    pub effects: Vec<NamedEffect>,
    pub confusable: Vec<Vec<String>>,
    pub ranking: Vec<Ranked>,
    pub gap: Gap,
    /// Numbers of the trials that `gap` is taken over. Each is held out in turn; of a single trial, its
    /// cycles are.
    pub held_out: Vec<u32>,
    #[serde(rename = "where")]
    pub places: Vec<Cell>,
    /// The gap that the best model leaves, if the verdict is partial or unknown.
    pub left: Option<Left>,
    pub next_experiment: Option<Experiment>,
    /// Error band of the forces of the model that is the answer, or of the nominal model if no effect is
    /// named. `None` if no force was measured.
    pub band: Option<Band>,
    /// Probability that a cause of the gap is in no family of the library.
    pub none_of_mine: f64,
    /// The smallest size of each effect that these trials would have shown with a probability of 90 %.
    pub detectable: Vec<Detectable>,
    /// Measured force, and what the nominal and the corrected model predict.
    pub series: Vec<Series>,
    /// Wall time \[s\].
    pub seconds: f64,
    /// Whether the search was ended before its time.
    pub cut: bool,
    pub reproduce: Reproduce,
    /// Conclusions that the data do not allow, or only with a reserve, and why.
    pub remarks: Vec<String>,
    #[serde(skip)]
    pub details: Details,
}

/// Details for a page and a terminal, which the JSON does not hold.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Details {
    /// What is compared with what.
    pub compared: String,
    /// Effects of each step of the selection, shrink and force RMS after it.
    pub path: Vec<PathStep>,
    /// How far each quantity is above its floor.
    pub energy: Vec<QuantityEnergy>,
    /// Each held-out trial: number, force RMS before and after.
    pub held_out: Vec<HeldOut>,
    /// Shrink of the best explanation, named or not.
    pub shrink: f64,
    /// Where and when the nominal model is off.
    pub maps: Vec<Map>,
    /// Where on the vessel it is.
    pub on_vessel: Option<OnVessel>,
    /// The same of what is left.
    pub left_on_vessel: Option<OnVessel>,
    /// Why effects that would have been an answer are not named.
    pub objection: Option<String>,
    /// Simulated trials.
    pub simulations: usize,
    /// Every set of effects that was fitted, from which the priors are learned.
    pub sets: Vec<SetRow>,
}

/// Mean squares over the floor's variance, held out: 1 is the floor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuantityEnergy {
    pub quantity: Quantity,
    pub before: f64,
    pub after: f64,
}

#[derive(Clone, Debug, PartialEq)]
pub struct PathStep {
    pub effects: Vec<String>,
    pub shrink: f64,
    pub force_rms_n: Option<f64>,
}

impl Diagnosis {
    /// An answer for this bundle, with nothing concluded yet.
    pub fn unanswered(bundle: &str) -> Self {
        Self {
            format: FORMAT,
            bundle: bundle.to_owned(),
            verdict: Verdict::Unknown,
            sentence: String::new(),
            asked_for: Vec::new(),
            effects: Vec::new(),
            confusable: Vec::new(),
            ranking: Vec::new(),
            gap: Gap::default(),
            held_out: Vec::new(),
            places: Vec::new(),
            left: None,
            next_experiment: None,
            band: None,
            none_of_mine: 0.0,
            detectable: Vec::new(),
            series: Vec::new(),
            seconds: 0.0,
            cut: false,
            reproduce: Reproduce::default(),
            remarks: Vec::new(),
            details: Details::default(),
        }
    }

    /// The same in plain words, with the time since a start.
    pub fn told(mut self, start: Instant) -> Self {
        self.seconds = start.elapsed().as_secs_f64();
        self.sentence = self.sentence();
        self
    }

    /// The trials that the figures of the gap are taken over, in words.
    pub fn held_out_trials(&self) -> String {
        let numbers: Vec<String> = self.held_out.iter().map(|n| format!("{n:03}")).collect();
        match numbers.as_slice() {
            [] => "nothing was held out".to_owned(),
            [only] => format!("trial {only}, its parts held out in turn"),
            _ => format!("trials {}, each held out in turn", numbers.join(", ")),
        }
    }

    /// Values of all parameters of the named effects, in the order of the plant.
    pub fn values(&self, plant: &dyn Plant) -> Vec<(String, Vec<f64>)> {
        let values = |named: &NamedEffect| {
            let effect = plant.effects().iter().find(|effect| effect.id == named.id)?;
            let value = |p: &Parameter| named.parameters.get(p.name).map_or(p.off, |own| own.value);
            Some((named.id.clone(), effect.parameters.iter().map(value).collect()))
        };
        self.effects.iter().filter_map(values).collect()
    }
}
