//! Fits the effects that a user requests, without a search.

use crate::fitting::fit::{Depth, Start};
use crate::scoring::candidate::Candidate;
use crate::searching::selection::Selection;
use crate::searching::selector::Selector;

impl Selector<'_> {
    /// These effects and no others, each started from its switch-on values with those before it
    /// in place. `None` when a simulation breaks down.
    pub fn take(&self, nominal: Candidate, effects: &[usize]) -> Option<Selection> {
        let mut singles = vec![None; self.problem.plant.effects().len()];
        let (mut failed, mut best) = (Vec::new(), nominal.clone());
        let mut path = vec![(Vec::new(), nominal.score.clone())];
        let mut on: Vec<usize> = Vec::new();
        for &effect in effects {
            if on.contains(&effect) {
                continue;
            }
            on.push(effect);
            let nuisances = self.nuisances_at(&best.fit)?;
            let from = Start::Fit(&best.fit);
            let glance = self.candidate(Depth::Glance, &nuisances, from, &on, Some(effect))?;
            let from = Start::Fit(&glance.fit);
            let whole = self.candidate(Depth::Whole, &nuisances, from, &on, None)?;
            if whole.fit.failed {
                failed.push(effect);
            }
            if on.len() == 1 {
                singles[effect] = Some(whole.clone());
            }
            path.push((on.clone(), whole.score.clone()));
            best = whole;
        }
        let nuisances = self.nuisances_at(&best.fit)?;
        let best = self.polished(best, &nuisances);
        self.compared(nominal, best, nuisances, singles, failed, path)
    }
}
