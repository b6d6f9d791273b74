//! The verdict: whether an explanation is the answer, a part of it, or not good enough to be named.

use serde::{Deserialize, Serialize};

use crate::deciding::posterior::Posterior;

/// What was concluded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The nominal model explains the data, and effects of a usual size would have been seen.
    NoGap,
    /// Effects of the library explain the gap.
    Named,
    /// Effects of the library are there, and a cause outside it.
    Partial,
    /// There is a gap that no effect of the library explains, or the data allow no verdict.
    Unknown,
    /// Nothing was found, and most effects of a usual size would not have been seen.
    Inconclusive,
}

/// One single effect that was tried.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ranked {
    pub id: String,
    pub shrink: f64,
}

/// Probability above which something is believed: more likely than not.
const LIKELY: f64 = 0.5;
/// Share of the gap's energy that an answer closes at least: the error above the floor is halved.
const ANSWER: f64 = 0.75;
/// The same of a part of the answer where a cause outside the library is likely: it closes more than it leaves.
const PART: f64 = 0.5;
/// The same where no such cause is likely. What closes less is a detail of something that was not found.
const PART_OF_MINE: f64 = 0.25;

/// Energy in every quantity up to which the nominal model is at its floor. The floor itself is known to some
/// tenths; a local misfit below it is no gap unless an effect is sure.
pub const AT_FLOOR: f64 = 1.2;
/// Probability of no effect up to which an effect is sure enough to be named though the model is at its floor.
/// It is 0.75 or more in the eight tuning and practice cases at the floor without an effect; the rest is margin.
const SURE: f64 = 0.2;
/// The same from which on there is a gap, whether or not a cause is found: the error is 1.5 times the floor,
/// which is what counts as a gap in the blind tests.
const GAP: f64 = 2.25;

/// What a set of effects is worth as an answer. `shrink`: share of the gap that it closes; `worst`: the largest
/// energy of a quantity that the nominal model leaves.
pub fn verdict(posterior: &Posterior, set: &[usize], shrink: f64, worst: f64) -> Verdict {
    let is_sure = posterior.without_effect() < SURE;
    match of_sets(posterior, set, shrink) {
        Verdict::Unknown if worst < AT_FLOOR => Verdict::NoGap,
        _ if worst < AT_FLOOR && !is_sure => Verdict::NoGap,
        Verdict::NoGap if worst > GAP => Verdict::Unknown,
        other => other,
    }
}

/// The same of effects that were asked for, of which there is one set beside the nominal model.
pub fn verdict_of_request(posterior: &Posterior, set: &[usize], shrink: f64) -> Verdict {
    match posterior.of_no_effect() > LIKELY {
        true => Verdict::NoGap,
        false => of_sets(posterior, set, shrink),
    }
}

fn of_sets(posterior: &Posterior, set: &[usize], shrink: f64) -> Verdict {
    let others = posterior.none_of_mine() > LIKELY;
    let is_likely = posterior.of_class(set) > LIKELY;
    match set {
        [] if others => Verdict::Unknown,
        [] => Verdict::NoGap,
        _ if is_likely && !others && shrink >= ANSWER => Verdict::Named,
        _ if is_likely && !others && shrink >= PART_OF_MINE => Verdict::Partial,
        _ if is_likely && shrink >= PART => Verdict::Partial,
        _ => Verdict::Unknown,
    }
}
