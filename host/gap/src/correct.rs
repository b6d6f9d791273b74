//! Fits that go on with simulations corrected where they ended.
//!
//! Where simulations cost something, a plant plays them coarsely, and adds what a finer model
//! changes at one point, the anchor (defect correction, Stetter 1978):
//!
//! > f(θ) = c(θ) + d(θ₀),   d(θ₀) = F(θ₀) − c(θ₀)
//!
//! A fit that ends at θ takes θ as its anchor and goes on; where it rests, its residual is that of
//! the finer model. The best model is fitted to the end with the finer model itself. At a fork of the vessel the tip turns on less than any model knows: a trial that
//! is left far behind the others is tried with other models that are as fine.

use rayon::prelude::*;

use crate::fit::{Depth, Fit, Start, fit};
use crate::nuisance::Nuisances;
use crate::plant::Point;
use crate::select::Selector;

/// Times the median energy of the trials from which on one of them is far behind, and the share of
/// it that must go for another way to be taken.
const BEHIND: f64 = 1.8;
const OTHER_WAY: f64 = 0.5;

impl Selector<'_> {
    /// The fit, gone on from where it ended with simulations corrected there; `None` where that
    /// changes nothing or a simulation breaks down.
    pub fn corrected(&self, nuisances: &Nuisances, found: &Fit, depth: Depth) -> Option<Fit> {
        let point = self.on_best_ways(nuisances, found.point.clone().anchored())?;
        if point.anchor == found.point.anchor {
            return None;
        }
        let start = Start::Corrected { fit: found, point: &point };
        let next = fit(self.problem, nuisances, start, &found.effects, None, depth)?;
        Some(Fit { tried: found.tried.clone(), ..next })
    }

    /// The point with other finer models for trials that are far behind, where one explains them.
    fn on_best_ways(&self, nuisances: &Nuisances, point: Point) -> Option<Point> {
        if self.problem.plant.ways() < 2 {
            return Some(point);
        }
        let energy = |trial: usize, point: &Point| {
            let raw = self.problem.residual(trial, point)?;
            Some(nuisances.refit(trial, &raw).energy() / raw.len() as f64)
        };
        let trials = 0..self.problem.plant.trials().len();
        let energies: Option<Vec<f64>> =
            trials.into_par_iter().map(|trial| energy(trial, &point)).collect();
        let energies = energies?;
        let mut sorted = energies.clone();
        sorted.sort_by(f64::total_cmp);
        let median = sorted[(sorted.len() - 1) / 2].max(1.0);
        let mut chosen = point.clone();
        for (trial, own) in energies.into_iter().enumerate() {
            if own <= BEHIND * median {
                continue;
            }
            let ways = 0..self.problem.plant.ways();
            let tried: Vec<(f64, usize)> = ways
                .into_par_iter()
                .filter_map(|way| Some((energy(trial, &point.clone().on_way(trial, way))?, way)))
                .collect();
            let best = tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((_, way)) = best.filter(|(other, _)| *other < OTHER_WAY * own) {
                chosen = chosen.on_way(trial, way);
            }
        }
        Some(chosen)
    }
}
