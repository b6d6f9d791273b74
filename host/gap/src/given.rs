//! Effects that somebody asks for, fitted without choosing.

use crate::fit::Depth;
use crate::select::{Candidate, Selection, Selector, Step};

impl Selector<'_> {
    /// These effects and no others, each started from its switch-on values with those before it
    /// in place. `None` when a simulation breaks down.
    pub fn take(&self, nominal: Candidate, effects: &[usize]) -> Option<Selection> {
        let mut selection = Selection {
            best: nominal.clone(),
            path: vec![(Vec::new(), nominal.score.clone())],
            singles: vec![None; self.problem.plant.effects().len()],
            steps: Vec::new(),
            failed: Vec::new(),
            nominal,
        };
        let mut on: Vec<usize> = Vec::new();
        for &effect in effects {
            if on.contains(&effect) {
                continue;
            }
            on.push(effect);
            let nuisances = self.nuisances_at(&selection.best.fit)?;
            let from = &selection.best.fit.point;
            let glance = self.candidate_to(Depth::Glance, &nuisances, from, &on, Some(effect))?;
            let from = &glance.fit.point;
            let whole = self.candidate_to(Depth::Whole, &nuisances, from, &on, None)?;
            if whole.fit.failed {
                selection.failed.push(effect);
            }
            if on.len() == 1 {
                selection.singles[effect] = Some(whole.clone());
            }
            selection.path.push((on.clone(), whole.score.clone()));
            selection.best = whole;
        }
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
