//! Cross-validation folds: whole trials, or parts of a single one.

use std::collections::BTreeSet;

use crate::plant::{Plant, Sample};

/// Fewest samples of a regime that count as having been trained on.
const TRAINED_SAMPLES: usize = 10;
/// Fewest parts of trials that can be held out.
const FEWEST_BLOCKS: usize = 3;
/// Share of unseen samples from which on held-out figures say too little.
const MOST_UNSEEN: f64 = 0.5;

/// What is held out together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FoldKind {
    /// Whole trials, the others train.
    Trial,
    /// Cycles or equal parts of every trial.
    Block,
}

/// Which samples are held out together, and which cannot be scored at all.
#[derive(Clone, Debug)]
pub struct Folds {
    pub kind: FoldKind,
    /// By trial, by sample.
    pub of_sample: Vec<Vec<usize>>,
    /// Whether the other folds have the sample's regime too; what they lack is not scored.
    pub scored: Vec<Vec<bool>>,
    pub count: usize,
    /// Share of samples that is not scored.
    pub unseen_share: f64,
    /// Their regimes.
    pub unseen: Vec<String>,
}

impl Folds {
    /// Leave one trial out; where most of a trial's regimes are its own, or there is one trial, leave
    /// one part of every trial out. Else why nothing can be held out.
    pub fn of(plant: &dyn Plant) -> Result<Self, String> {
        let trials = plant.trials();
        let whole = (trials.len() > 1).then(|| Self::by(plant, FoldKind::Trial, trials.len()));
        if let Some(whole) = whole.as_ref().filter(|folds| folds.unseen_share <= MOST_UNSEEN) {
            return Ok(whole.clone());
        }
        let blocks = trials.iter().map(|trial| trial.blocks).max().unwrap_or_default();
        let parts = (blocks >= FEWEST_BLOCKS).then(|| Self::by(plant, FoldKind::Block, blocks));
        match (parts, whole) {
            (Some(parts), _) if parts.unseen_share <= MOST_UNSEEN => Ok(parts),
            (_, Some(folds)) | (Some(folds), None) => Err(format!(
                "nothing can be held out: {:.0} % of the samples were recorded in regimes that \
                 only one trial has ({}); repeat the motions in every trial",
                100.0 * folds.unseen_share,
                folds.unseen.join("; ")
            )),
            (None, None) => {
                Err("one trial without cycles: no part of it can be predicted from the \
                                 others, so no figure would be honest; record at least two trials"
                    .to_owned())
            }
        }
    }

    fn by(plant: &dyn Plant, kind: FoldKind, count: usize) -> Self {
        let trials = plant.trials();
        let fold = |trial: usize, block: usize| match kind {
            FoldKind::Trial => trial,
            FoldKind::Block => block,
        };
        let regimes = plant.regimes().len();
        let mut inside = vec![vec![0_usize; regimes]; count];
        let mut total = vec![0_usize; regimes];
        for (t, trial) in trials.iter().enumerate() {
            for sample in &trial.samples {
                inside[fold(t, sample.block)][sample.regime] += 1;
                total[sample.regime] += 1;
            }
        }
        let (mut left_out, mut unseen) = (0, BTreeSet::new());
        let (mut of_sample, mut scored) = (Vec::new(), Vec::new());
        for (t, trial) in trials.iter().enumerate() {
            let own: Vec<usize> = trial.samples.iter().map(|s| fold(t, s.block)).collect();
            let trained = |(sample, &fold): (&Sample, &usize)| {
                let trained = total[sample.regime] - inside[fold][sample.regime];
                if trained < TRAINED_SAMPLES {
                    left_out += 1;
                    unseen.insert(sample.regime);
                }
                trained >= TRAINED_SAMPLES
            };
            scored.push(trial.samples.iter().zip(&own).map(trained).collect());
            of_sample.push(own);
        }
        let all: usize = total.iter().sum();
        Self {
            kind,
            of_sample,
            scored,
            count,
            unseen_share: left_out as f64 / all.max(1) as f64,
            unseen: unseen.into_iter().map(|regime| plant.regimes()[regime].clone()).collect(),
        }
    }

    /// What must be known about how was held out.
    pub fn remarks(&self, trials: usize) -> Vec<String> {
        let mut remarks = Vec::new();
        if self.kind == FoldKind::Block {
            remarks.push(match trials {
                1 => "one trial only: its cycles are held out in turn, so that nothing is known about \
                      what changes from trial to trial"
                    .to_owned(),
                _ => "every trial has speeds of its own, so that none can be predicted from the others: \
                      parts of all trials are held out in turn, and nothing is known about what changes \
                      from trial to trial; repeat the motions in every trial"
                    .to_owned(),
            });
        }
        if self.unseen_share > 0.0 {
            let other = if self.kind == FoldKind::Trial { "trial" } else { "part" };
            remarks.push(format!(
                "{:.1} % of the samples are not scored, because no other {other} has their regime: {}",
                100.0 * self.unseen_share,
                self.unseen.join("; ")
            ));
        }
        remarks
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::toy::Toy;

    /// Trials of 100 samples, in regimes by trial and block.
    fn toy(trials: usize, regime: impl Fn(usize, usize) -> usize) -> impl Plant {
        let toy = Toy::new(0.01, 0.01, (0..100).map(|_| 0.0), |_, _| 0.0);
        toy.times(trials).in_regimes(8, regime)
    }

    #[test]
    fn trials_are_held_out_whole_where_others_have_their_regimes() {
        let folds = Folds::of(&toy(4, |t, _| t % 2)).unwrap();
        assert_eq!((folds.kind, folds.count, folds.unseen_share), (FoldKind::Trial, 4, 0.0));
        assert!(folds.remarks(4).is_empty());
        // The last one alone has its regime.
        let folds = Folds::of(&toy(4, |t, _| usize::from(t == 3))).unwrap();
        assert_eq!((folds.kind, folds.unseen_share), (FoldKind::Trial, 0.25));
        assert_eq!(folds.unseen, ["regime 1"]);
    }

    #[test]
    fn of_trials_with_regimes_of_their_own_parts_are_held_out() {
        let folds = Folds::of(&toy(4, |t, _| t)).unwrap();
        assert_eq!((folds.kind, folds.count, folds.unseen_share), (FoldKind::Block, 4, 0.0));
        assert_eq!(folds.of_sample[2][0], 0);
        assert!(folds.remarks(4)[0].contains("every trial has speeds of its own"));
        // And every part one of its own: there is nothing to predict it from.
        let why = Folds::of(&toy(2, |t, block| 4 * t + block)).unwrap_err();
        assert!(why.contains("100 % of the samples") && why.contains("regime 7"), "{why}");
        let alone = Folds::of(&toy(1, |_, _| 0)).unwrap();
        assert!(alone.kind == FoldKind::Block && alone.remarks(1)[0].contains("one trial only"));
    }
}
