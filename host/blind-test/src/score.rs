//! Compares answers with labels: the score of a blind test.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::answer::Answer;
use crate::count::{Case, figures, named_in};
use crate::draw::Kind;
use crate::figures::{Counted, Figure};
use crate::label::Label;
use crate::parts::{Part, parts};
use crate::reliability::{Reliability, reliability};
use crate::rigs::rigs;

/// The format of a score, of `score.json` and of the files in `docs/reference/blind-tests/`.
pub const FORMAT: &str = "blind-test-score/1";

/// Where the rigs of a blind test come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Rigs {
    /// The four rigs of this crate.
    Own,
    /// Bundles that another simulator made (`make --bundle`).
    Given,
    /// Strangers (`make --strangers`).
    Strangers,
}

impl Rigs {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Own, Self::Given, Self::Strangers];
}

/// When and where the seal of a blind test was published, and the source of the program that answered.
/// A program does not know them; whoever scores states them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Published {
    /// Day on which the seal was published (YYYY-MM-DD).
    pub date: Option<String>,
    /// Commit that published the seal.
    pub sealed_in: Option<String>,
    /// Commit of the program that answered.
    pub program_commit: Option<String>,
}

/// All figures of a blind test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Score {
    pub format: String,
    #[serde(flatten)]
    pub published: Published,
    /// SHA-256 of the programs that answered.
    pub program_sha256: BTreeSet<String>,
    /// SHA-256 of `seals.json`, to be compared with what was published before the first answer.
    pub seals_sha256: Option<String>,
    /// What a reader must know of this set beside its figures.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    pub seeds: BTreeSet<u64>,
    pub rigs: Rigs,
    pub cases: usize,
    /// Cases with an effect whose gap is below [`crate::SMALLEST_GAP`] times the noise. They do not count.
    pub too_small: usize,
    pub figures: Vec<Figure>,
    /// Right answers by rig and kind.
    pub right: Vec<Right>,
    /// Of strangers, the same figures by the kind of nuisances, sensors and motions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<Part>,
    /// How often named effects are there, by confidence. Earlier sets have none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub reliability: Vec<Reliability>,
    /// Case by case: what was there, and what was answered. Published scores leave them out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub answers: Vec<Answer>,
}

/// Cases of one kind on one rig, and how many were answered right.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Right {
    pub rig: String,
    pub kind: Kind,
    pub right: usize,
    pub of: usize,
}

/// Scores revealed labels and the answers to them.
pub fn score(published: Published, seals_sha256: String, revealed: &[(Label, Value)]) -> Score {
    let answers: Vec<Answer> = revealed.iter().map(|(l, a)| Answer::of(l, a)).collect();
    let pairs = revealed.iter().zip(&answers);
    let cases: Vec<Case<'_>> = pairs.map(|(revealed, answer)| Case { revealed, answer }).collect();
    let counted: Vec<&Answer> =
        cases.iter().filter(|case| case.counts()).map(|case| case.answer).collect();
    let binary = |(_, a): &(Label, Value)| a["binary_sha256"].as_str().map(str::to_owned);
    let own = rigs();
    let is_own = |(label, _): &(Label, Value)| own.iter().any(|rig| rig.name == label.rig);
    Score {
        format: FORMAT.to_owned(),
        published,
        program_sha256: revealed.iter().filter_map(binary).collect(),
        seals_sha256: Some(seals_sha256),
        note: None,
        seeds: revealed.iter().map(|(label, _)| label.seed).collect(),
        rigs: if revealed.iter().any(|(label, _)| label.stranger.is_some()) {
            Rigs::Strangers
        } else if revealed.iter().all(is_own) {
            Rigs::Own
        } else {
            Rigs::Given
        },
        cases: answers.len(),
        too_small: answers.len() - counted.len(),
        figures: figures(&cases),
        right: by_rig(&counted),
        parts: parts(&cases),
        reliability: reliability(&named_in(&cases)),
        answers,
    }
}

fn by_rig(counted: &[&Answer]) -> Vec<Right> {
    let rigs: BTreeSet<&str> = counted.iter().map(|a| a.rig.as_str()).collect();
    let kinds = [Kind::Single, Kind::Pair, Kind::Outside, Kind::None];
    let cells = rigs.into_iter().flat_map(|rig| kinds.map(|kind| (rig, kind)));
    let cell = |(rig, kind): (&str, Kind)| {
        let own: Vec<_> = counted.iter().filter(|a| a.rig == rig && a.kind == kind).collect();
        let right = own.iter().filter(|a| a.right).count();
        Right { rig: rig.to_owned(), kind, right, of: own.len() }
    };
    cells.map(cell).collect()
}

impl Score {
    /// Its figure of this kind, if it was counted.
    pub fn figure(&self, counted: Counted) -> Option<&Figure> {
        self.figures.iter().find(|figure| figure.figure == counted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::change::Truth;
    use serde_json::json;

    fn label(kind: Kind, ids: &[&str], gap: f64) -> Label {
        let effect = |id: &&str| Truth {
            id: (*id).to_owned(),
            parameters: [("factor".to_owned(), 2.0)].into(),
        };
        Label {
            case: "000".into(),
            seed: 1,
            kind,
            rig: "r".into(),
            effects: ids.iter().map(effect).collect(),
            severity: 0.5,
            gap_over_noise: gap,
            added_over_noise: vec![gap; ids.len()],
            gap_over_floor: Some(0.8 * gap),
            added_over_floor: vec![0.8 * gap; ids.len()],
            stranger: None,
            salt: String::new(),
        }
    }

    fn named(id: &str, high: f64, confusable: Value) -> Value {
        json!({
            "verdict": "named",
            "effects": [{ "id": id, "confidence": 0.95,
                          "parameters": { "factor": { "low": 1.0, "high": high } } }],
            "confusable": confusable,
        })
    }

    fn value(score: &Score, counted: Counted) -> Option<f64> {
        score.figure(counted).unwrap().reached
    }

    fn scored(revealed: &[(Label, Value)]) -> Score {
        score(Published::default(), String::new(), revealed)
    }

    #[test]
    fn what_is_right_and_wrong_is_counted_where_it_belongs() {
        let mut hidden = label(Kind::Pair, &["a", "b"], 9.0);
        hidden.added_over_noise = vec![8.9, 1.2];
        let revealed = [
            (label(Kind::Single, &["a"], 3.0), named("a", 3.0, json!([]))),
            // Wrong first, but it said that it cannot tell.
            (label(Kind::Single, &["a"], 3.0), named("b", 3.0, json!([["b", "a"]]))),
            (label(Kind::Single, &["a"], 3.0), named("c", 3.0, json!([]))),
            (label(Kind::Single, &["a"], 3.0), named("a", 1.5, json!([]))),
            (label(Kind::Single, &["a"], 1.5), named("c", 3.0, json!([]))),
            (label(Kind::None, &[], 1.0), json!({ "verdict": "no_gap" })),
            (label(Kind::Outside, &["o"], 9.0), json!({ "verdict": "unknown" })),
            (label(Kind::Pair, &["a", "b"], 9.0), named("a", 9.0, json!([["a", "b"]]))),
            // The second effect is there, but nobody could see it beside the first.
            (hidden, named("a", 9.0, json!([]))),
        ];
        let score = scored(&revealed);
        assert_eq!((score.cases, score.too_small), (9, 1));
        assert_eq!(value(&score, Counted::NamedFirst), Some(50.0));
        assert_eq!(value(&score, Counted::InReportedSet), Some(75.0));
        assert_eq!(value(&score, Counted::ReportedSetSize), Some(1.25));
        let wrong = value(&score, Counted::ConfidentlyWrong).unwrap();
        assert!((wrong - 100.0 / 8.0).abs() < 1e-9);
        assert_eq!(value(&score, Counted::GapClaimedWithoutEffect), Some(0.0));
        assert_eq!(value(&score, Counted::PairFound), Some(50.0));
        assert_eq!(value(&score, Counted::PairFoundAboveNoise), Some(100.0));
        let held = value(&score, Counted::IntervalsHoldTruth).unwrap();
        assert_eq!(held, 75.0);
    }

    #[test]
    fn every_effect_that_is_named_with_confidence_and_is_not_there_is_wrong() {
        let effect = |id: &str| json!({ "id": id, "confidence": 0.97, "parameters": {} });
        let answer = |verdict: &str, ids: &[&str]| {
            let effects: Vec<Value> = ids.iter().map(|id| effect(id)).collect();
            json!({ "verdict": verdict, "effects": effects, "confusable": [["c", "a"]] })
        };
        let single = || label(Kind::Single, &["a"], 3.0);
        let revealed = [
            (single(), answer("named", &["a"])),
            // What it cannot be told apart from is there.
            (single(), answer("named", &["c"])),
            // The true effect is second, or is beside one that is not there.
            (single(), answer("named", &["b", "a"])),
            (single(), answer("named", &["a", "b"])),
            (label(Kind::Outside, &["o"], 9.0), answer("partial", &["b"])),
            (label(Kind::None, &[], 1.0), answer("no_gap", &[])),
        ];
        let score = scored(&revealed);
        let wrong: Vec<usize> = score.answers.iter().map(|a| a.confidently_wrong.len()).collect();
        assert_eq!(wrong, [0, 0, 1, 1, 1, 0]);
        let sixth = 100.0 / 6.0;
        assert!((value(&score, Counted::ConfidentlyWrong).unwrap() - 2.0 * sixth).abs() < 1e-9);
        assert!(
            (value(&score, Counted::AnyEffectConfidentlyWrong).unwrap() - 3.0 * sixth).abs() < 1e-9
        );
    }

    #[test]
    fn what_a_nearer_wall_may_do_as_well_counts_for_the_noise_alone() {
        let over = |kind, ids: &[&str], gap_over_floor| Label {
            gap_over_floor,
            added_over_floor: vec![gap_over_floor.unwrap_or_default(); ids.len()],
            ..label(kind, ids, 3.0)
        };
        let no_gap = || json!({ "verdict": "no_gap" });
        let revealed = [
            (over(Kind::Single, &["a"], Some(2.5)), named("a", 3.0, json!([]))),
            (over(Kind::Single, &["a"], Some(1.5)), no_gap()),
            // Of a set that was made before there was such a figure.
            (over(Kind::Single, &["a"], None), no_gap()),
            (over(Kind::Pair, &["a", "b"], Some(2.5)), named("a", 9.0, json!([["a", "b"]]))),
            (over(Kind::Pair, &["a", "b"], Some(1.5)), no_gap()),
        ];
        let score = scored(&revealed);
        let third = Some(100.0 / 3.0);
        assert_eq!(value(&score, Counted::NamedFirst), third);
        assert_eq!(value(&score, Counted::InReportedSet), third);
        assert_eq!(value(&score, Counted::PairFound), Some(50.0));
        for counted in [
            Counted::NamedFirstAboveFloor,
            Counted::InReportedSetAboveFloor,
            Counted::PairFoundAboveFloor,
        ] {
            assert_eq!(value(&score, counted), Some(100.0), "{counted:?}");
        }
    }
}
