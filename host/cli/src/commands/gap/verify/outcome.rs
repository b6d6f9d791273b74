//! What came out, in a word and in a sentence.

use cathforce_gap::catheter::Energy;
use cathforce_gap::rounding::percent;
use serde::Serialize;

/// Points by which less than was predicted is still as predicted.
const TOLERANCE: f64 = 0.1;
/// A mean square that is larger by less than this is as large.
const LARGER: f64 = 1.05;

/// Whether the settings keep what the diagnosis promised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    AsPromised,
    LessThanPromised,
    /// The error is larger than without the settings.
    Worse,
    /// Smaller, and nothing was promised.
    Smaller,
    /// Neither smaller nor larger, and nothing was promised.
    AsBefore,
    /// No gap above the floor, neither before nor after.
    NothingToClose,
    /// What was measured carries no conclusion.
    Inconclusive,
}

/// Whether a mean square has become larger.
pub fn is_larger(before: f64, after: f64) -> bool {
    after > LARGER * before
}

/// Share of the gap above the floor that is closed.
fn closed(Energy { before, achieved }: Energy) -> f64 {
    1.0 - (achieved - 1.0).max(0.0) / (before - 1.0)
}

impl Outcome {
    /// `predicted`: share of the gap that the diagnosis says is closed; `sane`: whether what was
    /// measured carries a conclusion.
    pub fn of(energy: Energy, predicted: Option<f64>, sane: bool) -> Self {
        let Energy { before, achieved } = energy;
        match predicted {
            _ if !sane => Self::Inconclusive,
            _ if is_larger(before.max(1.0), achieved) => Self::Worse,
            _ if before <= 1.0 => Self::NothingToClose,
            Some(share) if closed(energy) >= share - TOLERANCE => Self::AsPromised,
            Some(_) => Self::LessThanPromised,
            None if is_larger(achieved, before) => Self::Smaller,
            None => Self::AsBefore,
        }
    }

    pub fn sentence(self, energy: Energy, predicted: Option<f64>) -> String {
        let promise = predicted.map_or(String::new(), |share| {
            format!(", where the diagnosis predicted {}", percent(share))
        });
        let both = || {
            let closed = percent(closed(energy).max(0.0));
            format!("{closed} of the gap above the floor is closed{promise}")
        };
        let times = || format!("{:.1} times", energy.achieved / energy.before);
        match self {
            Self::AsPromised => format!("As promised: {}.", both()),
            Self::LessThanPromised => format!("Less than promised: {}.", both()),
            Self::Worse => format!(
                "Worse than before: the mean square error on the device is {} what it was{promise}.",
                times()
            ),
            Self::Smaller => {
                format!("Smaller than before: {}. No diagnosis was given to compare with.", both())
            }
            Self::AsBefore => {
                "As before: the settings hardly change the error. No diagnosis was given to compare with."
                    .to_owned()
            }
            Self::NothingToClose => {
                "Nothing to close: this trial has no gap above the floor, with or without the \
                 settings."
                    .to_owned()
            }
            Self::Inconclusive => {
                "Nothing can be concluded from what was measured in this trial.".to_owned()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_outcome_has_its_word() {
        for (before, achieved, predicted, is) in [
            (11.0, 1.5, Some(0.98), Outcome::AsPromised),
            (11.0, 0.9, Some(0.98), Outcome::AsPromised),
            (11.0, 2.5, Some(0.98), Outcome::LessThanPromised),
            (11.0, 11.2, Some(0.98), Outcome::LessThanPromised),
            (11.0, 12.0, Some(0.98), Outcome::Worse),
            (11.0, 12.0, None, Outcome::Worse),
            (11.0, 2.5, None, Outcome::Smaller),
            (11.0, 11.2, None, Outcome::AsBefore),
            // A trial without a gap hides no error that has grown.
            (0.8, 0.9, Some(0.98), Outcome::NothingToClose),
            (0.8, 1.2, Some(0.98), Outcome::Worse),
        ] {
            let energy = Energy { before, achieved };
            assert_eq!(Outcome::of(energy, predicted, true), is, "{energy:?} {predicted:?}");
            assert_eq!(Outcome::of(energy, predicted, false), Outcome::Inconclusive);
        }
    }

    #[test]
    fn a_sentence_begins_with_the_outcome_and_has_both_shares() {
        let say = |before, achieved, predicted| {
            let energy = Energy { before, achieved };
            Outcome::of(energy, predicted, true).sentence(energy, predicted)
        };
        assert_eq!(
            say(11.0, 3.0, Some(0.98)),
            "Less than promised: 80 % of the gap above the floor is closed, where the diagnosis \
             predicted 98 %."
        );
        assert!(say(0.8, 1.6, None).starts_with("Worse than before: "));
        assert!(say(0.8, 1.6, None).contains("2.0 times"));
    }
}
