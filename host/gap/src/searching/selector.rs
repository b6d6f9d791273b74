//! Fits and scores one set of effects: what every part of the search asks for.

use crate::fitting::fit::{Depth, Fit, Start, fit};
use crate::fitting::nuisance::Nuisances;
use crate::fitting::problem::Problem;
use crate::plant::Point;
use crate::scoring::candidate::Candidate;
use crate::scoring::folds::Folds;
use crate::scoring::score::score;

/// Fits, scores and compares models of one problem.
pub struct Selector<'a> {
    pub problem: &'a Problem<'a>,
    pub folds: &'a Folds,
}

impl Selector<'_> {
    /// Every effect off. `None` when not even that can be simulated.
    pub fn nominal(&self) -> Option<Candidate> {
        let point = Point::nominal(self.problem.plant);
        let base = self.problem.residuals(&point)?;
        let nuisances = Nuisances::at(self.problem, &point, &base)?;
        let nominal = self.candidate(Depth::Whole, &nuisances, Start::Point(&point), &[], None)?;
        Some(self.without_gap(&nuisances, &nominal).unwrap_or(nominal))
    }

    /// A fit and its score. Where simulations cost nothing, nuisances are linearised once more
    /// where it ends; where they do, a whole fit goes on from there with simulations corrected
    /// there, and a polished one asks the finer model itself.
    pub fn candidate(
        &self,
        depth: Depth,
        nuisances: &Nuisances,
        start: Start<'_>,
        effects: &[usize],
        fresh: Option<usize>,
    ) -> Option<Candidate> {
        let cheap = self.problem.plant.cheap();
        let corrects = !cheap && self.problem.rules.search.corrects;
        let finer = start.point().clone().finer();
        let is_last = depth == Depth::Polished && !cheap;
        let start = if is_last { Start::Point(&finer) } else { start };
        let mut found = fit(self.problem, nuisances, start, effects, fresh, depth)?;
        if !effects.is_empty() && cheap {
            let nuisances = self.nuisances_at(&found)?;
            let failed = found.failed;
            found = fit(self.problem, &nuisances, Start::Fit(&found), effects, None, depth)?;
            found.failed |= failed;
        } else if depth == Depth::Whole && corrects && !found.failed {
            found = self.corrected(nuisances, &found, depth).unwrap_or(found);
        }
        let score = score(self.problem, self.folds, &found);
        Some(Candidate { fit: found, score })
    }

    pub fn nuisances_at(&self, fit: &Fit) -> Option<Nuisances> {
        let raw: Vec<_> = fit.trials.iter().map(|trial| trial.raw.clone()).collect();
        Nuisances::at(self.problem, &fit.point, &raw)
    }
}
