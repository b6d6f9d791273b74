//! Predictions of the coarse model, corrected by what a finer one changes where a fit ends.

use super::defects::{Correction, FORKED, GONE_WITH, mean_square};
use super::plant::Catheter;
use super::simulate::Setup;
use super::ways::{ASIDE, WAYS};
use crate::parallel::each_some;

impl Catheter {
    /// Predictions of all samples of a trial, corrected by what a finer model changes at `anchor`;
    /// `None` when a simulation breaks down.
    pub(super) fn predict(
        &self,
        trial: usize,
        setup: &Setup,
        nuisances: &[f64],
        (anchor, way): (&Setup, usize),
    ) -> Option<Vec<f64>> {
        let way = WAYS.get(way)?;
        let finer = way.finer(anchor, &self.priors);
        let correction = || self.correction(trial, &way.apply(anchor, &self.priors), finer.clone());
        let correction = self.defects.get(trial)?.of(&finer, correction)?;
        let coarse =
            WAYS.get(correction.aside)?.apply(&way.apply(setup, &self.priors), &self.priors);
        let coarse = self.coarse(trial, coarse, nuisances)?;
        Some(coarse.iter().zip(&correction.defect).map(|(c, d)| c + d).collect())
    }

    /// What the finer model changes, of the coarse model or of what stands aside of it.
    fn correction(&self, trial: usize, coarse: &Setup, finer: Setup) -> Option<Correction> {
        let none = vec![0.0; self.nuisances.len()];
        let finer = self.uncorrected(trial, finer, &none)?;
        let samples = &self.trials.get(trial)?.samples;
        let of = |aside: usize| {
            let coarse = self.coarse(trial, WAYS.get(aside)?.apply(coarse, &self.priors), &none)?;
            let defect: Vec<f64> = finer.iter().zip(&coarse).map(|(f, c)| f - c).collect();
            Some((mean_square(&defect, samples), Correction { aside, defect }))
        };
        let (size, own) = of(0)?;
        if size < FORKED {
            return Some(own);
        }
        let others = each_some(ASIDE, of);
        let nearest = others.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        let goes_with = nearest.filter(|(left, _)| *left < GONE_WITH * size);
        Some(goes_with.map_or(own, |(_, aside)| aside))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use cathforce_bundle::Bundle;

    use super::*;
    use crate::catheter::defects::goes_with;
    use crate::catheter::plant::COARSER;

    #[test]
    fn where_the_finer_model_goes_another_way_the_coarse_one_goes_with_it() {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none");
        let catheter = Catheter::new(&Bundle::open(&example).unwrap()).unwrap();
        let none = vec![0.0; catheter.nuisances.len()];
        let mut away = 0;
        for friction in [0.7, 0.8, 1.0, 1.2] {
            let mut anchor = Setup::from(catheter.nominal.clone());
            anchor.description.wall.friction_coefficient *= friction;
            let finer = WAYS[0].finer(&anchor, &catheter.priors);
            for (trial, own) in catheter.trials.iter().enumerate() {
                let found = catheter.correction(trial, &anchor, finer.clone()).unwrap();
                let exact = catheter.uncorrected(trial, finer.clone(), &none).unwrap();
                let left = |aside: usize| {
                    let coarse = WAYS[aside].apply(&anchor, &catheter.priors);
                    let coarse = catheter.coarse(trial, coarse, &none).unwrap();
                    let defect: Vec<f64> = exact.iter().zip(&coarse).map(|(f, c)| f - c).collect();
                    mean_square(&defect, &own.samples)
                };
                let (first, taken) = (left(0), left(found.aside));
                assert!(found.aside == 0 || (first >= FORKED && taken < GONE_WITH * first));
                assert!(
                    first < FORKED
                        || ASIDE.iter().all(|way| left(*way) >= taken.min(GONE_WITH * first))
                );
                away += usize::from(found.aside != 0);
                // At the anchor itself the finer model is what is predicted.
                let at = catheter.predict(trial, &anchor, &none, (&anchor, 0)).unwrap();
                let off = at.iter().zip(&exact).map(|(a, e)| (a - e).abs());
                assert!(off.fold(0.0, f64::max) < 1e-12);
            }
        }
        assert!(away > 0, "no fork was met");
    }

    #[test]
    fn half_the_links_play_a_trial_in_which_they_make_little_difference() {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none");
        let catheter = Catheter::new(&Bundle::open(&example).unwrap()).unwrap();
        let none = vec![0.0; catheter.nuisances.len()];
        let nominal = Setup::from(catheter.nominal.clone());
        let mut half = nominal.clone();
        half.description.solver.link_length_m *= COARSER;
        for (trial, own) in catheter.trials.iter().enumerate() {
            let finer = WAYS[0].finer(&nominal, &catheter.priors);
            let finer = catheter.uncorrected(trial, finer, &none).unwrap();
            let half = catheter.uncorrected(trial, half.clone(), &none).unwrap();
            let changed: Vec<f64> = finer.iter().zip(&half).map(|(f, h)| f - h).collect();
            assert_eq!(catheter.coarser[trial] == COARSER, goes_with(&changed, &own.samples));
        }
    }
}
