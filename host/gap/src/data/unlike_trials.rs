//! Finds a trial that is unlike all others, for instance because it is of another rig.

use crate::fitting::problem::Problem;
use crate::plant::{Quantity, Trial};
use crate::rounding::quantity as figure;
use crate::scoring::score::Score;

/// The nominal model errs by so many times what it does in any other trial …
const UNLIKE: f64 = 4.0;
/// … of at least so many.
const FEWEST: usize = 3;

/// Names it. `nominal`: the score of the nominal model.
pub fn unlike(problem: &Problem<'_>, nominal: &Score) -> Option<String> {
    let of = |quantity: Quantity| {
        let error = |(t, trial): (usize, &Trial)| {
            Some((nominal.rms_of(problem, quantity, t)?, trial.number))
        };
        let mut errors: Vec<(f64, u32)> =
            problem.plant.trials().iter().enumerate().filter_map(error).collect();
        errors.sort_by(|a, b| b.0.total_cmp(&a.0));
        let [(most, number), (next, _), ..] = errors[..] else { return None };
        if errors.len() < FEWEST || most <= UNLIKE * next {
            return None;
        }
        let [most, next] = [most, next].map(|error| figure(error, quantity.unit()));
        Some(format!(
            "trial {number:03} is unlike the others: the nominal model errs by {most} RMS there, by \
             {next} at most in any other; if it is of another rig, or was disturbed, diagnose without \
             it (--hold-back {number})"
        ))
    };
    // The tip of one that whips may be far off in any rig.
    [Quantity::Force, Quantity::DriveForce].into_iter().find_map(of)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::toy::{Toy, explained_by, noise};

    /// What is said where the last of some trials has so many times the error of the others.
    fn said(trials: usize, times: f64) -> Option<String> {
        let measured = (0..400).map(noise);
        let toy =
            Toy::new(0.01, 1.0, measured, |_, _| 0.0).times(trials).last_is(|own| times * own);
        explained_by(&toy, &[], |selector, selection| {
            unlike(selector.problem, &selection.nominal.score)
        })
    }

    #[test]
    fn a_trial_that_is_far_worse_than_all_others_is_named() {
        assert!(said(4, 6.0).unwrap().starts_with("trial 003 is unlike the others"));
        assert_eq!(said(4, 3.0), None);
        assert_eq!(said(2, 6.0), None, "which of two is right, nobody knows");
    }
}
