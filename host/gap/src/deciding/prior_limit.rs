//! Recognises an explanation that is no gap, because its size is within the uncertainty of any setup.
//!
//! Nuisance parameters are refitted to first order. In a vessel with two bends, the second-order part of a
//! registration error within its prior looks like a gap, and the effect of that name explains it.

use crate::fitting::fit::Fit;
use crate::fitting::nuisance::NUISANCE_LIMIT;
use crate::plant::Plant;

/// Times the limit of a nuisance that an effect may be fitted to be, and still be the nuisance: a fit of
/// six parameters knows each no better.
const SLACK: f64 = 1.25;

/// The effect that alone explains a gap and is within the priors of the nuisances that it is.
pub fn nuisance(plant: &dyn Plant, best: &Fit) -> Option<usize> {
    let [effect] = best.effects[..] else { return None };
    let sds = plant.prior_sds(effect)?;
    let known = &plant.effects()[effect].parameters;
    let mut values = best.point.effects[effect].iter().zip(known).zip(sds);
    let most = SLACK * NUISANCE_LIMIT;
    values.all(|((value, p), sd)| (value - p.off).abs() <= most * sd).then_some(effect)
}

#[cfg(test)]
mod tests {
    use crate::diagnosis::report::{Diagnosis, Verdict};
    use crate::diagnosis::{diagnose, diagnose_given};
    use crate::plant::Point;
    use crate::toy::{Toy, effect, noise, parameter};

    /// What rises by `slope` while nuisances of 0.5 know nothing of it.
    fn toy(slope: f64) -> Toy<impl Fn(usize, &Point) -> f64> {
        let along = |i: usize| i as f64 / 400.0;
        let measured = (0..400).map(|i| slope * along(i) + 0.01 * noise(i));
        let predict = move |i: usize, point: &Point| point.effects[0][0] * along(i);
        let mut toy = Toy::new(0.01, 0.01, measured, predict).times(4);
        toy.effects = vec![effect("slope", vec![parameter("slope")], vec![vec![1.0]])];
        (toy.cheap, toy.prior_sds) = (false, Some(vec![0.5]));
        toy
    }

    fn answer(slope: f64) -> Diagnosis {
        diagnose(&toy(slope), "toy", &|_| {})
    }

    #[test]
    fn what_is_within_a_prior_is_no_gap_and_what_is_beyond_is_named() {
        let within = answer(1.1);
        assert_eq!((within.verdict, within.effects.len()), (Verdict::NoGap, 0));
        let said = within.remarks.iter().any(|remark| {
            remark.starts_with(
                "slope explains the error of the nominal model with a size that is within",
            )
        });
        assert!(said && within.details.maps.is_empty(), "{:?}", within.remarks);
        let beyond = answer(1.4);
        assert_eq!((beyond.verdict, &*beyond.effects[0].id), (Verdict::Named, "slope"));
        // Where it was asked for, it is told whatever its size.
        let asked = diagnose_given(&toy(1.1), "toy", &[0], &|_| {});
        assert_eq!(asked.verdict, Verdict::Named);
        let mut known = toy(1.1);
        known.prior_sds = None;
        assert_eq!(diagnose(&known, "toy", &|_| {}).verdict, Verdict::Named);
    }
}
