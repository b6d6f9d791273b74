//! The way down of one fit: damped Gauss–Newton steps, derivatives by differences where a fit
//! begins and by Broyden's update after its steps.
//!
//! > J ← J + (Δr − J Δθ) Δθᵀ/(Δθᵀ Δθ),   Δθ in standard deviations of the priors
//!
//! (Broyden 1965) makes the derivatives agree with the step that was just taken, for no
//! simulation.

use nalgebra::{DMatrix, DVector};

use crate::fitting::nuisance::Nuisances;
use crate::fitting::problem::{Coordinate, Problem};
use crate::fitting::refit::{Refit, most_left};
use crate::fitting::swing::guess;
use crate::parallel::each_or_none;
use crate::plant::Point;

/// How much a fit may cost.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Gauss–Newton steps at most.
    pub steps: usize,
    /// A step that lowers the loss by less than this share ends the fit.
    pub converged: f64,
    /// Attempts at one step with ever more damping.
    pub attempts: usize,
    /// Points of one compass search.
    pub compass: usize,
    /// Whether derivatives are taken anew after every step, and updated otherwise.
    pub exact: bool,
    /// How often updated derivatives are taken anew where they lead no further.
    pub renewals: usize,
    /// Rounds along the axes at the end, of few parameters.
    pub rounds: usize,
}

/// Parameters up to which a fit ends with rounds along the axes.
const FEW: usize = 3;
/// Share of the loss that such a step would change it by where it is smooth: far enough for a fork to
/// be noise.
const STEP_OF_LOSS: f64 = 0.01;
/// Share of the loss that a round must gain to be followed by another.
const WORTH_A_ROUND: f64 = 1e-4;

/// A point and what it costs.
pub struct Place {
    pub point: Point,
    pub raw: Vec<DVector<f64>>,
    pub refits: Vec<Refit>,
    pub loss: f64,
}

/// Where a search ended.
pub struct Found {
    pub place: Place,
    /// Raw derivatives there.
    pub jacobian: Vec<DMatrix<f64>>,
    /// The switch-on value that promised most, whether or not it led there.
    pub tried: Option<Point>,
}

/// What became of a step.
enum Step {
    Better(Box<Place>),
    /// To first order there is nothing to gain.
    Flat,
    /// There should be, but no step got it.
    Stuck,
}

/// What a switch-on value promises.
struct Promise {
    /// The loss there.
    loss: f64,
    /// What the loss would fall by to first order, if what the value does came in any size and sign.
    gain: f64,
    /// That size, in times the value.
    size: f64,
}

/// One fit on some trials; what it holds by trial is in the order of these.
pub struct Search<'a> {
    pub problem: &'a Problem<'a>,
    pub nuisances: &'a Nuisances,
    pub effort: Effort,
    pub coordinates: Vec<Coordinate>,
    pub trials: Vec<usize>,
}

impl Search<'_> {
    /// A point, simulated; `None` when the simulation breaks down.
    pub fn place(&self, point: Point) -> Option<Place> {
        let raw = self.problem.residuals_of(&self.trials, &point)?;
        self.known(point, raw)
    }

    /// A point whose residuals are known.
    pub fn known(&self, point: Point, raw: Vec<DVector<f64>>) -> Option<Place> {
        let pairs = self.trials.iter().zip(&raw);
        let refits: Vec<Refit> = pairs.map(|(&trial, r)| self.nuisances.refit(trial, r)).collect();
        let loss = refits.iter().map(Refit::energy).sum::<f64>() + self.prior(&point);
        loss.is_finite().then_some(Place { point, raw, refits, loss })
    }

    /// The way down from where `off` is, or from the switch-on value of `fresh` that promises
    /// most, whichever ends lower.
    pub fn begin(&self, off: Place, fresh: Option<usize>) -> Option<Found> {
        let limit = off.loss;
        let tried = fresh.and_then(|effect| self.switched_on(&off, effect));
        let on = tried.clone().and_then(|point| self.descend(self.place(point)?));
        let (place, jacobian) = match on.filter(|(place, _)| place.loss < limit) {
            Some(found) => found,
            None => self.descend(off)?,
        };
        Some(Found { place, jacobian, tried })
    }

    /// The switch-on value of an effect from which the loss falls lowest: by what it is there, or
    /// would be to first order if what the value does came in any size and sign. Where simulations
    /// cost something, the trial decides that has most of the gap.
    ///
    /// Where an effect swings, the guess by all trials goes before the best of the values if it
    /// promises more, or the loss itself is lower there: values are of few frequencies.
    ///
    /// Beside other effects in that size, if the loss is lower there. Not alone: the size that one
    /// trial's whole gap asks for leads a single effect astray.
    fn switched_on(&self, off: &Place, effect: usize) -> Option<Point> {
        let mut deciding: Vec<usize> = (0..self.trials.len()).collect();
        if !self.problem.plant.cheap() {
            deciding = most_left(&off.refits, 1);
        }
        let loss_off = deciding.iter().map(|&at| off.refits[at].energy()).sum::<f64>();
        let mut least = loss_off + self.prior(&off.point);
        let mut best: Option<(Point, Promise)> = None;
        let promised = |values: &Vec<f64>| {
            let mut point = off.point.clone();
            point.effects[effect].clone_from(values);
            let promise = self.promise(off, &deciding, &point)?;
            Some((point, promise))
        };
        for values in &self.problem.plant.effects()[effect].starts {
            let Some((point, promise)) = promised(values) else { continue };
            let lowest = promise.loss.min(loss_off - promise.gain);
            if lowest < least {
                (least, best) = (lowest, Some((point, promise)));
            }
        }
        if let Some((point, promise)) = self.guessed(off, effect).as_ref().and_then(promised) {
            let limit = best.as_ref().map_or(least, |(_, best)| best.loss);
            if promise.loss < limit || loss_off - promise.gain < least {
                best = Some((point, promise));
            }
        }
        let (point, promise) = best?;
        if self.coordinates.len() == self.problem.plant.effects()[effect].parameters.len() {
            return Some(point);
        }
        let resized = self.resized(&off.point, &point, effect, promise.size).filter(|resized| {
            let own = self.promise(off, &deciding, resized);
            own.is_some_and(|own| own.loss < promise.loss)
        });
        Some(resized.unwrap_or(point))
    }

    /// What a point promises against another, on some of the trials.
    fn promise(&self, off: &Place, deciding: &[usize], point: &Point) -> Option<Promise> {
        let one = |&at: &usize| {
            let raw = self.problem.residual(self.trials[at], point)?;
            let on = self.nuisances.refit(self.trials[at], &raw).energy();
            let does = off.refits[at].project_column(&(&raw - &off.raw[at]));
            Some([on, does.dot(&off.refits[at].pull), does.norm_squared()])
        };
        let found: Option<Vec<[f64; 3]>> = each_or_none(deciding, one);
        let add = |a: [f64; 3], b: &[f64; 3]| [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
        let [on, slope, squared] = found?.iter().fold([0.0; 3], add);
        let squared = squared.max(f64::MIN_POSITIVE);
        Some(Promise {
            loss: on + self.prior(point),
            gain: slope * slope / squared,
            size: -slope / squared,
        })
    }

    /// A point with an effect so many times as far from off, within its bounds.
    fn resized(&self, off: &Point, on: &Point, effect: usize, size: f64) -> Option<Point> {
        let mut point = on.clone();
        let parameters = &self.problem.plant.effects()[effect].parameters;
        for (i, p) in parameters.iter().enumerate() {
            let (from, to) = (off.effects[effect][i], on.effects[effect][i]);
            point.effects[effect][i] = (from + size * (to - from)).clamp(p.low, p.high);
        }
        (size.is_finite() && point != *on).then_some(point)
    }

    /// Where an effect that swings should begin, by all trials.
    fn guessed(&self, off: &Place, effect: usize) -> Option<Vec<f64>> {
        let trials = self.trials.iter().zip(&off.refits).map(|(&trial, refit)| (trial, refit));
        guess(self.problem, effect, self.nuisances, &trials.collect::<Vec<_>>())
    }

    fn prior(&self, point: &Point) -> f64 {
        self.deviations(point).norm_squared()
    }

    /// (θ − off)/scale of every coordinate.
    fn deviations(&self, point: &Point) -> DVector<f64> {
        let of = |&coordinate: &Coordinate| match coordinate {
            Coordinate::Effect { effect, parameter } => {
                let p = self.problem.parameter(effect, parameter);
                (point.effects[effect][parameter] - p.off) / p.scale
            }
            Coordinate::Nuisance(_) => 0.0,
        };
        DVector::from_iterator(self.coordinates.len(), self.coordinates.iter().map(of))
    }

    fn derivatives(&self, place: &Place) -> Option<Vec<DMatrix<f64>>> {
        self.problem.sensitivities(&self.trials, &place.point, &place.raw, &self.coordinates)
    }

    /// Steps down from `place`; gives the end and the raw derivatives there.
    pub fn descend(&self, place: Place) -> Option<(Place, Vec<DMatrix<f64>>)> {
        let jacobian = self.derivatives(&place)?;
        self.descend_with(place, jacobian, true)
    }

    /// The same with derivatives that are known there; `fresh`: exactly, and not about.
    pub fn descend_with(
        &self,
        mut place: Place,
        mut jacobian: Vec<DMatrix<f64>>,
        mut fresh: bool,
    ) -> Option<(Place, Vec<DMatrix<f64>>)> {
        if self.coordinates.is_empty() {
            return Some((place, jacobian));
        }
        let (mut damping, mut searched) = (1e-4, false);
        let mut renewals = self.effort.renewals;
        for _ in 0..self.effort.steps {
            if self.problem.is_cut() {
                break;
            }
            let before = place.loss;
            let better = match self.step(&place, &jacobian, &mut damping) {
                Step::Better(better) => Some(*better),
                Step::Stuck if fresh && !searched => {
                    searched = true;
                    self.compass(&place)
                }
                Step::Flat | Step::Stuck => None,
            };
            let gained = better.as_ref().map_or(0.0, |better| before - better.loss);
            if let Some(better) = better {
                if self.effort.exact {
                    jacobian = self.derivatives(&better)?;
                } else {
                    self.update(&mut jacobian, &place, &better);
                }
                (place, fresh) = (better, self.effort.exact);
            }
            if gained < self.effort.converged * before {
                if fresh || renewals == 0 {
                    break;
                }
                renewals -= 1;
                jacobian = self.derivatives(&place)?;
                (fresh, damping) = (true, 1e-4);
            }
        }
        if self.coordinates.len() <= FEW {
            for _ in 0..self.effort.rounds {
                if self.problem.is_cut() {
                    break;
                }
                let before = place.loss;
                for axis in 0..self.coordinates.len() {
                    if let Some(better) = self.along(axis, &place, &jacobian) {
                        self.update(&mut jacobian, &place, &better);
                        place = better;
                    }
                }
                if before - place.loss < WORTH_A_ROUND * before {
                    break;
                }
            }
        }
        Some((place, jacobian))
    }

    /// A lower place along one axis: a step to either side and the minimum of the parabola through
    /// all three (as in Powell 1964). Derivatives at a point say little where the loss is rough; what lies
    /// a step away does.
    fn along(&self, axis: usize, place: &Place, jacobian: &[DMatrix<f64>]) -> Option<Place> {
        let scale = self.scales()[axis];
        let own = |(refit, jacobian): (&Refit, &DMatrix<f64>)| {
            refit.project_column(&jacobian.column(axis).into_owned()).norm_squared()
        };
        let curvature =
            1.0 + place.refits.iter().zip(jacobian).map(own).sum::<f64>() * scale.powi(2);
        let step = (STEP_OF_LOSS * place.loss / curvature).sqrt();
        let at = |share: f64| {
            let mut point = place.point.clone();
            self.add(&mut point, axis, share * step * scale);
            (point != place.point).then(|| self.place(point)).flatten()
        };
        let sides = [at(-1.0), at(1.0)];
        let minimum = match &sides {
            [Some(down), Some(up)] => {
                let (slope, bend) =
                    (0.5 * (up.loss - down.loss), up.loss + down.loss - 2.0 * place.loss);
                let share = if bend > 0.0 { -slope / bend } else { -2.0 * slope.signum() };
                at(share.clamp(-2.0, 2.0))
            }
            _ => None,
        };
        let lower = sides.into_iter().chain([minimum]).flatten().filter(|p| p.loss < place.loss);
        lower.min_by(|a, b| a.loss.total_cmp(&b.loss))
    }

    /// Broyden's update of the derivatives by one step.
    fn update(&self, jacobian: &mut [DMatrix<f64>], from: &Place, to: &Place) {
        let step = self.deviations(&to.point) - self.deviations(&from.point);
        let squared = step.norm_squared();
        if squared <= 0.0 {
            return;
        }
        let scales = self.scales();
        for (trial, jacobian) in jacobian.iter_mut().enumerate() {
            let mut missed = &to.raw[trial] - &from.raw[trial];
            for (i, column) in jacobian.column_iter().enumerate() {
                missed -= column * (step[i] * scales[i]);
            }
            for (i, mut column) in jacobian.column_iter_mut().enumerate() {
                column += &missed * (step[i] / (squared * scales[i]));
            }
        }
    }

    /// One damped Gauss–Newton step.
    fn step(&self, place: &Place, jacobian: &[DMatrix<f64>], damping: &mut f64) -> Step {
        let k = self.coordinates.len();
        // In units of the priors, so that damping means the same for every parameter.
        let scales = self.scales();
        let mut normal = DMatrix::identity(k, k);
        let mut gradient = self.deviations(&place.point);
        for (refit, jacobian) in place.refits.iter().zip(jacobian) {
            let mut j = refit.project(jacobian);
            for (mut column, scale) in j.column_iter_mut().zip(scales.iter()) {
                column *= *scale;
            }
            normal += j.tr_mul(&j);
            gradient += j.tr_mul(&refit.pull);
        }
        let free = self.free(&place.point, &gradient);
        let slope = gradient.select_rows(&free);
        for _ in 0..self.effort.attempts {
            let mut damped = normal.clone();
            for i in 0..k {
                damped[(i, i)] *= 1.0 + *damping;
            }
            let reduced = damped.select_columns(&free).select_rows(&free);
            let Some(step) = reduced.cholesky().map(|c| c.solve(&-&slope)) else {
                return Step::Stuck;
            };
            if -slope.dot(&step) < self.effort.converged * place.loss {
                return Step::Flat;
            }
            let mut point = place.point.clone();
            for (&i, step) in free.iter().zip(step.iter()) {
                self.add(&mut point, i, step * scales[i]);
            }
            if let Some(better) = self.place(point).filter(|p| p.loss < place.loss) {
                *damping = (*damping * 0.1).max(1e-9);
                return Step::Better(Box::new(better));
            }
            *damping = (*damping * 100.0).max(1e-2);
        }
        Step::Stuck
    }

    fn scales(&self) -> Vec<f64> {
        let of = |&coordinate: &Coordinate| match coordinate {
            Coordinate::Effect { effect, parameter } => {
                self.problem.parameter(effect, parameter).scale
            }
            Coordinate::Nuisance(nuisance) => self.problem.plant.nuisances()[nuisance].sd,
        };
        self.coordinates.iter().map(of).collect()
    }

    /// Coordinates that are not held by a bound against the descent.
    fn free(&self, point: &Point, gradient: &DVector<f64>) -> Vec<usize> {
        let held = |&i: &usize| match self.coordinates[i] {
            Coordinate::Effect { effect, parameter } => {
                let p = self.problem.parameter(effect, parameter);
                let value = point.effects[effect][parameter];
                (value <= p.low && gradient[i] > 0.0) || (value >= p.high && gradient[i] < 0.0)
            }
            Coordinate::Nuisance(_) => false,
        };
        (0..self.coordinates.len()).filter(|i| !held(i)).collect()
    }

    fn add(&self, point: &mut Point, coordinate: usize, step: f64) {
        if let Coordinate::Effect { effect, parameter } = self.coordinates[coordinate] {
            let p = self.problem.parameter(effect, parameter);
            let value = &mut point.effects[effect][parameter];
            *value = (*value + step).clamp(p.low, p.high);
        }
    }

    /// Steps along the axes, halved when none helps.
    fn compass(&self, place: &Place) -> Option<Place> {
        let scales = self.scales();
        let mut best: Option<Place> = None;
        let (mut size, mut points) = (0.5, 0);
        while points < self.effort.compass {
            let from = best.as_ref().unwrap_or(place);
            let mut found = None;
            for (i, scale) in scales.iter().enumerate() {
                for sign in [1.0, -1.0] {
                    let mut point = from.point.clone();
                    self.add(&mut point, i, sign * size * scale);
                    if point == from.point {
                        continue;
                    }
                    points += 1;
                    let limit = found.as_ref().map_or(from.loss, |p: &Place| p.loss);
                    found = self.place(point).filter(|p| p.loss < limit).or(found);
                }
            }
            match found {
                Some(better) => best = Some(better),
                None if size > 0.02 => size *= 0.4,
                None => break,
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::plant::{Along, Nuisance, Swing};
    use crate::toy::{Toy, effect, explained_by, noise, parameter};

    const SAMPLES: usize = 400;
    const NOISE: f64 = 0.01;
    const TRUE: f64 = 1.2;
    const EFFORT: Effort = Effort {
        steps: 1,
        converged: 1e-3,
        attempts: 1,
        compass: 0,
        exact: true,
        renewals: 0,
        rounds: 0,
    };

    /// Where the fit of a slope begins, of which a value is to be tried, among these effects.
    fn begins(value: f64, effects: &[usize]) -> f64 {
        let along = |i: usize| i as f64 / SAMPLES as f64;
        let measured = (0..SAMPLES).map(|i| TRUE * along(i) + NOISE * noise(i));
        let mut toy = Toy::new(0.01, NOISE, measured, |i, point| point.effects[0][0] * along(i));
        let own = |id, starts| effect(id, vec![parameter("size")], starts);
        toy.effects = vec![own("slope", vec![vec![value]]), own("other", vec![vec![1.0]])];
        explained_by(&toy, &[], |selector, selection| {
            let search = Search {
                problem: selector.problem,
                nuisances: selection.nuisances.as_ref().unwrap(),
                effort: EFFORT,
                coordinates: selector.problem.coordinates(effects),
                trials: vec![0],
            };
            let off = search.place(selection.nominal.fit.point.clone()).unwrap();
            search.switched_on(&off, 0).unwrap().effects[0][0]
        })
    }

    #[test]
    fn a_swing_begins_as_guessed_where_a_scanned_value_promises_more_and_leaves_more() {
        const SIZE: f64 = 1.0;
        let time_s = |i: usize| 0.0125 * i as f64;
        let swing = move |i: usize, hz: f64, rad: f64| (TAU * hz * time_s(i) + rad).sin();
        let measured = (0..SAMPLES).map(|i| SIZE * swing(i, 0.8, 0.0) + NOISE * noise(i));
        // What it does in its whole size has more to it than what it does in a small one.
        let predict = move |i: usize, point: &Point| {
            let [size, hz, rad] = point.effects[0][..] else { return f64::NAN };
            point.nuisances[0] + size * swing(i, hz, rad) + 0.7 * size * size * swing(i, 3.1, 0.0)
        };
        let mut toy = Toy::new(0.0125, NOISE, measured, predict);
        let parameters = vec![parameter("size"), parameter("hz"), parameter("rad")];
        toy.effects = vec![effect("motion", parameters, vec![vec![0.1 * SIZE, 0.83, 0.0]])];
        toy.nuisances = vec![Nuisance { name: "x", unit: "m", sd: 0.3, effect: None }];
        toy.swing = Some(Swing {
            nuisances: vec![0],
            along: Along::Time,
            cycles: [0.15, 4.0],
            own_phase: None,
            parameters: |sizes, hz, rad| vec![sizes[0], hz, rad],
        });
        explained_by(&toy, &[], |selector, selection| {
            let search = Search {
                problem: selector.problem,
                nuisances: selection.nuisances.as_ref().unwrap(),
                effort: EFFORT,
                coordinates: selector.problem.coordinates(&[0]),
                trials: vec![0],
            };
            let off = search.place(selection.nominal.fit.point.clone()).unwrap();
            let begins = |values: &Vec<f64>| {
                let mut point = off.point.clone();
                point.effects[0].clone_from(values);
                search.promise(&off, &[0], &point).unwrap()
            };
            let guess = search.guessed(&off, 0).unwrap();
            let (guessed, scanned) = (begins(&guess), begins(&toy.effects[0].starts[0]));
            assert!(scanned.gain > guessed.gain && scanned.loss > guessed.loss);
            assert_eq!(search.switched_on(&off, 0).unwrap().effects[0], guess);
        });
    }

    #[test]
    fn beside_others_an_effect_begins_in_the_size_that_the_residual_asks_for() {
        for value in [0.1, 3.0, -3.0] {
            let slope = begins(value, &[0, 1]);
            assert!((slope - TRUE).abs() < 0.02, "{slope} from {value}");
            assert_eq!(begins(value, &[0]), value);
        }
    }

    /// What is left where a line's slope grows with a parameter that makes it go up and down.
    fn left_of_rough(rounds: usize) -> f64 {
        let along = |i: usize| i as f64 / SAMPLES as f64;
        let measured = (0..SAMPLES).map(|i| TRUE * along(i) + NOISE * noise(i));
        let slope = |x: f64| x + 0.004 * (TAU * x / 0.02).sin();
        let predict = |i: usize, point: &Point| slope(point.effects[0][0]) * along(i);
        let mut toy = Toy::new(0.01, NOISE, measured, predict);
        toy.effects = vec![effect("slope", vec![parameter("size")], vec![vec![1.0]])];
        explained_by(&toy, &[], |selector, selection| {
            let search = Search {
                problem: selector.problem,
                nuisances: selection.nuisances.as_ref().unwrap(),
                effort: Effort { rounds, ..EFFORT },
                coordinates: selector.problem.coordinates(&[0]),
                trials: vec![0],
            };
            let mut point = selection.nominal.fit.point.clone();
            // Here the slope falls with the parameter.
            point.effects[0] = vec![1.19];
            search.descend(search.place(point).unwrap()).unwrap().0.loss / SAMPLES as f64
        })
    }

    #[test]
    fn steps_along_the_axes_find_what_derivatives_at_a_point_do_not() {
        let (without, with) = (left_of_rough(0), left_of_rough(2));
        assert!(with < without - 0.2 && with < 1.1, "{with}, {without} without");
    }
}
