//! Counts the figures of a blind test, or of a part of it.

use serde_json::Value;

use crate::answer::Answer;
use crate::draw::Kind;
use crate::figures::{Counted as C, Figure, SMALLEST_GAP};
use crate::label::Label;
use crate::reliability::{distance, reliability};

/// Predicted and achieved shrink may differ by so much.
const WITHIN: f64 = 0.1;

/// A label with its answer.
#[derive(Clone, Copy)]
pub(crate) struct Case<'a> {
    pub revealed: &'a (Label, Value),
    pub answer: &'a Answer,
}

impl Case<'_> {
    /// Whether its gap is large enough, or there should be none.
    pub(crate) fn counts(&self) -> bool {
        self.answer.kind == Kind::None || self.answer.gap_over_noise >= SMALLEST_GAP
    }
}

/// All figures of these cases.
pub(crate) fn figures(cases: &[Case<'_>]) -> Vec<Figure> {
    let counted: Vec<&Answer> =
        cases.iter().filter(|case| case.counts()).map(|case| case.answer).collect();
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
    let with_gap: Vec<&Answer> =
        counted.iter().copied().filter(|a| a.kind != Kind::None && over_floor(a)).collect();
    let counted_answers = || cases.iter().filter(|case| case.counts()).map(|case| case.revealed);
    let share = |figure, among: &[&Answer], hit: &dyn Fn(&Answer) -> bool| {
        Figure::share(figure, among.iter().map(|a| hit(a)))
    };
    let all_in = |a: &Answer| a.truth.iter().all(|id| a.reported.contains(id));
    let sizes: Vec<f64> =
        single.iter().filter(|a| !a.reported.is_empty()).map(|a| a.reported.len() as f64).collect();
    let inside = intervals(counted_answers());
    let seconds = cases.iter().filter_map(|case| case.revealed.1["cpu_seconds"].as_f64());
    let mut seconds: Vec<f64> = seconds.collect();
    seconds.sort_by(f64::total_cmp);
    let middle = seconds.get(seconds.len() / 2).copied();
    let longest = seconds.last().copied();
    let misses: Vec<f64> = counted.iter().filter_map(|a| a.shrink_missed()).collect();
    let within = misses.iter().map(|miss| *miss <= WITHIN);
    let named = named_in(cases);
    let confidences = named.iter().map(|(confidence, _)| 100.0 * confidence);
    let confidences: Vec<f64> = confidences.collect();
    let points: Vec<f64> = misses.iter().map(|miss| 100.0 * miss).collect();
    let there = named.iter().map(|(_, there)| *there);
    vec![
        share(C::NamedFirst, &single, &Answer::first_is_true),
        share(C::NamedFirstAboveFloor, &single_over_floor, &Answer::first_is_true),
        share(C::InReportedSet, &single, &all_in),
        share(C::InReportedSetAboveFloor, &single_over_floor, &all_in),
        Figure::mean(C::ReportedSetSize, "", &sizes),
        share(C::ConfidentlyWrong, &counted, &Answer::is_confidently_wrong),
        share(C::AnyEffectConfidentlyWrong, &counted, &|a| !a.confidently_wrong.is_empty()),
        share(C::OutsideUnknown, &outside, &|a| a.verdict == "unknown"),
        share(C::OutsideNoneOfMine, &outside, &Answer::blames_others),
        share(C::GapClaimedWithoutEffect, &none, &|a| !a.claims_no_gap()),
        share(C::GapMissedAboveFloor, &with_gap, &Answer::claims_no_gap),
        share(C::PairFound, &pair, &all_in),
        share(C::PairFoundAboveNoise, &pair_that_shows, &all_in),
        share(C::PairFoundAboveFloor, &pair_over_floor, &all_in),
        Figure::mean(C::ShrinkDifference, "points", &points),
        Figure::share(C::ShrinkWithinTenPoints, within),
        Figure::share(C::IntervalsHoldTruth, inside.iter().copied()),
        Figure::mean(C::MeanConfidence, "%", &confidences),
        Figure::share(C::NamedEffectsThere, there),
        Figure::of(C::ConfidenceOff, "points", distance(&reliability(&named)), named.len()),
        Figure::mean(C::ProcessorTime, "s", &seconds),
        Figure::of(C::MiddleProcessorTime, "s", middle, seconds.len()),
        Figure::of(C::LongestProcessorTime, "s", longest, seconds.len()),
    ]
}

/// Confidence of every named effect of the cases that count, and whether it is there.
pub(crate) fn named_in(cases: &[Case<'_>]) -> Vec<(f64, bool)> {
    let counted = cases.iter().filter(|case| case.counts()).map(|case| case.revealed);
    counted.flat_map(|(label, answer)| named(label, answer)).collect()
}

/// The same of one answer.
fn named(label: &Label, answer: &Value) -> Vec<(f64, bool)> {
    let effects = answer["effects"].as_array();
    let own = effects.into_iter().flatten().filter_map(|effect| {
        let there = label.effects.iter().any(|truth| effect["id"] == truth.id.as_str());
        Some((effect["confidence"].as_f64()?, there))
    });
    own.collect()
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
