//! The answer, in the layout of the diagnosis format (`gap-diagnosis/1`).

use std::collections::BTreeMap;

use serde::Serialize;

pub use crate::deciding::verdict::{Ranked, Verdict};
pub use crate::explaining::band::Band;
pub use crate::explaining::estimate::Estimate;
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
use crate::rounding::{from_to, percent};

/// Name of the format.
pub const FORMAT: &str = "gap-diagnosis/1";

/// One effect of the explanation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NamedEffect {
    pub id: String,
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
    /// Measured, nominal and best prediction of the force channels of one trial.
    pub series: Vec<Series>,
    /// Where and when the nominal model is off.
    pub maps: Vec<Map>,
    /// Where on the vessel it is.
    pub on_vessel: Option<OnVessel>,
    /// The same of what is left.
    pub left_on_vessel: Option<OnVessel>,
    /// Simulated trials.
    pub simulations: usize,
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
            reproduce: Reproduce::default(),
            remarks: Vec::new(),
            details: Details::default(),
        }
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

    /// An effect together with those that this data cannot tell apart from it.
    fn or_its_like(&self, id: &str) -> String {
        let set = self.confusable.iter().find(|set| set.first().is_some_and(|first| first == id));
        match set.and_then(|set| set.get(1..)).filter(|others| !others.is_empty()) {
            Some(others) => format!("{id} (or {})", others.join(", ")),
            None => id.to_owned(),
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

    /// The verdict in one sentence.
    pub fn sentence(&self) -> String {
        let names = |only_material: bool| {
            let wanted = self.effects.iter().filter(|e| e.material || !only_material);
            let ids: Vec<String> = wanted.map(|e| self.or_its_like(&e.id)).collect();
            match ids.split_last() {
                Some((last, [])) => last.clone(),
                Some((last, others)) => format!("{} and {last}", others.join(", ")),
                None => String::new(),
            }
        };
        let figures = self.gap.force_rms_n.map_or(String::new(), |f| {
            format!(
                ": from {} RMS on data that the fit had not seen",
                from_to(f.before, f.after, "N")
            )
        });
        match self.verdict {
            Verdict::NoGap if self.gap.force_rms_n.is_none() => {
                "No gap in the measured channels: the nominal model explains them to the floor. No \
                 force was measured."
                    .to_owned()
            }
            Verdict::NoGap => {
                "No gap: the nominal model explains the data to the floor.".to_owned()
            }
            Verdict::Named => {
                let share = percent(self.details.shrink);
                format!("{} closes {share} of the gap{figures}.", names(true)).replacen(
                    " closes",
                    if self.effects.len() > 1 { " close" } else { " closes" },
                    1,
                )
            }
            Verdict::Partial => format!(
                "{} explains only {} of the gap{figures}; no known effect explains the rest.",
                names(false),
                percent(self.details.shrink)
            ),
            // Why stands first among the remarks.
            Verdict::Unknown if self.ranking.is_empty() => {
                let why = self.remarks.first().map_or(String::new(), |why| format!(": {why}"));
                format!("Nothing can be concluded from this data{why}.")
            }
            Verdict::Unknown if !self.asked_for.is_empty() => format!(
                "There is a gap, and the requested effects, {}, do not explain it well enough to be \
                 named: together they close {}. No other effect was tried.",
                self.asked_for.join(" and "),
                percent(self.details.shrink)
            ),
            Verdict::Unknown => {
                let nearest = self.ranking.first().filter(|nearest| nearest.shrink > 0.0);
                let nearest = nearest.map_or_else(String::new, |nearest| {
                    format!(
                        ": the best single effect, {}, closes {}",
                        nearest.id,
                        percent(nearest.shrink)
                    )
                });
                format!(
                    "There is a gap, and none of the known effects explains it well enough to be \
                     named{nearest}."
                )
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_gap_without_a_force_says_that_none_was_measured() {
        let sentence = |force_rms_n| {
            let mut answer =
                Diagnosis { verdict: Verdict::NoGap, ..Diagnosis::unanswered("trials") };
            answer.gap.force_rms_n = force_rms_n;
            answer.sentence()
        };
        assert!(sentence(None).contains("No force was measured"));
        let measured = sentence(Some(Figures { before: 0.01, after: 0.01, floor: 0.01 }));
        assert!(!measured.contains("No force"), "{measured}");
    }

    #[test]
    fn a_gap_that_nothing_explains_is_answered_with_what_is_nearest() {
        let sentence = |ranking: &[(&str, f64)]| {
            let of = |(id, shrink): &(&str, f64)| Ranked { id: (*id).to_owned(), shrink: *shrink };
            let answer = Diagnosis {
                ranking: ranking.iter().map(of).collect(),
                ..Diagnosis::unanswered("trials")
            };
            answer.sentence()
        };
        let near = sentence(&[("wall.motion", 0.71), ("drive.slip", 0.1)]);
        assert!(
            near.ends_with("to be named: the best single effect, wall.motion, closes 71 %."),
            "{near}"
        );
        // An effect that closes nothing is not mentioned.
        let none = sentence(&[("wall.motion", -0.2)]);
        assert!(none.ends_with("well enough to be named."), "{none}");
        assert!(sentence(&[]).contains("Nothing can be concluded"));
    }
}
