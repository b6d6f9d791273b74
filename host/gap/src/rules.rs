//! Every constant by which the engine decides, with its derivation or measurement.
//!
//! Constants of a plant stand with the plant, and constants that refuse bad data with their check.
//! [`Rules::USED`] is what a diagnosis uses. [`SWITCHES`] are parts of it that may be switched off, so that a
//! stored set of cases tells what each is worth (`host/gap/examples/without.rs`).

/// What decides.
#[derive(Clone, Copy, Debug)]
pub struct Rules {
    pub evidence: OfEvidence,
    pub prior: Prior,
    pub search: OfSearch,
    pub ways: OfWays,
    pub interval: OfInterval,
    pub verdict: OfVerdict,
    pub confidence: OfConfidence,
}

/// How measurements are compared with a set of effects.
#[derive(Clone, Copy, Debug)]
pub struct OfEvidence {
    /// Length of a bin \[s\]. When exactly a contact opens, a snap or a whip happens, no reduced model tells; on
    /// average over a bin it matters little. A ripple of 4 Hz keeps three quarters of its size.
    pub bin_s: f64,
    /// Of a sensor's noise, what the model leaves open at least where no run was repeated.
    pub open_of_noise: f64,
    /// Degrees of freedom of Student's t, which the means follow: a few of them are far off in any reality.
    pub freedom: f64,
    /// Shares κ of the gap, amplitudes a of the model's uncertainty, and standard deviations ω of the nuisances
    /// in those of their priors. Each grid has steps of two and covers what is most probable in tuning cases. A
    /// tempered score counts a nuisance for less than it costs, and so ω is at most 1. Amplitudes below a half are
    /// those of an axis alone (`Plant::least_amplitude`).
    pub kappa: [f64; 9],
    pub amplitude: [f64; 6],
    pub looseness: [f64; 4],
    /// Length of the stretch over which the size of a gap is averaged \[s\]: a stroke of some millimetres.
    pub stretch_s: f64,
    /// Times the stated noise that a sensor may have, before the rest is a cause of its own: a vibration, or a
    /// patch of the wall that sticks. Strangers misstate their noise by up to a factor of two.
    pub misstated: f64,
}

/// Median and standard deviation of the logarithm.
pub type LogNormal = (f64, f64);

/// What is expected before the trials are seen.
///
/// The amplitude a and the looseness ω of the nuisances have no prior: it made no truth more probable.
///
/// The values make the true sets of effects of tuning cases probable (`examples/learn.rs`). The
/// objective is flat about them: a third more or less of any value changes the mean ln probability of the
/// truth by less than 0.2.
#[derive(Clone, Copy, Debug)]
pub struct Prior {
    /// Of the share κ of the gap that is left where all causes are in the library, and where one is not.
    pub kappa: LogNormal,
    pub kappa_with_others: LogNormal,
    /// Independent observations that a channel of a trial is at least, however short the trial. 1.5 to 3 are
    /// as good on tuning strangers (`examples/learn.rs`).
    pub of_channel: f64,
    /// What a bin of a long trial counts: neighbours err alike, and the model of the discrepancy is not true
    /// either, so that its certainty is less than it states.
    pub temper: f64,
    /// ln odds of one effect more.
    pub of_effect: f64,
    /// ln odds of a cause outside the library.
    pub of_others: f64,
}

/// Which sets of effects are fitted.
#[derive(Clone, Copy, Debug)]
pub struct OfSearch {
    /// Effects of a set. Those of a catheter change forces in shapes of their own, and three of them explain
    /// almost anything; the friction of an axis alone has several terms.
    pub most_effects: usize,
    pub most_effects_of_a_drive: usize,
    /// Sets of a size that are extended in a round, and effects that each is extended by.
    pub width: usize,
    pub extended_by: usize,
    /// Rounds at most. A set of three is there after two; the third compares its parts with their rivals.
    pub rounds: usize,
    pub rounds_of_a_drive: usize,
    /// Whether the parts of the best set are fitted and extended as well.
    pub compares_parts: bool,
    /// Single effects that are fitted to the end, at most and at least, and how far from the loss of
    /// the first, as a share of what that closes; where simulations cost nothing, all are.
    pub fitted_singles: usize,
    pub fewest_singles: usize,
    pub fitted_within: f64,
    /// Differences of ln p below this say nothing.
    pub tie: f64,
    /// Whether a fit continues with simulations that are corrected where it ended.
    pub corrects: bool,
    /// Whether the best set is fitted to the end with the finer model.
    pub polishes: bool,
    /// Whether a set at a bound, or with an effect whose interval holds "off", may not be named.
    pub refuses_bounds: bool,
    pub refuses_doubt: bool,
    /// Whether trials may be diagnosed again with a phase of their own for what swings, and the share of the
    /// gap that this must close more.
    pub phases: bool,
    pub phases_close_more: f64,
}

/// Which way past a fork a trial is simulated, where several are as plausible.
#[derive(Clone, Copy, Debug)]
pub struct OfWays {
    /// Whether other ways are tried at all.
    pub tried: bool,
    /// Times what the middle one of the trials has above the floor, or `near` at least, from which on
    /// one of them is far behind, and the share of it that may be left on another way.
    pub behind: f64,
    pub left: f64,
    /// Energy above the floor of a trial that is explained.
    pub near: f64,
    /// Times the energy of another way that the first may have, to be taken again.
    pub first: f64,
    /// Energy in every quantity up to which there is next to no gap.
    pub next_to_none: f64,
}

/// How wide intervals are, docs/explanation/diagnosis.md (D16). The factors are empirical; blind tests count how many
/// intervals hold the truth.
#[derive(Clone, Copy, Debug)]
pub struct OfInterval {
    /// Standard deviations over those that leaving out one trial after the other tells: for the few
    /// trials that there are, and for the shapes of the model, which are wrong in all trials alike.
    pub wider: f64,
    /// Standard deviation, in scales of a parameter's prior, that any model of the mechanics leaves open:
    /// in bundles of another simulator most of what was put in lies that near.
    pub other_model: f64,
    /// The same, as a share of what the effect is: a model whose forces answer to it by some percent more or
    /// less finds it by as much too small or too large.
    pub other_answer: f64,
    /// The same of a plant without other models of its mechanics. Friction may turn over otherwise than as a
    /// bristle does, and a coarse encoder is smoothed; `host/gap/examples/drives.rs` counts what the intervals hold.
    pub other_answer_of_axis: f64,
}

/// From when on an explanation is the answer.
#[derive(Clone, Copy, Debug)]
pub struct OfVerdict {
    /// Probability above which something is believed: more likely than not.
    pub likely: f64,
    /// Share of the gap's energy that an answer closes at least: the error above the floor is halved.
    pub answer: f64,
    /// The same of a part of the answer where a cause outside the library is likely: it closes more than it leaves.
    pub part: f64,
    /// The same where no such cause is likely. What closes less is a detail of something that was not found.
    pub part_of_mine: f64,
    /// Energy in every quantity up to which the nominal model is at its floor. The floor itself is known to some
    /// tenths; a local misfit below it is no gap unless an effect is sure.
    pub at_floor: f64,
    /// Probability of no effect up to which an effect is sure enough to be named though the model is at its floor.
    /// It is 0.75 or more in the eight tuning and practice cases at the floor without an effect; the rest is margin.
    pub sure: f64,
    /// Energy from which on there is a gap, whether or not a cause is found: the error is 1.5 times the floor,
    /// which is what counts as a gap in the blind tests.
    pub gap: f64,
    /// Share of an explanation's probability from which on another one cannot be told apart from it.
    pub not_told_apart: f64,
    /// Share of the nominal RMS from which on an effect is material.
    pub material: f64,
}

/// How sure an answer is of the effects that it names, docs/explanation/diagnosis.md (D18).
#[derive(Clone, Copy, Debug)]
pub struct OfConfidence {
    /// Share of a catheter's cases in which no set that was fitted is the truth, though one of them has won. It makes
    /// the named effects of tuning strangers most probable (`examples/learn.rs`).
    pub lapse: f64,
}

impl Rules {
    pub const USED: Self = Self {
        evidence: OfEvidence {
            bin_s: 0.1,
            open_of_noise: 0.3,
            freedom: 4.0,
            kappa: [0.005, 0.01, 0.02, 0.04, 0.08, 0.16, 0.32, 0.64, 1.28],
            amplitude: [0.125, 0.25, 0.5, 1.0, 2.0, 4.0],
            looseness: [0.125, 0.25, 0.5, 1.0],
            stretch_s: 1.2,
            misstated: 2.5,
        },
        prior: Prior {
            kappa: (0.1, 0.5),
            kappa_with_others: (0.4, 0.5),
            of_channel: 2.0,
            temper: 0.05,
            of_effect: -5.5,
            of_others: -1.7,
        },
        search: OfSearch {
            most_effects: 3,
            most_effects_of_a_drive: 6,
            width: 2,
            extended_by: 4,
            rounds: 4,
            rounds_of_a_drive: 7,
            compares_parts: true,
            fitted_singles: 10,
            fewest_singles: 4,
            fitted_within: 0.5,
            tie: 0.1,
            corrects: true,
            polishes: true,
            refuses_bounds: true,
            refuses_doubt: true,
            phases: true,
            phases_close_more: 0.1,
        },
        ways: OfWays {
            tried: true,
            behind: 1.8,
            left: 0.5,
            near: 0.4,
            first: 1.1,
            next_to_none: 1.5,
        },
        interval: OfInterval {
            wider: 2.5,
            other_model: 0.03,
            other_answer: 0.05,
            other_answer_of_axis: 0.01,
        },
        verdict: OfVerdict {
            likely: 0.5,
            answer: 0.75,
            part: 0.5,
            part_of_mine: 0.25,
            at_floor: 1.2,
            sure: 0.2,
            gap: 2.25,
            not_told_apart: 0.1,
            material: 0.05,
        },
        confidence: OfConfidence { lapse: 0.2 },
    };

    /// The rules without the part of a name in [`SWITCHES`].
    pub fn without(name: &str) -> Option<Self> {
        let (_, _, switch) = SWITCHES.iter().find(|(own, ..)| *own == name)?;
        let mut rules = Self::USED;
        switch(&mut rules);
        Some(rules)
    }
}

/// Name of a part, what is done without it, and how it is switched off.
pub type Switch = (&'static str, &'static str, fn(&mut Rules));

/// The parts that may be switched off.
pub const SWITCHES: [Switch; 16] = [
    ("pairs", "single effects only", |own| own.search.most_effects = 1),
    ("width", "one set of a size is extended", |own| own.search.width = 1),
    ("extension", "a set is extended by one effect", |own| own.search.extended_by = 1),
    ("parts", "parts of the best set are not compared", |own| own.search.compares_parts = false),
    ("singles", "four single effects are fitted to the end", |own| own.search.fitted_singles = 4),
    ("correction", "a fit ends with coarse simulations", |own| own.search.corrects = false),
    ("polish", "the best set is not fitted by the finer model", |own| own.search.polishes = false),
    ("ways", "no other way past a fork is tried", |own| own.ways.tried = false),
    ("phases", "all trials have the same phase", |own| own.search.phases = false),
    ("bounds", "an effect at a bound may be named", |own| own.search.refuses_bounds = false),
    ("doubt", "an effect that may be off may be named", |own| own.search.refuses_doubt = false),
    ("closed", "an answer may close anything", |own| {
        own.verdict.answer = f64::NEG_INFINITY;
        own.verdict.part = f64::NEG_INFINITY;
        own.verdict.part_of_mine = f64::NEG_INFINITY;
    }),
    ("floor", "a gap may be below the floor", |own| own.verdict.at_floor = 0.0),
    ("gap", "no gap however large the error", |own| own.verdict.gap = f64::INFINITY),
    ("lapse", "the posterior is the confidence", |own| own.confidence.lapse = 0.0),
    ("others", "all causes are in the library", |own| own.prior.of_others = f64::NEG_INFINITY),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_switch_has_its_own_name_and_changes_something() {
        for (i, (name, what, _)) in SWITCHES.iter().enumerate() {
            assert!(SWITCHES[..i].iter().all(|(other, ..)| other != name), "{name} twice");
            let without = Rules::without(name).unwrap();
            assert_ne!(format!("{without:?}"), format!("{:?}", Rules::USED), "{name}: {what}");
        }
        assert!(Rules::without("nothing").is_none());
    }
}
