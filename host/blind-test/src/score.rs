//! Answers against labels: the figures of a blind check.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use serde::Serialize;
use serde_json::Value;

use crate::draw::Kind;
use crate::seal::Label;

/// A gap counts from so many times the noise on.
pub const SMALLEST_GAP: f64 = 2.0;
/// A wrong answer with at least this confidence is confidently wrong.
pub const CONFIDENT: f64 = 0.8;
/// Of wrong answers, whichever of the effects is the wrong one.
const ANY_CONFIDENTLY_WRONG: &str = "the same, of any effect that is named";
/// Of figures of what anybody could see in spite of what nobody knows about a wall.
const FIRST_OVER_FLOOR: &str = "named first, where the gap is twice the floor";
const IN_SET_OVER_FLOOR: &str = "in the reported set, where the gap is twice the floor";
/// Of the figure of pairs that anybody could see both effects of.
const PAIRS_THAT_SHOW: &str = "the same, where each adds a gap of twice the noise to the other";
const PAIRS_OVER_FLOOR: &str = "both found, where each adds a gap of twice the floor to the other";
/// Predicted and achieved shrink may differ by so much.
const WITHIN: f64 = 0.1;

/// One figure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tally {
    pub figure: &'static str,
    pub target: &'static str,
    /// In percent where `unit` says so.
    pub value: Option<f64>,
    pub unit: &'static str,
    /// Cases, or parameters, that it is taken over.
    pub of: usize,
    /// Of a share: where it lies with a probability of 95 %, in percent (Wilson 1927).
    pub between: Option<[f64; 2]>,
}

/// All figures of a challenge.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Score {
    pub cases: usize,
    /// Of them, those with an effect whose gap is too small to be asked for.
    pub too_small: usize,
    pub tallies: Vec<Tally>,
    /// Case, what was there, what was answered.
    pub answers: Vec<Answer>,
    pub seeds: BTreeSet<u64>,
    /// SHA-256 of `seals.json`, to be compared with what was published before the first answer.
    pub seals_sha256: String,
    /// By rig and kind.
    pub rigs: Vec<Right>,
    /// SHA-256 of the programs that answered.
    pub binaries: BTreeSet<String>,
}

/// One case in short.
#[derive(Clone, Debug, PartialEq, Serialize)]
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

/// Cases of one kind on one rig, and how many were answered right.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Right {
    pub rig: String,
    pub kind: Kind,
    pub right: usize,
    pub of: usize,
}

impl Answer {
    fn of(label: &Label, answer: &Value) -> Self {
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
            confidence: answer["effects"][0]["confidence"].as_f64(),
            predicted_shrink: answer["predicted_shrink"].as_f64(),
            achieved_shrink: answer["achieved_shrink"].as_f64(),
            confidently_wrong,
            named,
            reported,
            right: false,
        };
        own.right = match own.kind {
            Kind::None => own.verdict == "no_gap",
            Kind::Outside => own.verdict == "unknown",
            Kind::Single => own.first_is_true(),
            Kind::Pair => own.truth.iter().all(|id| own.reported.contains(id)),
        };
        own
    }

    /// Of what was named, as the whole or as a part.
    fn shrink_missed(&self) -> Option<f64> {
        let both = self.predicted_shrink.zip(self.achieved_shrink);
        let missed = |(predicted, achieved): (f64, f64)| (predicted - achieved).abs();
        both.filter(|_| !self.named.is_empty()).map(missed)
    }

    fn first_is_true(&self) -> bool {
        self.named.first().is_some_and(|first| self.truth.contains(first))
    }

    /// Whether the effect that is named first is wrong, and was said with confidence.
    fn is_confidently_wrong(&self) -> bool {
        self.named.first().is_some_and(|first| self.confidently_wrong.contains(first))
    }
}

/// Scores revealed labels and the answers to them.
pub fn score(seals_sha256: String, revealed: &[(Label, Value)]) -> Score {
    let answers: Vec<Answer> = revealed.iter().map(|(l, a)| Answer::of(l, a)).collect();
    let large = |a: &&Answer| a.kind == Kind::None || a.gap_over_noise >= SMALLEST_GAP;
    let counted: Vec<&Answer> = answers.iter().filter(large).collect();
    let of = |kind: Kind| -> Vec<&Answer> {
        counted.iter().copied().filter(|a| a.kind == kind).collect()
    };
    let (single, pair) = (of(Kind::Single), of(Kind::Pair));
    let both_show = |a: &&Answer| {
        !a.added_over_noise.is_empty() && a.added_over_noise.iter().all(|gap| *gap >= SMALLEST_GAP)
    };
    let pair_that_shows: Vec<&Answer> = pair.iter().copied().filter(both_show).collect();
    let over_floor = |a: &&Answer| a.gap_over_floor.is_some_and(|gap| gap >= SMALLEST_GAP);
    let single_over_floor: Vec<&Answer> = single.iter().copied().filter(over_floor).collect();
    let both_over =
        |a: &&Answer| over_floor(a) && a.added_over_floor.iter().all(|gap| *gap >= SMALLEST_GAP);
    let pair_over_floor: Vec<&Answer> = pair.iter().copied().filter(both_over).collect();
    let (outside, none) = (of(Kind::Outside), of(Kind::None));
    let counted_answers =
        || revealed.iter().zip(&answers).filter(|(_, a)| large(a)).map(|(r, _)| r);
    let share = |figure, target, among: &[&Answer], hit: &dyn Fn(&Answer) -> bool| {
        Tally::share(figure, target, among.iter().map(|a| hit(a)))
    };
    let all_in = |a: &Answer| a.truth.iter().all(|id| a.reported.contains(id));
    let sizes: Vec<f64> =
        single.iter().filter(|a| !a.reported.is_empty()).map(|a| a.reported.len() as f64).collect();
    let inside = intervals(counted_answers());
    let numbers = |figure, target, unit, values: Vec<f64>| Tally {
        figure,
        target,
        value: mean(values.iter().copied()),
        unit,
        of: values.len(),
        between: None,
    };
    let found = |key: &str| revealed.iter().filter_map(|(_, a)| a[key].as_f64()).collect();
    let misses: Vec<f64> = counted.iter().filter_map(|a| a.shrink_missed()).collect();
    let within = misses.iter().map(|miss| *miss <= WITHIN);
    let named: Vec<(f64, bool)> = counted_answers().flat_map(|(l, a)| named(l, a)).collect();
    let confidences = named.iter().map(|(confidence, _)| 100.0 * confidence).collect();
    let there = named.iter().map(|(_, there)| *there);
    let tallies = vec![
        share("the true effect is named first", "≥ 90 %", &single, &Answer::first_is_true),
        share(FIRST_OVER_FLOOR, "≥ 90 %", &single_over_floor, &Answer::first_is_true),
        share("the true effect is in the reported set", "≥ 97 %", &single, &all_in),
        share(IN_SET_OVER_FLOOR, "≥ 97 %", &single_over_floor, &all_in),
        numbers("mean size of that set", "≤ 1.5", "", sizes),
        share("confidently wrong", "≤ 2 %", &counted, &Answer::is_confidently_wrong),
        share(ANY_CONFIDENTLY_WRONG, "", &counted, &|a| !a.confidently_wrong.is_empty()),
        share("out-of-library effects answered \"none of mine\"", "≥ 90 %", &outside, &|a| {
            a.verdict == "unknown"
        }),
        share("a gap claimed where there is none", "≤ 2 %", &none, &|a| a.verdict != "no_gap"),
        share("both of two effects found", "≥ 80 %", &pair, &all_in),
        share(PAIRS_THAT_SHOW, "", &pair_that_shows, &all_in),
        share(PAIRS_OVER_FLOOR, "≥ 80 %", &pair_over_floor, &all_in),
        numbers(
            "mean difference of predicted and achieved shrink on a trial that was not diagnosed",
            "≤ 10 points",
            "points",
            misses.iter().map(|miss| 100.0 * miss).collect(),
        ),
        Tally::share("the same, cases within 10 points", "", within),
        Tally::share(
            "90 % parameter intervals that hold the truth",
            "85–95 %",
            inside.iter().copied(),
        ),
        numbers("mean confidence of named effects", "as often as there", "%", confidences),
        Tally::share("named effects that are there", "", there),
        numbers("mean processor time of a diagnosis", "", "s", found("cpu_seconds")),
    ];
    let binary = |(_, a): &(Label, Value)| a["binary_sha256"].as_str().map(str::to_owned);
    Score {
        cases: answers.len(),
        too_small: answers.len() - counted.len(),
        tallies,
        seals_sha256,
        seeds: revealed.iter().map(|(label, _)| label.seed).collect(),
        rigs: by_rig(&counted),
        binaries: revealed.iter().filter_map(binary).collect(),
        answers,
    }
}

impl Tally {
    fn share(figure: &'static str, target: &'static str, hits: impl Iterator<Item = bool>) -> Self {
        let hits: Vec<bool> = hits.collect();
        let (of, hit) = (hits.len(), hits.iter().filter(|hit| **hit).count());
        let value = (of > 0).then(|| 100.0 * hit as f64 / of as f64);
        Self { figure, target, value, unit: "%", of, between: wilson(hit, of) }
    }
}

/// Where a share lies with a probability of 95 %, in percent (Wilson 1927).
fn wilson(hit: usize, of: usize) -> Option<[f64; 2]> {
    const Z: f64 = 1.96;
    let (n, share) = (of as f64, hit as f64 / of as f64);
    let centre = share + Z * Z / (2.0 * n);
    let half = Z * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
    let edge = |x: f64| 100.0 * (x / (1.0 + Z * Z / n)).clamp(0.0, 1.0);
    (of > 0).then(|| [edge(centre - half), edge(centre + half)])
}

/// Confidence of every named effect, and whether it is there.
fn named(label: &Label, answer: &Value) -> Vec<(f64, bool)> {
    let effects = answer["effects"].as_array();
    let own = effects.into_iter().flatten().filter_map(|effect| {
        let there = label.effects.iter().any(|truth| effect["id"] == truth.id.as_str());
        Some((effect["confidence"].as_f64()?, there))
    });
    own.collect()
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

/// Of every parameter with a counterpart in a true effect that was named, whether its interval
/// holds the truth.
fn intervals<'a>(revealed: impl Iterator<Item = &'a (Label, Value)>) -> Vec<bool> {
    let mut inside = Vec::new();
    for (label, answer) in revealed {
        let named = answer["effects"].as_array();
        for effect in named.into_iter().flatten() {
            let truth = label.effects.iter().find(|truth| effect["id"] == truth.id.as_str());
            for (name, value) in truth.into_iter().flat_map(|truth| &truth.parameters) {
                let estimate = &effect["parameters"][name];
                if let (Some(low), Some(high)) =
                    (estimate["low"].as_f64(), estimate["high"].as_f64())
                {
                    inside.push(low <= *value && *value <= high);
                }
            }
        }
    }
    inside
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (count, sum) = values.fold((0, 0.0), |(count, sum), value| (count + 1, sum + value));
    (count > 0).then(|| sum / f64::from(count))
}

impl Score {
    /// All figures in Markdown.
    pub fn markdown(&self) -> String {
        let list = |items: Vec<String>| items.join(", ");
        let mut text = format!(
            "{} cases of seed {}, {} of them with a gap below {SMALLEST_GAP} times the noise, which \
             count for nothing. The floor is the noise, what a wall that is 40 µm nearer does, and \
             what an edge does that is not the mesh's, where a vessel divides. \
             Answered by the program with SHA-256 {}; SHA-256 of seals.json: `{}`.\n\n",
            self.cases,
            list(self.seeds.iter().map(u64::to_string).collect()),
            self.too_small,
            list(self.binaries.iter().map(|hash| format!("`{hash}`")).collect()),
            self.seals_sha256,
        );
        text += &self.table();
        text += "\nRight answers (no gap; unknown; the one effect first; both effects in the \
                 reported sets):\n\n| vessel and instrument | one effect | two effects | outside \
                 the library | none |\n| --- | --- | --- | --- | --- |\n";
        // Writing to a string does not fail.
        for row in self.rigs.chunks(4) {
            let cells: Vec<String> =
                row.iter().map(|c| format!("{} of {}", c.right, c.of)).collect();
            let _ = writeln!(text, "| {} | {} |", row[0].rig, cells.join(" | "));
        }
        text
    }

    /// The figures as a table of Markdown.
    pub fn table(&self) -> String {
        let mut text = String::from(
            "| figure | target | reached | of | 95 % between |\n| --- | --- | --- | --- | --- |\n",
        );
        for t in &self.tallies {
            let value = t.value.map_or("–".to_owned(), |value| match t.unit {
                "" => format!("{value:.2}"),
                "%" => format!("{value:.0} %"),
                unit => format!("{value:.1} {unit}"),
            });
            let between =
                t.between.map_or(String::new(), |[low, high]| format!("{low:.0} and {high:.0} %"));
            let _ =
                writeln!(text, "| {} | {} | {value} | {} | {between} |", t.figure, t.target, t.of);
        }
        text
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

    fn value(score: &Score, figure: &str) -> Option<f64> {
        score.tallies.iter().find(|t| t.figure == figure).unwrap().value
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
        let score = score(String::new(), &revealed);
        assert_eq!((score.cases, score.too_small), (9, 1));
        assert_eq!(value(&score, "the true effect is named first"), Some(50.0));
        assert_eq!(value(&score, "the true effect is in the reported set"), Some(75.0));
        assert_eq!(value(&score, "mean size of that set"), Some(1.25));
        let wrong = value(&score, "confidently wrong").unwrap();
        assert!((wrong - 100.0 / 8.0).abs() < 1e-9);
        assert_eq!(value(&score, "a gap claimed where there is none"), Some(0.0));
        assert_eq!(value(&score, "both of two effects found"), Some(50.0));
        assert_eq!(value(&score, PAIRS_THAT_SHOW), Some(100.0));
        let held = value(&score, "90 % parameter intervals that hold the truth").unwrap();
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
        let score = score(String::new(), &revealed);
        let wrong: Vec<usize> = score.answers.iter().map(|a| a.confidently_wrong.len()).collect();
        assert_eq!(wrong, [0, 0, 1, 1, 1, 0]);
        let sixth = 100.0 / 6.0;
        assert!((value(&score, "confidently wrong").unwrap() - 2.0 * sixth).abs() < 1e-9);
        assert!((value(&score, ANY_CONFIDENTLY_WRONG).unwrap() - 3.0 * sixth).abs() < 1e-9);
    }

    #[test]
    fn a_share_of_few_cases_says_how_little_it_says() {
        // Wilson's interval of 0 of 4, 0 of 21 and 81 of 90 (computed by hand from its formula).
        for ((hit, of), expected) in
            [((0, 4), [0.0, 49.0]), ((0, 21), [0.0, 15.5]), ((81, 90), [82.1, 94.6])]
        {
            let found = wilson(hit, of).unwrap();
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.1), "{found:?}");
        }
        assert_eq!(wilson(0, 0), None);
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
        let score = score(String::new(), &revealed);
        let third = Some(100.0 / 3.0);
        assert_eq!(value(&score, "the true effect is named first"), third);
        assert_eq!(value(&score, "the true effect is in the reported set"), third);
        assert_eq!(value(&score, "both of two effects found"), Some(50.0));
        for figure in [FIRST_OVER_FLOOR, IN_SET_OVER_FLOOR, PAIRS_OVER_FLOOR] {
            assert_eq!(value(&score, figure), Some(100.0), "{figure}");
        }
    }
}
