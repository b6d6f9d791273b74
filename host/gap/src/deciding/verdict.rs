//! The verdict: whether an explanation is the answer, a part of it, or not good enough to be named.

use serde::{Deserialize, Serialize};

use crate::scoring::criteria::NEAR_FLOOR;

/// What was concluded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The nominal model explains the data to the floor.
    NoGap,
    /// Effects that close at least 80 % of the gap.
    Named,
    /// Effects that close a part of it and lead all others.
    Partial,
    /// No effect of the library explains enough of the gap, or the data allow no verdict.
    Unknown,
}

/// One single effect that was tried.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ranked {
    pub id: String,
    pub shrink: f64,
}

/// Shrink from which on the explanation is the answer, and a part of it.
const NAMED: f64 = 0.8;
const PARTIAL: f64 = 0.7;
/// The same of a part that leads all others by far.
const LED_PART: f64 = 0.6;
/// Effects of a catheter that may close less than nearly all of the gap and be named: with more of
/// them, anything is fitted a little.
const FEW: usize = 2;
/// Shrink from which on what is left may be of any size; below, a catheter's explanation must come
/// as near to the floor as this, in energy and in every quantity. The floor of a drive, whose repeats
/// agree better than any model, says little of what is left.
pub const NEARLY_ALL: f64 = 0.9;
/// The same of several effects: in the tuning sets, several effects that closed less and left a large
/// error were a cause outside the library. Large is above `LED_FLOOR` for two effects, each of which
/// leaves the difference between its shape and the library's, and above `NEAR_FLOOR` for three.
const NEARLY_ALL_TOGETHER: f64 = 0.95;
/// Energy of a quantity that may be left by what closes less, if nothing else comes near to it: a
/// shape that differs from the library's leaves something where the effect acts most.
const LED_FLOOR: f64 = 5.0;
/// Energy of a quantity from which on what closes less explains too little, however far it leads:
/// in the tuning sets, three wrong answers to a rough piece of wall left more, and no true answer did.
const FAR_FROM_FLOOR: f64 = 50.0;
/// Shrink by which what closes less must be ahead of its rivals; a part of the answer also of what it is
/// confused with: in the tuning sets, a part that two effects explained equally well was due to neither
/// (two jumps of the feed, and a cable that looked like a bias as much as like a drift).
const LEAD: f64 = 0.2;
/// The same, from which on what is left may be of any such size: what no other effect comes near to
/// explaining by half is not explained by chance.
const CLEAR_LEAD: f64 = 0.35;
/// The same for what explains a part: in four tuning sets of 210 cases, no effect leads by as much
/// where the cause is outside the library and no effect closes more.
const FAR_LEAD: f64 = 0.5;

/// How much more the first effect of an explanation closes alone.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lead {
    /// Than any that it can be told apart from.
    pub told_apart: f64,
    /// Than any.
    pub all: f64,
}

impl Lead {
    /// How far an effect leads alone, where these are not told apart from it: what several explain
    /// equally badly, none explains. What is named beside it is a rival too: two that explain about as
    /// much alone may stand together for what is in no library.
    pub fn of(ranking: &[Ranked], first: &str, alike: &[&str]) -> Self {
        let shrink = |ranked: Option<&Ranked>| ranked.map_or(0.0, |ranked| ranked.shrink);
        let alone = shrink(ranking.iter().find(|ranked| ranked.id == first));
        let mut rivals = ranking.iter().filter(|ranked| ranked.id != first);
        let all = alone - shrink(rivals.clone().next());
        Self { told_apart: alone - shrink(rivals.find(|r| !alike.contains(&&*r.id))), all }
    }
}

/// What an explanation is worth. `shrink`: what it closes; `worst`: energy that it leaves in a
/// quantity; `lead`: that of its first effect; `effects`: how many it has of a catheter.
pub fn verdict(shrink: f64, worst: f64, lead: Lead, effects: usize) -> Verdict {
    let left_to_any = if effects > 1 { NEARLY_ALL_TOGETHER } else { NEARLY_ALL };
    let left_together = if effects > FEW { NEAR_FLOOR } else { LED_FLOOR };
    match shrink {
        s if s >= left_to_any => Verdict::Named,
        s if s >= NEARLY_ALL && worst <= left_together => Verdict::Named,
        _ if effects > FEW || worst > FAR_FROM_FLOOR => Verdict::Unknown,
        s if s >= NAMED && worst <= NEAR_FLOOR => Verdict::Named,
        s if s >= NAMED && lead.told_apart >= CLEAR_LEAD => Verdict::Named,
        s if s >= NAMED && worst <= LED_FLOOR && lead.told_apart >= LEAD => Verdict::Named,
        s if s >= PARTIAL && worst <= NEAR_FLOOR && lead.all >= LEAD => Verdict::Partial,
        s if s >= LED_PART && lead.all >= FAR_LEAD => Verdict::Partial,
        _ => Verdict::Unknown,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_must_be_less_the_less_an_effect_leads() {
        use Verdict::{Named, Partial, Unknown};
        for (shrink, worst, lead, effects, expected) in [
            // Nearly everything.
            (0.91, 90.0, 0.0, 1, Named),
            // Most of it, near the floor, led by some or by much.
            (0.85, 2.4, 0.0, 1, Named),
            (0.85, 4.9, 0.21, 1, Named),
            (0.85, 49.0, 0.36, 1, Named),
            (0.85, 51.0, 0.36, 1, Unknown),
            (0.85, 4.9, 0.19, 1, Unknown),
            (0.85, 5.1, 0.34, 1, Unknown),
            // Three effects fit a little of anything.
            (0.85, 2.4, 0.36, 2, Named),
            (0.85, 2.4, 0.36, 3, Unknown),
            (0.91, 2.4, 0.0, 3, Named),
            (0.91, 90.0, 0.0, 3, Unknown),
            (0.94, 4.9, 0.1, 2, Named),
            (0.94, 5.1, 0.1, 2, Unknown),
            (0.94, 2.6, 0.1, 3, Unknown),
            (0.96, 90.0, 0.0, 2, Named),
            // A part of it.
            (0.75, 2.4, 0.21, 1, Partial),
            (0.75, 2.6, 0.36, 1, Unknown),
            (0.75, 2.4, 0.19, 1, Unknown),
            (0.75, 49.0, 0.51, 1, Partial),
            (0.75, 51.0, 0.51, 1, Unknown),
            (0.75, 49.0, 0.51, 3, Unknown),
            (0.69, 1.0, 0.49, 1, Unknown),
            (0.61, 5.4, 0.51, 1, Partial),
            (0.59, 1.0, 0.9, 1, Unknown),
        ] {
            let found = verdict(shrink, worst, Lead { told_apart: lead, all: lead }, effects);
            assert_eq!(found, expected, "{shrink} {worst} {lead} {effects}");
        }
        let confused = Lead { told_apart: 0.6, all: 0.1 };
        assert_eq!(verdict(0.85, 49.0, confused, 1), Named);
        assert_eq!(verdict(0.75, 49.0, confused, 1), Unknown);
        assert_eq!(verdict(0.75, 2.4, confused, 1), Unknown);
    }

    #[test]
    fn an_effect_that_is_not_told_apart_is_a_rival_among_all_alone() {
        let ranking = [("motion", 0.7), ("registration", 0.5), ("ripple", 0.2)];
        let ranking = ranking.map(|(id, shrink)| Ranked { id: id.to_owned(), shrink });
        for (first, alike, told_apart, all) in [
            ("motion", &[][..], 0.2, 0.2),
            ("motion", &["registration"][..], 0.5, 0.2),
            ("registration", &[][..], -0.2, -0.2),
        ] {
            let found = Lead::of(&ranking, first, alike);
            assert!((found.told_apart - told_apart).abs() < 1e-12, "{first} {found:?}");
            assert!((found.all - all).abs() < 1e-12, "{first} {found:?}");
        }
        assert_eq!(Lead::of(&[], "motion", &[]).all, 0.0);
    }
}
