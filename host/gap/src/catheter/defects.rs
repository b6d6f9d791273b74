//! Defect correction of one trial: the difference between the finer model and the coarse one.
//!
//! Near a bifurcation, the finer model and the coarse model may take different branches at the same
//! parameters. Their difference is then a property of the two branches, not of the resolution, and a fit
//! that adds it cannot move away from where it began. In that case the coarse model is shifted, within the
//! uncertainty of the setup, to a branch on which it agrees with the finer one.

use std::sync::{Arc, Mutex};

use super::simulate::Setup;
use crate::plant::Sample;

/// Corrections that are kept: of the nominal model, and of the last ones.
const KEPT: usize = 256;
/// Mean square of a correction, in squares of the sensors' noise, from which on the coarse model may
/// have gone another way, and the share of it that is left where it goes with the finer one.
pub const FORKED: f64 = 2.0;
pub const GONE_WITH: f64 = 0.5;

/// What a finer model changes of a trial's samples.
#[derive(Debug)]
pub struct Correction {
    /// The way of [`WAYS`](super::ways::WAYS) on which the coarse model goes with the finer one.
    pub aside: usize,
    /// Finer model less coarse one.
    pub defect: Vec<f64>,
}

/// Corrections of one trial.
#[derive(Default)]
pub struct Defects {
    kept: Mutex<Vec<Kept>>,
}

type Kept = (Setup, Arc<Correction>);

impl Defects {
    /// The correction by a model, computed when it is not known. `None` when that fails.
    pub fn of(
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

/// Whether a correction is that of a coarse model that goes with the finer one.
pub fn goes_with(defect: &[f64], samples: &[Sample]) -> bool {
    mean_square(defect, samples) < FORKED
}

/// Of a correction, in squares of the sensors' noise.
pub fn mean_square(defect: &[f64], samples: &[Sample]) -> f64 {
    let square = |(defect, sample): (&f64, &Sample)| (defect / sample.noise).powi(2);
    defect.iter().zip(samples).map(square).sum::<f64>() / samples.len().max(1) as f64
}
