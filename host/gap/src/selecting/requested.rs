//! Fits the effects that a user requests, without a selection.

use crate::fitting::fit::{Depth, Start};
use crate::scoring::candidate::Candidate;
use crate::selecting::select::Selector;
use crate::selecting::selection::{Selection, Step};

impl Selector<'_> {
    /// These effects and no others, each started from its switch-on values with those before it
    /// in place. `None` when a simulation breaks down.
    pub fn take(&self, nominal: Candidate, effects: &[usize]) -> Option<Selection> {
        let mut selection = Selection {
            best: nominal.clone(),
            path: vec![(Vec::new(), nominal.score.clone())],
            singles: vec![None; self.problem.plant.effects().len()],
            shown: vec![None; self.problem.plant.effects().len()],
            steps: Vec::new(),
            failed: Vec::new(),
            nuisances: None,
            without: Vec::new(),
            pairs: Vec::new(),
            exchanged: Vec::new(),
            extended: Vec::new(),
            nominal,
        };
        let mut on: Vec<usize> = Vec::new();
        for &effect in effects {
            if on.contains(&effect) {
                continue;
            }
            on.push(effect);
            let nuisances = self.nuisances_at(&selection.best.fit)?;
            let from = Start::Fit(&selection.best.fit);
            let glance = self.candidate(Depth::Glance, &nuisances, from, &on, Some(effect))?;
            let from = Start::Fit(&glance.fit);
            let whole = self.candidate(Depth::Whole, &nuisances, from, &on, None)?;
            if whole.fit.failed {
                selection.failed.push(effect);
            }
            if on.len() == 1 {
                selection.singles[effect] = Some(whole.clone());
            }
            selection.path.push((on.clone(), whole.score.clone()));
            selection.best = whole;
        }
        self.complete(&mut selection)?;
        let best = &selection.best;
        let step = |&effect: &usize| Step {
            effect,
            point: best.fit.point.clone(),
            score: best.score.clone(),
            rivals: Vec::new(),
        };
        selection.steps = on.iter().map(step).collect();
        Some(selection)
    }
}
