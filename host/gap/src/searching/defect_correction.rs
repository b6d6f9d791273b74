//! Fits whose coarse simulations are corrected where the fit ends.
//!
//! Where simulations are costly, a plant simulates coarsely and adds the difference of a finer model at one
//! point, the anchor (defect correction, Stetter 1978):
//!
//! > f(θ) = c(θ) + d(θ₀),   d(θ₀) = F(θ₀) − c(θ₀)
//!
//! A fit that ends at θ takes θ as its new anchor and continues. At its fixed point the residual is that of
//! the finer model. The best model is fitted to the end with the finer model itself.
//!
//! Near a bifurcation a trial may be simulated on the wrong branch. A trial whose error is far above that
//! of the others is tried with perturbed models that are as plausible.

use crate::fitting::fit::{Depth, Fit, Start, fit};
use crate::fitting::nuisance::Nuisances;
use crate::parallel::{each_or_none, each_some};
use crate::plant::Point;
use crate::scoring::candidate::Candidate;

use crate::scoring::score::score;
use crate::searching::selector::Selector;

/// Trials that are tried on other ways.
#[derive(Clone, Copy)]
enum Tried {
    /// Those far behind the others.
    Behind,
    /// All above the floor.
    All,
}

impl Selector<'_> {
    /// The fit, gone on from where it ended with simulations corrected there; `None` where that
    /// changes nothing or a simulation breaks down.
    ///
    /// See docs/explanation/diagnosis.md (D6).
    pub fn corrected(&self, nuisances: &Nuisances, found: &Fit, depth: Depth) -> Option<Fit> {
        let point = self.on_best_ways(nuisances, found.point.clone().anchored(), Tried::Behind)?;
        if point.anchor == found.point.anchor {
            return None;
        }
        let start = Start::Corrected { fit: found, point: &point };
        let next = fit(self.problem, nuisances, start, &found.effects, None, depth)?;
        Some(Fit { tried: found.tried.clone(), ..next })
    }

    /// The nominal model with every trial on the way that explains it, where next to no gap is left
    /// and none is then: what forks decide is no gap. `None` where there is more, or still some.
    pub fn without_gap(&self, nuisances: &Nuisances, nominal: &Candidate) -> Option<Candidate> {
        let rules = &self.problem.rules;
        let is_near =
            (rules.verdict.at_floor..rules.ways.next_to_none).contains(&nominal.score.worst());
        if self.problem.plant.ways() < 2 || !rules.ways.tried || !is_near {
            return None;
        }
        let found = &nominal.fit;
        let point = self.on_best_ways(nuisances, found.point.clone().anchored(), Tried::All)?;
        let start = Start::Corrected { fit: found, point: &point };
        let fit = fit(self.problem, nuisances, start, &[], None, Depth::Whole)?;
        let score = score(self.problem, self.folds, &fit);
        (score.worst() < rules.verdict.at_floor).then_some(Candidate { fit, score })
    }

    /// The point with every trial on the way that explains it, of those that may be taken.
    fn on_best_ways(&self, nuisances: &Nuisances, point: Point, tried: Tried) -> Option<Point> {
        let (plant, rules) = (self.problem.plant, &self.problem.rules.ways);
        if plant.ways() < 2 || !rules.tried {
            return Some(point);
        }
        let energy = |trial: usize, point: &Point| {
            let raw = self.problem.residual(trial, point)?;
            Some(nuisances.refit(trial, &raw).energy() / raw.len() as f64)
        };
        let on_first = |trial: usize| {
            let own = energy(trial, &point)?;
            if point.anchor.ways.get(trial).is_none_or(|way| *way == 0) {
                return Some((own, false));
            }
            let first = energy(trial, &point.clone().on_way(trial, 0));
            let first = first.filter(|first| *first <= rules.first * own);
            Some(first.map_or((own, false), |first| (first, true)))
        };
        let found: Vec<(f64, bool)> = each_or_none(0..plant.trials().len(), on_first)?;
        let mut sorted: Vec<f64> = found.iter().map(|(own, _)| *own).collect();
        sorted.sort_by(f64::total_cmp);
        let above_floor = |energy: f64| energy - 1.0;
        let behind = match tried {
            Tried::Behind => {
                rules.behind * above_floor(sorted[(sorted.len() - 1) / 2]).max(rules.near)
            }
            Tried::All => 0.0,
        };
        let mut chosen = point.clone();
        for (trial, (own, is_first)) in found.into_iter().enumerate() {
            if is_first {
                chosen = chosen.on_way(trial, 0);
            }
            if above_floor(own) <= behind {
                continue;
            }
            let tried: Vec<(f64, usize)> = each_some(0..plant.ways(), |way| {
                let left = energy(trial, &point.clone().on_way(trial, way))?;
                (above_floor(left) < rules.left * above_floor(own)).then_some((left, way))
            });
            let best = tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((_, way)) = best {
                chosen = chosen.on_way(trial, way);
            }
        }
        Some(chosen)
    }
}

#[cfg(test)]
mod tests {
    use super::Tried;
    use crate::diagnosis::diagnose;
    use crate::diagnosis::report::{Diagnosis, Verdict};
    use crate::fitting::fit::{Depth, Start, fit};
    use crate::plant::{Plant, Point};
    use crate::toy::{Toy, effect, explained_by, noise, parameter};

    const SAMPLES: usize = 400;
    const NOISE: f64 = 0.01;
    const TRUE: f64 = 2.0;

    fn along(i: usize) -> f64 {
        i as f64 / SAMPLES as f64
    }

    /// Coarse simulations are a tenth too steep.
    fn predict(i: usize, point: &Point) -> f64 {
        let (finer, coarse) = (|slope: f64| slope, |slope: f64| 1.1 * slope);
        let (here, anchor) = (point.effects[0][0], point.anchor.effects[0][0]);
        let slope = match point.anchor.is_everywhere {
            true => finer(here),
            false => coarse(here) + finer(anchor) - coarse(anchor),
        };
        slope * along(i)
    }

    fn toy(trials: usize, forks: Vec<f64>) -> impl Plant {
        rising(TRUE, trials, forks)
    }

    /// The same without an effect.
    fn level(trials: usize, forks: Vec<f64>) -> impl Plant {
        rising(0.0, trials, forks)
    }

    fn rising(slope: f64, trials: usize, forks: Vec<f64>) -> impl Plant {
        let measured = (0..SAMPLES).map(|i| slope * along(i) + NOISE * noise(i));
        let mut toy = Toy::new(0.01, NOISE, measured, predict).times(trials);
        toy.effects = vec![effect("slope", vec![parameter("slope")], vec![vec![1.0]])];
        (toy.cheap, toy.forks) = (false, forks);
        toy
    }

    #[test]
    fn a_fit_goes_on_from_where_it_ended_and_is_polished_by_the_finer_model() {
        let plant = toy(1, vec![0.0]);
        explained_by(&plant, &[], |selector, selection| {
            let (nominal, nuisances) = (&selection.nominal.fit, selection.nuisances.as_ref());
            let (start, nuisances) = (Start::Fit(nominal), nuisances.unwrap());
            let once = fit(selector.problem, nuisances, start, &[0], Some(0), Depth::Whole);
            let off = (once.unwrap().point.effects[0][0] - TRUE).abs();
            assert!(off > 0.15, "{off}");
            let whole = selector.candidate(Depth::Whole, nuisances, start, &[0], Some(0)).unwrap();
            let off = (whole.fit.point.effects[0][0] - TRUE).abs();
            assert!(off < 0.03, "{off}");
            let start = Start::Fit(&whole.fit);
            let last = selector.candidate(Depth::Polished, nuisances, start, &[0], None).unwrap();
            let off = (last.fit.point.effects[0][0] - TRUE).abs();
            assert!(off < 0.005, "{off}");
        });
    }

    #[test]
    fn a_trial_that_is_far_behind_takes_the_way_that_explains_it() {
        let ways = |forks: Vec<f64>| {
            explained_by(&toy(6, forks), &[0], |_, selection| {
                selection.best.fit.point.anchor.ways.to_vec()
            })
        };
        assert_eq!(ways(vec![-0.3, -0.4, 0.0]), [0, 0, 0, 0, 0, 2]);
        // No way is much better.
        assert!(ways(vec![-0.3, -0.29]).iter().all(|way| *way == 0));
        // None is far behind.
        assert!(ways(vec![0.0, 0.001]).iter().all(|way| *way == 0));
    }

    #[test]
    fn what_counts_of_a_way_is_what_it_leaves_above_the_floor() {
        let ways = |forks: Vec<f64>| {
            explained_by(&level(6, forks), &[], |_, selection| {
                selection.nominal.fit.point.anchor.ways.to_vec()
            })
        };
        // 2.4 floors above it, and 1 on the other way.
        assert_eq!(ways(vec![0.0155, 0.0098]), [0, 0, 0, 0, 0, 1]);
        assert!(ways(vec![0.0155, 0.0115]).iter().all(|way| *way == 0));
        assert!(ways(vec![0.0055, 0.0]).iter().all(|way| *way == 0), "it is not behind");
    }

    #[test]
    fn what_a_fork_decides_is_no_gap_next_to_the_floor() {
        let answer = |forks: Vec<f64>| diagnose(&level(2, forks), "toy", &crate::unwatched);
        let forks = |answer: &Diagnosis| {
            answer.remarks.iter().any(|own| own.contains("either side of a dividing wall"))
        };
        let found = answer(vec![0.0092, 0.0]);
        assert_eq!(found.verdict, Verdict::NoGap);
        assert!(forks(&found), "the trial is named: {:?}", found.remarks);
        let found = answer(vec![0.0092, 0.0092]);
        assert!(!forks(&found), "{:?}", found.remarks);
        assert_ne!(answer(vec![0.02, 0.02]).verdict, Verdict::NoGap, "there is a gap");
    }

    #[test]
    fn a_trial_goes_its_first_way_again_where_that_explains_as_much() {
        let again = |forks: Vec<f64>| {
            explained_by(&toy(6, forks), &[0], |selector, selection| {
                let point = selection.best.fit.point.clone().anchored().on_way(5, 1);
                let nuisances = selection.nuisances.as_ref().unwrap();
                selector.on_best_ways(nuisances, point, Tried::Behind).unwrap().anchor.ways[5]
            })
        };
        assert_eq!(again(vec![0.0, 1e-4]), 0);
        assert_eq!(again(vec![-0.3, 0.0]), 1);
    }
}
