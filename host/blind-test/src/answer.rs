//! One answer beside its label.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::draw::Kind;
use crate::figures::CONFIDENT;
use crate::label::Label;

/// One case in short.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    pub case: String,
    pub kind: Kind,
    pub rig: String,
    pub gap_over_noise: f64,
    pub added_over_noise: Vec<f64>,
    pub gap_over_floor: Option<f64>,
    pub added_over_floor: Vec<f64>,
    pub truth: Vec<String>,
    pub verdict: String,
    /// Probability of a cause outside the library; earlier answers state none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub none_of_mine: Option<f64>,
    pub named: Vec<String>,
    /// Named effects and what they cannot be told apart from.
    pub reported: BTreeSet<String>,
    pub confidence: Option<f64>,
    /// Effects that were named with [`CONFIDENT`] and are not there, nor anything that they are said
    /// not to be told apart from.
    pub confidently_wrong: Vec<String>,
    /// On the diagnosed trials, held out one by one; on the one that was not diagnosed.
    pub predicted_shrink: Option<f64>,
    pub achieved_shrink: Option<f64>,
    /// Whether the answer is what it should be: no gap, unknown, or every true effect.
    pub right: bool,
}

impl Answer {
    /// What was answered to a label.
    pub(crate) fn of(label: &Label, answer: &Value) -> Self {
        let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
        let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
        let effects = list(&answer["effects"]);
        let named: Vec<String> = effects.iter().map(|e| text(&e["id"])).collect();
        let confusable: Vec<Vec<String>> = list(&answer["confusable"])
            .iter()
            .map(|set| list(set).iter().map(text).collect())
            .collect();
        let not_told_apart = |id: &String| -> Vec<String> {
            confusable.iter().filter(|set| set.contains(id)).flatten().cloned().collect()
        };
        let mut reported: BTreeSet<String> = named.iter().cloned().collect();
        reported.extend(named.iter().flat_map(not_told_apart));
        let truth: Vec<String> = label.effects.iter().map(|effect| effect.id.clone()).collect();
        let is_wrong = |effect: &&Value| {
            let id = text(&effect["id"]);
            let is_sure = effect["confidence"].as_f64().is_some_and(|c| c >= CONFIDENT);
            is_sure
                && !truth.contains(&id)
                && !not_told_apart(&id).iter().any(|id| truth.contains(id))
        };
        let confidently_wrong =
            effects.iter().filter(is_wrong).map(|effect| text(&effect["id"])).collect();
        let mut own = Self {
            case: label.case.clone(),
            kind: label.kind,
            rig: label.rig.clone(),
            gap_over_noise: label.gap_over_noise,
            added_over_noise: label.added_over_noise.clone(),
            gap_over_floor: label.gap_over_floor,
            added_over_floor: label.added_over_floor.clone(),
            truth,
            verdict: text(&answer["verdict"]),
            none_of_mine: answer["none_of_mine"].as_f64(),
            confidence: answer["effects"][0]["confidence"].as_f64(),
            predicted_shrink: answer["predicted_shrink"].as_f64(),
            achieved_shrink: answer["achieved_shrink"].as_f64(),
            confidently_wrong,
            named,
            reported,
            right: false,
        };
        own.right = match own.kind {
            Kind::None => own.claims_no_gap(),
            Kind::Outside => own.verdict == "unknown",
            Kind::Single => own.first_is_true(),
            Kind::Pair => own.truth.iter().all(|id| own.reported.contains(id)),
        };
        own
    }

    /// By how much the predicted shrink missed the achieved one, of what was named as the whole or as a part.
    pub(crate) fn shrink_missed(&self) -> Option<f64> {
        let both = self.predicted_shrink.zip(self.achieved_shrink);
        let missed = |(predicted, achieved): (f64, f64)| (predicted - achieved).abs();
        both.filter(|_| !self.named.is_empty()).map(missed)
    }

    /// Whether nothing was found: also where the data would hardly have shown anything.
    pub(crate) fn claims_no_gap(&self) -> bool {
        ["no_gap", "inconclusive"].contains(&self.verdict.as_str())
    }

    /// Whether a cause outside the library is answered to be likely, or nothing was found to be named.
    pub(crate) fn blames_others(&self) -> bool {
        self.verdict == "unknown" || self.none_of_mine.is_some_and(|own| own > 0.5)
    }

    /// Whether the effect that is named first is there.
    pub(crate) fn first_is_true(&self) -> bool {
        self.named.first().is_some_and(|first| self.truth.contains(first))
    }

    /// Whether the effect that is named first is wrong, and was said with confidence.
    pub(crate) fn is_confidently_wrong(&self) -> bool {
        self.named.first().is_some_and(|first| self.confidently_wrong.contains(first))
    }
}
