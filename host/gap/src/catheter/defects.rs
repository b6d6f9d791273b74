//! What finer models change of a trial's samples (defect correction, `crate::correct`).
//!
//! Where the tip turns on less than anyone knows, the finer model and that of the diagnosis may go
//! different ways at the same parameters. What one changes of the other is then true there and
//! nowhere else, and every fit stays where it began. So the coarse model stands aside of where it
//! should, by no more than what nobody knows, if it then goes with the finer one.

use std::sync::{Arc, Mutex};

use rayon::prelude::*;

use super::Catheter;
use super::simulate::Setup;
use super::ways::{ASIDE, WAYS};
use crate::plant::Sample;

/// Corrections that are kept: of the nominal model, and of the last ones.
const KEPT: usize = 256;
/// Mean square of a correction, in squares of the sensors' noise, from which on the coarse model may
/// have gone another way, and the share of it that is left where it goes with the finer one.
const FORKED: f64 = 2.0;
const GONE_WITH: f64 = 0.5;

/// What a finer model changes of a trial's samples.
#[derive(Debug)]
pub struct Correction {
    /// The way of [`WAYS`] on which the coarse model goes with the finer one.
    aside: usize,
    /// Finer model less coarse one.
    defect: Vec<f64>,
}

/// Corrections of one trial.
#[derive(Default)]
pub struct Defects {
    kept: Mutex<Vec<Kept>>,
}

type Kept = (Setup, Arc<Correction>);

impl Defects {
    /// The correction by a model, computed when it is not known. `None` when that fails.
    fn of(
        &self,
        finer: &Setup,
        compute: impl FnOnce() -> Option<Correction>,
    ) -> Option<Arc<Correction>> {
        // A poisoned lock only means that another trial panicked: nothing kept is half done.
        let lock = || self.kept.lock().unwrap_or_else(|e| e.into_inner());
        if let Some((_, known)) = lock().iter().find(|(own, _)| own == finer) {
            return Some(Arc::clone(known));
        }
        let found = Arc::new(compute()?);
        let mut kept = lock();
        // The first one is the nominal model's and stays.
        if kept.len() >= KEPT {
            kept.remove(1);
        }
        kept.push((finer.clone(), Arc::clone(&found)));
        Some(found)
    }
}

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
        let others: Vec<_> = ASIDE.into_par_iter().filter_map(of).collect();
        let nearest = others.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        let goes_with = nearest.filter(|(left, _)| *left < GONE_WITH * size);
        Some(goes_with.map_or(own, |(_, aside)| aside))
    }
}

/// Whether a correction is that of a coarse model that goes with the finer one.
pub fn goes_with(defect: &[f64], samples: &[Sample]) -> bool {
    mean_square(defect, samples) < FORKED
}

/// Of a correction, in squares of the sensors' noise.
fn mean_square(defect: &[f64], samples: &[Sample]) -> f64 {
    let square = |(defect, sample): (&f64, &Sample)| (defect / sample.noise).powi(2);
    defect.iter().zip(samples).map(square).sum::<f64>() / samples.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use cathforce_bundle::Bundle;

    use super::super::COARSER;
    use super::*;

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
