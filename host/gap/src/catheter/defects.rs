//! What finer models change of a trial's samples, kept by the model.

use std::sync::{Arc, Mutex};

use cathforce_mechanics::Description;

/// Corrections that are kept: of the nominal model, and of the last ones.
const KEPT: usize = 256;

/// Corrections of one trial.
#[derive(Default)]
pub struct Defects {
    kept: Mutex<Vec<Kept>>,
}

type Kept = (Description<f64>, Arc<Vec<f64>>);

impl Defects {
    /// The correction by a model, computed when it is not known. `None` when that fails.
    pub fn of(
        &self,
        finer: &Description<f64>,
        compute: impl FnOnce() -> Option<Vec<f64>>,
    ) -> Option<Arc<Vec<f64>>> {
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
