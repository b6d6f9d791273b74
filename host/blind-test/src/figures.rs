//! The figures of a blind test: what each of them counts, its target, and its 95 % interval.

use serde::{Deserialize, Serialize};

/// A gap counts if it is at least this many times the noise.
pub const SMALLEST_GAP: f64 = 2.0;
/// A wrong answer with at least this confidence is confidently wrong.
pub const CONFIDENT: f64 = 0.8;

/// What a figure counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Counted {
    NamedFirst,
    NamedFirstAboveFloor,
    InReportedSet,
    InReportedSetAboveFloor,
    ReportedSetSize,
    ConfidentlyWrong,
    AnyEffectConfidentlyWrong,
    OutsideUnknown,
    OutsideNoneOfMine,
    GapClaimedWithoutEffect,
    GapMissedAboveFloor,
    PairFound,
    PairFoundAboveNoise,
    PairFoundAboveFloor,
    ShrinkDifference,
    ShrinkWithinTenPoints,
    IntervalsHoldTruth,
    MeanConfidence,
    NamedEffectsThere,
    ConfidenceOff,
    ProcessorTime,
    MiddleProcessorTime,
    LongestProcessorTime,
}

/// What a figure should reach, in its unit; `None` where there is no bound.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Target {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_least: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_most: Option<f64>,
}

/// One figure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    pub figure: Counted,
    pub target: Target,
    /// In `unit`; `None` where nothing was counted.
    pub reached: Option<f64>,
    pub unit: String,
    /// Number of cases, effects or parameters that it is taken over.
    pub of: usize,
    /// Bounds of the 95 % interval of a share, in percent (Wilson 1927).
    pub low: Option<f64>,
    pub high: Option<f64>,
}

impl Counted {
    /// In words, for a row of a table.
    pub fn words(self) -> &'static str {
        match self {
            Self::NamedFirst => "single effects: the true effect is named first",
            Self::NamedFirstAboveFloor => {
                "single effects with a gap of at least twice the floor: named first"
            }
            Self::InReportedSet => "single effects: the true effect is in the reported set",
            Self::InReportedSetAboveFloor => {
                "single effects with a gap of at least twice the floor: in the reported set"
            }
            Self::ReportedSetSize => "mean size of the reported set",
            Self::ConfidentlyWrong => "answers whose first effect is wrong with confidence",
            Self::AnyEffectConfidentlyWrong => {
                "answers with any effect that is wrong with confidence"
            }
            Self::OutsideUnknown => "effects outside the library: answered `unknown`",
            Self::OutsideNoneOfMine => {
                "effects outside the library: a cause outside is answered to be likely"
            }
            Self::GapMissedAboveFloor => {
                "cases with a gap of at least twice the floor: no gap is claimed"
            }
            Self::GapClaimedWithoutEffect => "cases without an effect: a gap is claimed",
            Self::PairFound => "pairs: both effects are in the reported sets",
            Self::PairFoundAboveNoise => {
                "pairs in which each effect adds at least twice the noise: both found"
            }
            Self::PairFoundAboveFloor => {
                "pairs in which each effect adds at least twice the floor: both found"
            }
            Self::ShrinkDifference => {
                "mean difference between predicted and achieved shrink on the withheld trial"
            }
            Self::ShrinkWithinTenPoints => "answers for which that difference is at most 10 points",
            Self::IntervalsHoldTruth => "90 % parameter intervals that contain the true value",
            Self::MeanConfidence => "mean confidence of named effects",
            Self::NamedEffectsThere => "named effects that are really there",
            Self::ConfidenceOff => "mean distance of shares from confidences",
            Self::ProcessorTime => "mean processor time of a diagnosis",
            Self::MiddleProcessorTime => "median processor time of a diagnosis",
            Self::LongestProcessorTime => "longest processor time of a diagnosis",
        }
    }

    /// What it should reach.
    pub fn target(self) -> Target {
        let at_least = |least| Target { at_least: Some(least), at_most: None };
        let at_most = |most| Target { at_least: None, at_most: Some(most) };
        match self {
            Self::NamedFirst
            | Self::NamedFirstAboveFloor
            | Self::OutsideUnknown
            | Self::OutsideNoneOfMine => at_least(90.0),
            Self::InReportedSet | Self::InReportedSetAboveFloor => at_least(97.0),
            Self::ReportedSetSize => at_most(1.5),
            Self::ConfidentlyWrong | Self::GapClaimedWithoutEffect | Self::GapMissedAboveFloor => {
                at_most(2.0)
            }
            Self::ConfidenceOff => at_most(5.0),
            Self::PairFound | Self::PairFoundAboveFloor => at_least(80.0),
            Self::ShrinkDifference => at_most(10.0),
            Self::IntervalsHoldTruth => Target { at_least: Some(85.0), at_most: Some(95.0) },
            Self::AnyEffectConfidentlyWrong
            | Self::PairFoundAboveNoise
            | Self::ShrinkWithinTenPoints
            | Self::MeanConfidence
            | Self::NamedEffectsThere
            | Self::ProcessorTime
            | Self::MiddleProcessorTime
            | Self::LongestProcessorTime => Target::default(),
        }
    }
}

impl Figure {
    /// Share of what is hit, in percent, with its 95 % interval.
    pub fn share(figure: Counted, hits: impl Iterator<Item = bool>) -> Self {
        let hits: Vec<bool> = hits.collect();
        let (of, hit) = (hits.len(), hits.iter().filter(|hit| **hit).count());
        let reached = (of > 0).then(|| 100.0 * hit as f64 / of as f64);
        let interval = wilson(hit as f64, of as f64);
        Self {
            figure,
            target: figure.target(),
            reached,
            unit: "%".to_owned(),
            of,
            low: interval.map(|[low, _]| low),
            high: interval.map(|[_, high]| high),
        }
    }

    /// Mean of values.
    pub fn mean(figure: Counted, unit: &str, values: &[f64]) -> Self {
        let of = values.len();
        let reached = (of > 0).then(|| values.iter().sum::<f64>() / of as f64);
        Self::of(figure, unit, reached, of)
    }

    /// A value that was taken over so many cases.
    pub fn of(figure: Counted, unit: &str, reached: Option<f64>, of: usize) -> Self {
        Self {
            figure,
            target: figure.target(),
            reached,
            unit: unit.to_owned(),
            of,
            low: None,
            high: None,
        }
    }

    /// The 95 % interval of a share in percent. It follows from the rounded share where none was kept.
    pub fn interval(&self) -> Option<[f64; 2]> {
        let kept = self.low.zip(self.high).map(|(low, high)| [low, high]);
        let of = self.of as f64;
        let from_share = || {
            let hits = (0.01 * self.reached.filter(|_| self.unit == "%")? * of).round();
            wilson(hits, of)
        };
        kept.or_else(from_share)
    }

    /// What was reached, rounded as a table shows it.
    pub fn reached_text(&self) -> String {
        self.reached.map_or("–".to_owned(), |value| match self.unit.as_str() {
            "" => format!("{value:.2}"),
            "%" => format!("{value:.0} %"),
            unit => format!("{value:.1} {unit}"),
        })
    }

    /// The target as a table shows it; empty where there is none.
    pub fn target_text(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        match (self.target.at_least, self.target.at_most) {
            (Some(least), Some(most)) => format!("{least}–{most}{unit}"),
            (Some(least), None) => format!("≥ {least}{unit}"),
            (None, Some(most)) => format!("≤ {most}{unit}"),
            (None, None) => String::new(),
        }
    }

    /// The 95 % interval as a table shows it; empty where there is none.
    pub fn interval_text(&self) -> String {
        let kept = self.low.zip(self.high);
        kept.map_or(String::new(), |(low, high)| format!("{low:.0} to {high:.0} %"))
    }
}

/// Bounds between which a share lies with a probability of 95 %, in percent (Wilson 1927).
fn wilson(hit: f64, of: f64) -> Option<[f64; 2]> {
    const Z: f64 = 1.96;
    let share = hit / of;
    let centre = share + Z * Z / (2.0 * of);
    let half = Z * (share * (1.0 - share) / of + Z * Z / (4.0 * of * of)).sqrt();
    let edge = |x: f64| 100.0 * (x / (1.0 + Z * Z / of)).clamp(0.0, 1.0);
    (of > 0.0).then(|| [edge(centre - half), edge(centre + half)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_of_few_cases_has_a_wide_interval() {
        // Wilson's interval of 0 of 4, 0 of 21 and 81 of 90 (computed by hand from its formula).
        for ((hit, of), expected) in
            [((0.0, 4.0), [0.0, 49.0]), ((0.0, 21.0), [0.0, 15.5]), ((81.0, 90.0), [82.1, 94.6])]
        {
            let found = wilson(hit, of).unwrap();
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.1), "{found:?}");
        }
        assert_eq!(wilson(0.0, 0.0), None);
    }

    #[test]
    fn a_share_without_a_kept_interval_gets_one_from_its_rounded_value() {
        let mut figure = Figure::share(Counted::NamedFirst, (0..90).map(|case| case < 81));
        let kept = figure.interval().unwrap();
        (figure.low, figure.high, figure.reached) = (None, None, Some(90.0));
        assert_eq!(figure.interval(), Some(kept));
        assert_eq!(figure.target_text(), "≥ 90 %");
    }
}
