//! The answer in plain words: which effect, where it shows, how far the error shrinks.

use crate::diagnosis::report::{Diagnosis, NamedEffect, Verdict};
use crate::rounding::{from_to, percent, quantity};
use crate::rules::Rules;
use crate::wording;

/// Sizes that would have gone unnoticed that are told at most, and the effects whose sizes are told first.
const TOLD: usize = 3;
const USUAL: [&str; 5] = [
    "instrument.stiffness",
    "contact.friction",
    "wall.stiffness",
    "drive.coulomb",
    "drive.viscous",
];

impl Diagnosis {
    /// The answer in plain words.
    pub fn sentence(&self) -> String {
        let parts = match self.verdict {
            Verdict::NoGap if self.asked_for.is_empty() => vec![self.no_gap(), self.unnoticed()],
            Verdict::NoGap => vec![self.asked_for_nothing()],
            Verdict::Inconclusive => vec![self.nothing_seen(), self.unnoticed()],
            Verdict::Named => {
                vec![self.which(true), self.shown(), self.how_far(), self.not_told_apart()]
            }
            Verdict::Partial => vec![
                self.which(false),
                self.shown(),
                self.how_far(),
                self.what_is_missing(),
                self.not_told_apart(),
            ],
            // Why stands first among the remarks.
            Verdict::Unknown if self.ranking.is_empty() => {
                let why = self.remarks.first().map_or(String::new(), |why| format!(": {why}"));
                vec![format!("Nothing can be concluded from this data{why}.")]
            }
            Verdict::Unknown if !self.asked_for.is_empty() => vec![
                format!(
                    "There is a gap, and the requested effects, {}, do not explain it well enough \
                     to be named: together they close {}. No other effect was tried.",
                    self.names(&self.asked_for).join(" and "),
                    percent(self.details.shrink)
                ),
                self.values_of(self.effects.iter()),
            ],
            Verdict::Unknown => vec![self.unexplained(), self.shown()],
        };
        let said = parts.into_iter().filter(|part| !part.is_empty());
        said.collect::<Vec<String>>().join(" ")
    }

    fn no_gap(&self) -> String {
        match self.gap.force_rms_n {
            None => {
                "No gap in the measured channels: the nominal model explains them to the floor. \
                     No force was measured."
                    .to_owned()
            }
            Some(_) => "No gap: the nominal model explains the data to the floor.".to_owned(),
        }
    }

    fn asked_for_nothing(&self) -> String {
        format!(
            "{} was asked for and explains nothing that can be seen in this data. {}",
            wording::capitalised(&self.names(&self.asked_for).join(" and ")),
            self.values_of(self.effects.iter())
        )
    }

    fn nothing_seen(&self) -> String {
        "Nothing was found, and that says little: this data would hardly have shown it.".to_owned()
    }

    /// Of an answer that is a part of the explanation: how much it closes, and that there is another cause.
    fn what_is_missing(&self) -> String {
        let closed = percent(self.details.shrink);
        let is_much = self.details.shrink >= Rules::USED.verdict.answer;
        let only = if is_much { "" } else { "only " };
        let rest = match (self.asked_for.is_empty(), is_much) {
            (true, true) => ", but what is left points to another cause, too",
            (true, false) => "; no known effect explains the rest",
            (false, _) => "; no other effect was tried",
        };
        format!("That closes {only}{closed} of the gap{rest}.")
    }

    /// What would have gone unnoticed: first what is changed most often on a rig, and how many effects hide.
    fn unnoticed(&self) -> String {
        let seen = |id: &&str| self.detectable.iter().find(|d| d.id == *id && d.is_seen_as_usual);
        let usual = USUAL.iter().filter_map(seen);
        let others = self.detectable.iter().filter(|own| own.is_seen_as_usual);
        let others = others.filter(|own| !USUAL.contains(&own.id));
        let sizes = usual
            .chain(others)
            .filter_map(|own| Some(wording::size(own.id, own.parameter, own.size?, own.unit)));
        let sizes: Vec<String> = sizes.take(TOLD).collect();
        let smaller = match &sizes[..] {
            [] => String::new(),
            [only] => format!("A smaller change than this would have gone unnoticed: {only}."),
            _ => format!(
                "Smaller changes than these would have gone unnoticed: {}.",
                sizes.join("; ")
            ),
        };
        let all = self.detectable.len();
        let hidden = match self.detectable.iter().filter(|own| !own.is_seen_as_usual).count() {
            0 => String::new(),
            n => format!("{n} of {all} effects would not have been seen at their usual size."),
        };
        [smaller, hidden].into_iter().filter(|own| !own.is_empty()).collect::<Vec<_>>().join(" ")
    }

    fn names<'a>(&self, ids: &'a [String]) -> Vec<&'a str> {
        ids.iter().map(|id| wording::name(id)).collect()
    }

    /// The effects with their values.
    fn which(&self, only_material: bool) -> String {
        let material = || self.effects.iter().filter(|e| e.material || !only_material);
        match material().count() {
            0 => self.values_of(self.effects.iter()),
            _ => self.values_of(material()),
        }
    }

    fn values_of<'a>(&self, effects: impl Iterator<Item = &'a NamedEffect>) -> String {
        effects
            .map(|own| wording::values(&own.id, own.what, &own.parameters))
            .collect::<Vec<String>>()
            .join(" ")
    }

    /// Where the gap is largest, and how it behaves there.
    fn shown(&self) -> String {
        let Some(cell) = self.places.first() else { return String::new() };
        let (channel, place) = (wording::channel(&cell.channel), wording::place(cell));
        match cell.note.as_str() {
            "" => format!("It shows most in {channel} {place}."),
            note => format!("It shows most in {channel} {place}: the error {note}."),
        }
    }

    fn how_far(&self) -> String {
        self.gap.force_rms_n.map_or_else(String::new, |f| {
            format!(
                "Correcting it takes the {} error from {} on data that the fit had not seen; the \
                 floor is {}.",
                self.gap.units.of_force(),
                from_to(f.before, f.after, self.gap.units.force()),
                quantity(f.floor, self.gap.units.force())
            )
        })
    }

    fn not_told_apart(&self) -> String {
        let sets = self.confusable.iter().filter_map(|set| {
            let (first, others) = set.split_first()?;
            let (first, others) = (wording::name(first), self.names(others).join(" or "));
            Some(format!(
                "{} cannot be told from {others} on this data",
                wording::capitalised(first)
            ))
        });
        let sets: Vec<String> = sets.collect();
        if sets.is_empty() {
            return String::new();
        }
        let next = self.next_experiment.as_ref().map(|next| {
            format!(
                " To tell them apart, record this: {} (`{}` of `cathforce gap protocol`).",
                next.what, next.segment
            )
        });
        format!("{}.{}", sets.join("; "), next.unwrap_or_default())
    }

    fn unexplained(&self) -> String {
        if let Some(why) = &self.details.objection {
            return format!("There is a gap, and what explains most of it is not believed: {why}.");
        }
        let nearest = self.ranking.first().filter(|nearest| nearest.shrink > 0.0);
        let nearest = nearest.map_or_else(String::new, |nearest| {
            // What is told of the rest is in squares, and the two shares of one model add up.
            let of_left = self.left.as_ref().filter(|left| left.after == [nearest.id.clone()]);
            let share = of_left.map_or(nearest.shrink, |left| 1.0 - left.gap_share);
            let share = percent(share);
            format!(": the best single effect, {}, closes {share}", wording::name(&nearest.id))
        });
        format!(
            "There is a gap, and none of the known effects explains it well enough to be named\
             {nearest}."
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::report::{Figures, Ranked};

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
    fn a_part_that_closes_nearly_all_is_not_only_that() {
        let sentence = |shrink, asked_for: &[&str]| {
            let mut answer = Diagnosis {
                verdict: Verdict::Partial,
                asked_for: asked_for.iter().map(|&id| id.to_owned()).collect(),
                ..Diagnosis::unanswered("trials")
            };
            answer.details.shrink = shrink;
            answer.sentence()
        };
        assert!(sentence(0.97, &[]).contains("closes 97 % of the gap, but what is left points"));
        assert!(sentence(0.6, &[]).contains("only 60 % of the gap; no known effect explains"));
        let asked = sentence(0.97, &["sensor.gain"]);
        assert!(asked.contains("closes 97 % of the gap; no other effect was tried"), "{asked}");
    }

    #[test]
    fn the_reason_that_decided_stands_in_the_headline() {
        let mut answer = Diagnosis {
            ranking: vec![Ranked { id: "sensor.gain".to_owned(), shrink: 0.9 }],
            ..Diagnosis::unanswered("trials")
        };
        answer.details.objection = Some("sensor.gain fits best at a bound".to_owned());
        let said = answer.sentence();
        assert!(said.contains("is not believed: sensor.gain fits best at a bound."), "{said}");
        assert!(!said.contains("closes 90 %"), "{said}");
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
            near.ends_with("to be named: the best single effect, motion of the wall, closes 71 %."),
            "{near}"
        );
        // An effect that closes nothing is not mentioned.
        let none = sentence(&[("wall.motion", -0.2)]);
        assert!(none.ends_with("well enough to be named."), "{none}");
        assert!(sentence(&[]).contains("Nothing can be concluded"));
    }
}
