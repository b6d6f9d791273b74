//! Snaps, which all other figures exclude: how many measured snaps a model predicts, and how far off it
//! is in insertion and time. A force that jumps 20 ms late is off by hundreds of millinewtons for 20 ms;
//! the informative figure is where it jumps.

use cathforce_recording::snap::Snap;
use serde::Serialize;

use crate::fitting::fit::Fit;
use crate::fitting::problem::{Coordinate, Problem};
use crate::parallel::each_or_none;
use crate::plant::Point;
use crate::scoring::folds::{FoldKind, Folds};
use crate::scoring::score::fold_steps;

/// Snaps farther apart than this are two \[s\]: at the speeds at which instruments are fed, some 10 mm.
const SAME_S: f64 = 0.5;

/// How a model's snaps compare with those that were measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SnapsOff {
    /// Measured ones that the model has too.
    pub found: usize,
    /// Of the model, not measured.
    pub additional: usize,
    /// Mean distance of those that were found, by the insertion at which they happen \[m\].
    pub insertion_m: Option<f64>,
    /// The same in time \[s\].
    pub time_s: Option<f64>,
}

/// Snaps, which all other figures leave out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SnapFigures {
    pub measured: usize,
    pub before: SnapsOff,
    pub after: SnapsOff,
}

impl SnapFigures {
    /// In words.
    pub fn sentence(&self) -> String {
        let of = |own: &SnapsOff| {
            let off = own.insertion_m.zip(own.time_s).map_or(String::new(), |(way_m, time_s)| {
                format!("{:.1} mm and {:.0} ms off on average, ", 1e3 * way_m, 1e3 * time_s)
            });
            format!("{} ({off}{} others)", own.found, own.additional)
        };
        let (before, after) = (of(&self.before), of(&self.after));
        format!(
            "snaps measured: {}; of these the model has {before} before, {after} after",
            self.measured
        )
    }
}

/// Snaps of the trials, each held out in turn: measured, and as the nominal model and what explains the
/// gap have them. `None` where there are none, where trials are not held out whole, and where a
/// simulation breaks down.
pub fn figures(
    problem: &Problem<'_>,
    folds: &Folds,
    before: &Fit,
    after: &Fit,
) -> Option<SnapFigures> {
    let plant = problem.plant;
    if folds.kind != FoldKind::Trial {
        return None;
    }
    let off = |fit: &Fit| {
        let points = held_out(problem, folds, fit);
        let pairs = each_or_none(points.into_iter().enumerate(), |(trial, point)| {
            Some(Pairs::of(&plant.snaps(trial), &plant.predicted_snaps(trial, &point)?))
        });
        Some(Pairs::all(pairs?).off())
    };
    let measured = problem.trials().into_iter().map(|trial| plant.snaps(trial).len()).sum();
    let found = SnapFigures { measured, before: off(before)?, after: off(after)? };
    let is_any = measured + found.before.additional + found.after.additional > 0;
    is_any.then_some(found)
}

/// By trial, the finer model as it is fitted to the others, with the trial's own nuisances.
fn held_out(problem: &Problem<'_>, folds: &Folds, fit: &Fit) -> Vec<Point> {
    let steps = fold_steps(problem, folds, fit);
    let of = |(trial, step): (usize, &nalgebra::DVector<f64>)| {
        let mut point = fit.point.clone().finer();
        for (coordinate, step) in fit.coordinates.iter().zip(step.iter()) {
            if let Coordinate::Effect { effect, parameter } = *coordinate {
                point.effects[effect][parameter] += step;
            }
        }
        let estimates = &fit.trials[trial].refit.estimate;
        let own = problem.plant.nuisances().iter().zip(estimates);
        point.nuisances = own.map(|(nuisance, estimate)| nuisance.sd * estimate).collect();
        point
    };
    steps.iter().enumerate().map(of).collect()
}

/// Measured snaps and a model's.
#[derive(Clone, Debug, Default, PartialEq)]
struct Pairs {
    /// By how much the model's is farther in \[m\] and later \[s\].
    off: Vec<(f64, f64)>,
    /// Of the model alone.
    additional: usize,
}

impl Pairs {
    /// Each measured snap with the model's that is nearest in time and no other's.
    fn of(measured: &[Snap], predicted: &[Snap]) -> Self {
        let mut rest = predicted.to_vec();
        let mut off = Vec::new();
        for own in measured {
            let apart = |other: &Snap| (other.t_s - own.t_s).abs();
            let near = rest.iter().enumerate().filter(|(_, other)| apart(other) <= SAME_S);
            let nearest = near.min_by(|(_, a), (_, b)| apart(a).total_cmp(&apart(b)));
            if let Some((index, _)) = nearest {
                let other = rest.remove(index);
                off.push((other.insertion_m - own.insertion_m, other.t_s - own.t_s));
            }
        }
        Self { off, additional: rest.len() }
    }

    fn all(trials: Vec<Self>) -> Self {
        trials.into_iter().fold(Self::default(), |mut all, own| {
            all.off.extend(own.off);
            Self { additional: all.additional + own.additional, ..all }
        })
    }

    fn off(&self) -> SnapsOff {
        let mean = |of: fn(&(f64, f64)) -> f64| {
            let sum: f64 = self.off.iter().map(of).sum();
            (!self.off.is_empty()).then(|| sum / self.off.len() as f64)
        };
        SnapsOff {
            found: self.off.len(),
            additional: self.additional,
            insertion_m: mean(|(insertion_m, _)| insertion_m.abs()),
            time_s: mean(|(_, time_s)| time_s.abs()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::diagnose;
    use crate::plant::Plant;
    use crate::toy::{Toy, effect, noise, parameter, snap};

    #[test]
    fn a_snap_belongs_to_the_nearest_and_to_no_other() {
        let measured = [1.0, 2.0, 9.0].map(snap);
        let predicted = [1.75, 2.1, 5.0].map(snap);
        let pairs = Pairs::of(&measured, &predicted);
        // The one at 1.75 s is too far from the first, and the second has a nearer one.
        assert_eq!((pairs.off.len(), pairs.additional), (1, 2));
        let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(close(pairs.off[0].0, 0.001) && close(pairs.off[0].1, 0.1), "{pairs:?}");
        assert_eq!(Pairs::of(&[], &predicted).additional, 3);
    }

    #[test]
    fn what_is_early_does_not_make_up_for_what_is_late() {
        let early = Pairs { off: vec![(-1e-3, -0.05)], additional: 1 };
        let late = Pairs { off: vec![(3e-3, 0.15)], additional: 2 };
        let off = Pairs::all(vec![early, Pairs::default(), late]).off();
        assert_eq!((off.found, off.additional), (2, 3));
        assert!((off.insertion_m.unwrap() - 2e-3).abs() < 1e-12, "{off:?}");
        assert!((off.time_s.unwrap() - 0.1).abs() < 1e-12, "{off:?}");
        assert_eq!(Pairs::default().off().time_s, None);
    }

    /// Data of four trials that rise by 5, by `last` in the last one; its effect explains any.
    fn rising(last: f64, snaps_s: Vec<f64>) -> Toy<impl Fn(usize, &Point) -> f64> {
        let along = |i: usize| i as f64 / 400.0;
        let measured = (0..400).map(|i| 5.0 * along(i) + 0.01 * noise(i));
        let predict = move |i: usize, point: &Point| point.effects[0][0] * along(i);
        let mut toy = Toy::new(0.01, 0.01, measured, predict).times(4);
        toy = toy.last_is(|value| value * last / 5.0);
        toy.effects = vec![effect("slope", vec![parameter("slope")], vec![vec![1.0]])];
        toy.snaps_s = snaps_s;
        toy
    }

    #[test]
    fn a_snap_is_where_the_fit_to_the_other_trials_has_it() {
        let snaps = |toy: &dyn Plant| diagnose(toy, "toy", &crate::unwatched).gap.snaps;
        let late = diagnose(&rising(5.0, vec![5.1; 4]), "toy", &crate::unwatched);
        let found = late.gap.snaps.unwrap();
        assert!(found.sentence().starts_with("snaps measured: 4; of these"));
        let (before, after) = (found.before, found.after);
        assert_eq!((found.measured, before.found, before.additional), (4, 0, 4), "{found:?}");
        assert_eq!((after.found, after.additional), (4, 0), "{found:?}");
        assert!((after.time_s.unwrap() - 0.1).abs() < 5e-3, "{found:?}");
        assert!((after.insertion_m.unwrap() - 1e-3).abs() < 5e-5, "{found:?}");
        // The others do not know the slope of the last one, which pulls at theirs by a third.
        let found = snaps(&rising(5.2, vec![5.0, 5.0, 5.0, 5.2])).unwrap().after;
        let off_s = 0.25 * (0.2 + 3.0 * 0.2 / 3.0);
        assert!((found.time_s.unwrap() - off_s).abs() < 5e-3, "{found:?}");
        assert_eq!(snaps(&rising(5.0, Vec::new())), None);
    }
}
