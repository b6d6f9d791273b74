//! Draws strangers from a seed, in the shares of the other blind tests.

use cathforce_reference_solver::{Schedule, SolveError};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::draw::form;
use super::electronics::Electronics;
use super::families::{LIBRARY, OUTSIDE, shows};
use super::form::Form;
use super::motions::{MotionKind, Way};
use super::play::play;
use super::rig::StrangeRig;
use super::set::Set;
use crate::deck::Deck;
use crate::draw::{Kind, kinds};
use crate::nuisance::Spread;
use crate::play::Trial;

/// Trials of a case, the withheld one among them.
const TRIALS: std::ops::RangeInclusive<usize> = 3..=6;
/// Gaps over the floor that a case is adjusted to if its own is out of bounds.
const WANTED: [f64; 2] = [2.0, 8.0];

/// A reality to be diagnosed.
#[derive(Clone, Debug)]
pub struct Stranger {
    /// Counted from 0.
    pub number: usize,
    /// How many effects it has, and whether the library has them.
    pub kind: Kind,
    pub(crate) rig: StrangeRig,
    /// The last one is withheld.
    pub(crate) motions: Vec<Schedule>,
    /// How the drive was moved.
    pub motion: MotionKind,
    /// Its sensors.
    pub electronics: Electronics,
    /// How its nuisances are distributed.
    pub spread: Spread,
    /// Family and seed of each effect.
    pub(crate) effects: Vec<(&'static str, u64)>,
    /// From 0 (just to be seen) to 1 (strong), before it is adjusted.
    pub severity: f64,
    /// Gap over the floor that it is adjusted to, if it is.
    pub(crate) wanted: f64,
    /// Of noise and nuisances.
    pub noise_seed: u64,
}

impl Stranger {
    /// How many trials it has, the withheld one among them.
    pub fn trials(&self) -> usize {
        self.motions.len()
    }

    /// One of its effects at a severity; `None` if it has not so many.
    pub(crate) fn form(&self, effect: usize, severity: f64) -> Option<Form> {
        let (family, seed) = self.effects.get(effect)?;
        form(family, severity, *seed)
    }

    /// All its motions on a rig with forms.
    pub(crate) fn play(&self, rig: &StrangeRig, forms: &[Form]) -> Result<Vec<Trial>, SolveError> {
        let motions = self.motions.par_iter().enumerate();
        motions.map(|(trial, motion)| play(rig, forms, motion, trial)).collect()
    }
}

/// Cases 0 to `count` of a set, all of one kind or of all kinds in their shares. The same seed gives the same cases.
pub fn strangers(set: Set, only: Option<Kind>, seed: u64, count: usize) -> Vec<Stranger> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let kinds = match only {
        Some(kind) => vec![kind; count],
        None => kinds(count, &mut rng),
    };
    // Every effect, rig, motion and spread once before any comes twice.
    let (mut inside, mut outside) = (Deck::of(&LIBRARY), Deck::of(&OUTSIDE));
    let mut rigs = Deck::of(&set.families());
    let mut motions = Deck::of(&MotionKind::ALL);
    let mut spreads = Deck::of(&Spread::ALL);
    let case = |(number, kind): (usize, Kind)| {
        let rig = StrangeRig::draw(rigs.draw(&mut rng), &mut rng);
        let spread = spreads.draw(&mut rng);
        let electronics = Electronics::draw(&mut rng);
        let way = Way { start_m: rig.real.start_m, reach_m: rig.reach_m };
        let ids = match kind {
            Kind::None => Vec::new(),
            Kind::Single => vec![inside.draw(&mut rng)],
            Kind::Outside => vec![outside.draw(&mut rng)],
            Kind::Pair => {
                let first = inside.draw(&mut rng);
                let mut second = inside.draw(&mut rng);
                while second.0 == first.0 {
                    second = inside.draw(&mut rng);
                }
                vec![first, second]
            }
        };
        let mut family = |(_, families): (&str, &[&'static str])| {
            (families[rng.random_range(0..families.len())], rng.random())
        };
        let effects: Vec<(&'static str, u64)> = ids.into_iter().map(&mut family).collect();
        let shows = |motion: &MotionKind| effects.iter().all(|(own, _)| shows(own, *motion));
        let mut motion = motions.draw(&mut rng);
        for _ in 0..MotionKind::ALL.len() {
            if !shows(&motion) {
                motion = motions.draw(&mut rng);
            }
        }
        let trials = rng.random_range(TRIALS);
        let motions = (0..trials).map(|_| motion.draw(way, &mut rng)).collect();
        let severity = rng.random_range(0.0..1.0);
        let wanted = WANTED[0] * (WANTED[1] / WANTED[0]).powf(rng.random_range(0.0..1.0));
        let noise_seed = rng.random();
        Stranger {
            number,
            kind,
            rig,
            motions,
            motion,
            electronics,
            spread,
            effects,
            severity,
            wanted,
            noise_seed,
        }
    };
    kinds.into_iter().enumerate().map(case).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn a_seed_gives_the_same_strangers_again_and_another_one_others() {
        let (one, again) =
            (strangers(Set::Tuning, None, 7, 60), strangers(Set::Tuning, None, 7, 60));
        for (a, b) in one.iter().zip(&again) {
            assert_eq!(a.effects.len(), b.effects.len());
            assert!((0..2).all(|k| a.form(k, a.severity) == b.form(k, b.severity)));
            assert_eq!(a.rig.stated.branches, b.rig.stated.branches);
            assert_eq!(a.rig.truth, b.rig.truth);
            assert_eq!((&a.motions, &a.electronics), (&b.motions, &b.electronics));
            assert_eq!((a.spread, a.noise_seed), (b.spread, b.noise_seed));
        }
        let other = strangers(Set::Tuning, None, 8, 60);
        assert!(one.iter().zip(&other).any(|(a, b)| a.form(0, 0.5) != b.form(0, 0.5)));
        let count = |kind| one.iter().filter(|case| case.kind == kind).count();
        let shares = [Kind::None, Kind::Outside, Kind::Pair, Kind::Single].map(count);
        assert_eq!(shares, [6, 15, 15, 24]);
        for spread in Spread::ALL {
            assert_eq!(one.iter().filter(|case| case.spread == spread).count(), 20);
        }
        for motion in MotionKind::ALL {
            // About a fifth each: some effects do not show in some motions.
            let count = one.iter().filter(|case| case.motion == motion).count();
            assert!((8..=17).contains(&count), "{motion:?}: {count}");
        }
        let seen = |case: &Stranger| case.effects.iter().all(|(own, _)| shows(own, case.motion));
        assert!(one.iter().all(seen));
        assert!(one.iter().all(|case| TRIALS.contains(&case.motions.len())));
    }

    #[test]
    fn no_rig_of_one_set_is_in_the_other() {
        let names = |set| -> BTreeSet<String> {
            strangers(set, None, 3, 48).into_iter().map(|case| case.rig.real.name).collect()
        };
        let (tuning, sealed) = (names(Set::Tuning), names(Set::Sealed));
        assert_eq!((tuning.len(), sealed.len()), (12, 12));
        assert!(tuning.is_disjoint(&sealed));
    }
}
