//! The verdict: whether an explanation is the answer, a part of it, or not good enough to be named.

use serde::{Deserialize, Serialize};

use crate::deciding::posterior::Posterior;
use crate::rules::OfVerdict;

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

/// What a set of effects is worth as an answer. `shrink`: share of the gap that it closes; `worst`: the largest
/// energy of a quantity that the nominal model leaves; `is_stretched`: whether it leaves no more only with nuisances at
/// the limits of their priors in most trials.
pub fn verdict(
    rules: &OfVerdict,
    posterior: &Posterior,
    set: &[usize],
    shrink: f64,
    worst: f64,
    is_stretched: bool,
) -> Verdict {
    let is_at_floor = worst < rules.at_floor && !is_stretched;
    let is_sure = posterior.without_effect() < rules.sure;
    match of_sets(rules, posterior, set, shrink) {
        Verdict::Unknown if is_at_floor => Verdict::NoGap,
        _ if is_at_floor && !is_sure => Verdict::NoGap,
        Verdict::NoGap if worst > rules.gap || is_stretched => Verdict::Unknown,
        other => other,
    }
}

/// The same of effects that were asked for, of which there is one set beside the nominal model.
pub fn verdict_of_request(
    rules: &OfVerdict,
    posterior: &Posterior,
    set: &[usize],
    shrink: f64,
) -> Verdict {
    match posterior.of_no_effect() > rules.likely {
        true => Verdict::NoGap,
        false => of_sets(rules, posterior, set, shrink),
    }
}

fn of_sets(rules: &OfVerdict, posterior: &Posterior, set: &[usize], shrink: f64) -> Verdict {
    let others = posterior.none_of_mine() > rules.likely;
    let is_likely = posterior.of_class(set) > rules.likely;
    match set {
        [] if others => Verdict::Unknown,
        [] => Verdict::NoGap,
        _ if is_likely && !others && shrink >= rules.answer => Verdict::Named,
        _ if is_likely && !others && shrink >= rules.part_of_mine => Verdict::Partial,
        _ if is_likely && shrink >= rules.part => Verdict::Partial,
        _ => Verdict::Unknown,
    }
}
