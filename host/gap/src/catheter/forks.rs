//! Samples that are decided by a bifurcation: whether the tip passes a dividing wall on one side or
//! on the other.
//!
//! Models that differ by less than the uncertainty of the setup ([`WAYS`](super::ways::WAYS)) can take
//! different branches there. A measurement on another branch says next to nothing about an effect, but it
//! would outweigh all other samples. Such samples are found with pairs of perturbations in opposite
//! senses. With the predictions f₊ and f₋ of a pair,
//!
//! > e² = mean over pairs of (½(f₊ + f₋) − f)²
//!
//! The smooth response to the perturbation cancels in e. Where e is far above the other uncertainties of a
//! sample, the sample is not scored. Elsewhere e is part of its floor.

use crate::parallel::each_some;
use crate::plant::Sample;

/// Pairs of [`WAYS`](super::ways::WAYS) that differ from the first in opposite senses.
const OPPOSITE: [[usize; 2]; 8] =
    [[2, 3], [4, 5], [6, 7], [8, 9], [10, 11], [12, 15], [13, 14], [16, 17]];
/// Times what else leaves a sample open that e is where a fork decides it.
const DECIDED: f64 = 2.0;
/// Share of a trial's samples that may be left out. Of a trial that forks decide altogether, they are all
/// that there is.
const MOST: f64 = 0.5;

/// e of every sample, from predictions on a way; a pair of which one breaks down says nothing.
///
/// See docs/explanation/diagnosis.md (D7).
pub fn decided_by_forks(
    nominal: &[f64],
    on_way: impl Fn(usize) -> Option<Vec<f64>> + Sync,
) -> Vec<f64> {
    let bent = |[up, down]: &[usize; 2]| -> Option<Vec<f64>> {
        let sides = on_way(*up)?.into_iter().zip(on_way(*down)?);
        Some(sides.zip(nominal).map(|((up, down), off)| 0.5 * (up + down) - off).collect())
    };
    let pairs: Vec<Vec<f64>> = each_some(&OPPOSITE, bent);
    let of = |i: usize| {
        let squares: f64 = pairs.iter().map(|bent| bent[i].powi(2)).sum();
        (squares / pairs.len().max(1) as f64).sqrt()
    };
    (0..nominal.len()).map(of).collect()
}

/// Whether each sample is left out, by its e and what else leaves it open.
pub fn left_out(samples: &[Sample], e: &[f64]) -> Vec<bool> {
    let is_decided = |(own, e): (&Sample, &f64)| *e > DECIDED * own.noise.hypot(own.model);
    let decided: Vec<bool> = samples.iter().zip(e).map(is_decided).collect();
    let count = decided.iter().filter(|own| **own).count();
    if count as f64 > MOST * decided.len() as f64 { vec![false; decided.len()] } else { decided }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::catheter::plant::{Catheter, nominal};
    use crate::catheter::priors::Priors;
    use crate::catheter::simulate::Setup;
    use crate::catheter::ways::WAYS;
    use crate::plant::Plant;

    /// How far a way is from the first, by its index.
    const OFF: [f64; 18] =
        [0., 0.5, 1., -1., 2., -2., 3., -3., 4., -4., -5., 5., -6., 7., -7., 6., 8., -8.];

    #[test]
    fn what_a_model_does_smoothly_cancels_and_a_jump_does_not() {
        let nominal = [1.0, 1.0];
        // The second sample jumps on two ways of a pair each.
        let on_way = |way: usize| {
            let jumped = if [3, 12].contains(&way) { 8.0 } else { 1.0 };
            Some(vec![1.0 + 0.1 * OFF[way], jumped])
        };
        let e = decided_by_forks(&nominal, on_way);
        assert!(e[0] < 1e-12, "{e:?}");
        assert!((e[1] - (2.0 * 3.5_f64.powi(2) / 8.0).sqrt()).abs() < 1e-12, "{e:?}");
        let e = decided_by_forks(&nominal, |way| on_way(way).filter(|_| way != 2));
        assert!((e[1] - 3.5 / 7.0_f64.sqrt()).abs() < 1e-12, "{e:?}");
    }

    #[test]
    fn ways_of_a_pair_differ_from_the_model_in_opposite_senses() {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none");
        let bundle = cathforce_bundle::Bundle::open(&example).unwrap();
        let nominal = Setup::from(nominal(&bundle).unwrap());
        let priors = Priors::of(&bundle.rig.priors);
        let of = |way: usize| {
            let own = WAYS[way].apply(&nominal, &priors);
            let junctions_m = own.junctions_m;
            let (own, nominal) = (own.description, &nominal.description);
            let moved = own.effects.wall.registration;
            let radius_m = own.instrument.outer_radius_m - nominal.instrument.outer_radius_m;
            let friction = own.wall.friction_coefficient - nominal.wall.friction_coefficient;
            [radius_m, friction, moved.x_m, moved.y_m, moved.z_m, junctions_m]
        };
        for pair in OPPOSITE {
            let [up, down] = pair.map(of);
            assert_ne!(up, [0.0; 6]);
            assert!(up.iter().zip(down).all(|(up, down)| (up + down).abs() < 1e-12), "{pair:?}");
        }
    }

    #[test]
    fn a_trial_that_passes_a_fork_is_compared_without_what_that_decides() {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none");
        let bundle = cathforce_bundle::Bundle::open(&example).unwrap();
        let catheter = Catheter::new(&bundle).unwrap();
        let said = |number: &str| {
            let of_forks = |remark: &&String| remark.contains("are not scored");
            let mut remarks = catheter.remarks().iter().filter(of_forks);
            remarks.any(|remark| remark.starts_with(&format!("trial {number}")))
        };
        assert!(said("002") && !said("000"), "{:?}", catheter.remarks());
    }

    #[test]
    fn a_trial_that_forks_decide_altogether_is_compared_as_a_whole() {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none");
        let bundle = cathforce_bundle::Bundle::open(&example).unwrap();
        let catheter = Catheter::new(&bundle).unwrap();
        let samples = &catheter.trials()[0].samples;
        let open = |i: usize| samples[i].noise.hypot(samples[i].model);
        let beyond = |share: f64| {
            let decided = |i: usize| (i as f64) < share * samples.len() as f64;
            let e = |i: usize| if decided(i) { 3.0 * open(i) } else { open(i) };
            let e: Vec<f64> = (0..samples.len()).map(e).collect();
            left_out(samples, &e).into_iter().filter(|own| *own).count() as f64
        };
        assert!((beyond(0.2) / samples.len() as f64 - 0.2).abs() < 0.01);
        assert_eq!(beyond(0.6), 0.0);
    }
}
