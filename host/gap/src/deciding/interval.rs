//! Parameters of the effects with their 90 % intervals.

use std::collections::BTreeMap;

pub use cathforce_recording::NORMAL_NINETY;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::fitting::nuisance::Nuisances;
use crate::fitting::problem::{Coordinate, Problem};
use crate::plant::Plant;
use crate::scoring::candidate::Candidate;
use crate::scoring::folds::Folds;
use crate::scoring::metric::Metric;
use crate::scoring::score::fold_steps;

/// A fitted parameter with its 90 % interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    pub value: f64,
    pub low: f64,
    pub high: f64,
    pub unit: &'static str,
    /// The value that is no effect.
    #[serde(skip)]
    pub off: f64,
}

impl Estimate {
    /// The unit as it follows a value: of a ratio, nothing.
    pub fn unit_after(&self) -> String {
        if self.unit == "1" { String::new() } else { format!(" {}", self.unit) }
    }

    /// All values times so much, for another unit.
    pub fn times(&self, scale: f64) -> Self {
        let [value, low, high, off] =
            [self.value, self.low, self.high, self.off].map(|own| scale * own);
        Self { value, low, high, off, unit: self.unit }
    }

    /// Value and bounds as text, to two digits of the interval's half width.
    pub fn digits(&self) -> [String; 3] {
        /// More say nothing in any unit.
        const MOST: f64 = 9.0;
        let half_width = 0.5 * (self.high - self.low);
        let size = if half_width > 0.0 { half_width } else { 0.01 * self.value.abs() };
        let decimals = if size > 0.0 { (1.0 - size.log10().floor()).clamp(0.0, MOST) } else { 0.0 };
        [self.value, self.low, self.high].map(|x| format!("{x:.*}", decimals as usize))
    }
}

/// Values of one effect's parameters with their intervals, by name.
pub fn parameters(
    plant: &dyn Plant,
    best: &Candidate,
    effect: usize,
    spread: &DVector<f64>,
) -> BTreeMap<String, Estimate> {
    let own = best.fit.coordinates.iter().zip(spread.iter());
    own.filter_map(|(coordinate, sd)| match *coordinate {
        Coordinate::Effect { effect: e, parameter } if e == effect => {
            let p = &plant.effects()[e].parameters[parameter];
            let value = best.fit.point.effects[e][parameter];
            let (low, high) = (value - NORMAL_NINETY * sd, value + NORMAL_NINETY * sd);
            let (low, high) = (low.max(p.low), high.min(p.high));
            Some((p.name.to_owned(), Estimate { value, low, high, unit: p.unit, off: p.off }))
        }
        _ => None,
    })
    .collect()
}

/// Standard deviations of the parameters, as blind checks have found them to be.
pub fn spread(
    problem: &Problem<'_>,
    folds: &Folds,
    best: &Candidate,
    metric: &Metric<'_>,
) -> DVector<f64> {
    let share = problem.plant.spread_share();
    posterior(problem, folds, best, metric).diagonal().map(|variance| share * variance.sqrt())
}

/// Covariance of the parameters: from the curvature of the loss, from how they change where a fold
/// is left out, and what models leave open.
///
/// See docs/explanation/diagnosis.md (D16).
pub fn posterior(
    problem: &Problem<'_>,
    folds: &Folds,
    best: &Candidate,
    metric: &Metric<'_>,
) -> DMatrix<f64> {
    let rules = &problem.rules.interval;
    let between = jackknife(&fold_steps(problem, folds, &best.fit)) * rules.wider.powi(2);
    let mut posterior = covariance(problem, best, metric) + between;
    for (i, coordinate) in best.fit.coordinates.iter().enumerate() {
        if let Coordinate::Effect { effect, parameter } = *coordinate {
            let own = problem.parameter(effect, parameter);
            let size = best.fit.point.effects[effect][parameter] - own.off;
            let [of_scale, of_size] = match problem.plant.has_other_models() {
                true => [rules.other_model, rules.other_answer],
                false => [0.0, rules.other_answer_of_axis],
            };
            posterior[(i, i)] += (of_scale * own.scale).powi(2) + (of_size * size).powi(2);
        }
    }
    posterior
}

/// Σ = (n−1)/n Σ (θ_f − θ̄)(θ_f − θ̄)ᵀ over what the parameters are without each of n folds
/// (Tukey 1958).
fn jackknife(steps: &[DVector<f64>]) -> DMatrix<f64> {
    let (n, k) = (steps.len() as f64, steps.first().map_or(0, DVector::len));
    let mean = steps.iter().fold(DVector::zeros(k), |sum, step| sum + step) / n;
    let squares = steps.iter().fold(DMatrix::zeros(k, k), |sum, step| {
        let off = step - &mean;
        sum + &off * off.transpose()
    });
    squares * ((n - 1.0) / n)
}

/// Covariance of the parameters from the curvature of the loss alone.
fn covariance(problem: &Problem<'_>, best: &Candidate, metric: &Metric<'_>) -> DMatrix<f64> {
    let k = best.fit.coordinates.len();
    let mut normal = DMatrix::<f64>::zeros(k, k);
    for (t, trial) in best.fit.trials.iter().enumerate() {
        normal += metric.inner(t, &trial.raw_jacobian, &trial.raw_jacobian);
    }
    for (i, coordinate) in best.fit.coordinates.iter().enumerate() {
        if let Coordinate::Effect { effect, parameter } = *coordinate {
            normal[(i, i)] += problem.parameter(effect, parameter).scale.powi(-2);
        }
    }
    normal.cholesky().map_or_else(|| DMatrix::zeros(k, k), |c| c.inverse())
}

/// Effects of a fit that may as well be off: the interval of every one of their parameters holds a value that is
/// no effect. `nuisances`: linearised there.
///
/// That value is the parameter's off value. What the trials have as a nuisance, such as a force zero, is no
/// effect up to one standard deviation of its prior either.
pub fn may_be_off(
    problem: &Problem<'_>,
    folds: &Folds,
    own: &Candidate,
    nuisances: &Nuisances,
) -> Vec<usize> {
    let spread = spread(problem, folds, own, &Metric::new(nuisances, &own.score));
    let known = problem.plant.nuisances();
    let holds_off = |effect: &usize| {
        let id = problem.plant.effects()[*effect].id;
        let usual = |unit: &str| {
            let same = known.iter().filter(|own| own.effect == Some(id) && own.unit == unit);
            same.map(|own| own.sd).fold(0.0, f64::max)
        };
        let all = parameters(problem.plant, own, *effect, &spread);
        all.values().all(|p| {
            let usual = usual(p.unit);
            p.low <= p.off + usual && p.high >= p.off - usual
        })
    };
    own.fit.effects.iter().copied().filter(holds_off).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rules::Rules;
    use crate::toy::{Toy, effect, explained_by, parameter};

    const SLOPE: f64 = 2.0;

    /// What models leave open of it.
    fn least_sd() -> f64 {
        let rules = Rules::USED.interval;
        (rules.other_model * parameter("slope").scale).hypot(rules.other_answer * SLOPE)
    }

    /// Straight data without noise, whose slope the curvature tells far better than any model does.
    fn line(spread_share: f64) -> impl Plant {
        let measured = (0..400).map(|i| SLOPE * i as f64);
        let mut toy = Toy::new(0.01, 1e-3, measured, |i, point| point.effects[0][0] * i as f64);
        toy.effects = vec![effect("slope", vec![parameter("slope")], vec![vec![1.0]])];
        toy.spread_share = spread_share;
        toy
    }

    #[test]
    fn an_interval_is_no_narrower_than_models_differ() {
        let sd = explained_by(&line(1.0), &[0], |selector, selection| {
            let metric = Metric::new(selection.nuisances.as_ref().unwrap(), &selection.best.score);
            assert!(covariance(selector.problem, &selection.best, &metric)[(0, 0)].sqrt() < 1e-3);
            spread(selector.problem, selector.folds, &selection.best, &metric)[0]
        });
        assert!(sd >= 0.99 * least_sd() && sd < 1.1 * least_sd(), "{sd}");
    }

    #[test]
    fn an_interval_is_the_share_of_it_that_checks_have_found() {
        let line = line(0.5);
        let width = explained_by(&line, &[0], |selector, selection| {
            let metric = Metric::new(selection.nuisances.as_ref().unwrap(), &selection.best.score);
            let spread = spread(selector.problem, selector.folds, &selection.best, &metric);
            let slope = &parameters(&line, &selection.best, 0, &spread)["slope"];
            slope.high - slope.low
        });
        assert!((width / (NORMAL_NINETY * least_sd()) - 1.0).abs() < 0.1, "{width}");
    }

    /// Of the slope where every fourth sample, which is held out together, has another by so much.
    fn sd_where_a_fold_differs(by: f64) -> f64 {
        let slope = |i: usize| if i.is_multiple_of(4) { SLOPE + by } else { SLOPE };
        let measured = (0..400).map(|i| slope(i) * i as f64);
        let mut toy = Toy::new(0.01, 1e-3, measured, |i, point| point.effects[0][0] * i as f64);
        toy.effects = vec![effect("slope", vec![parameter("slope")], vec![vec![1.0]])];
        explained_by(&toy, &[0], |selector, selection| {
            let metric = Metric::new(selection.nuisances.as_ref().unwrap(), &selection.best.score);
            spread(selector.problem, selector.folds, &selection.best, &metric)[0]
        })
    }

    #[test]
    fn an_interval_is_as_wide_as_the_trials_differ() {
        // Without the fold that differs the slope is by/4 less, without any other by/12 more.
        let by: f64 = 0.4;
        let jackknife = (0.75 * (3.0 * (by / 12.0).powi(2) + (by / 4.0).powi(2))).sqrt();
        let wide = (sd_where_a_fold_differs(by).powi(2) - least_sd().powi(2)).sqrt();
        assert!(
            (wide / (Rules::USED.interval.wider * jackknife) - 1.0).abs() < 0.1,
            "{wide}, {jackknife}"
        );
        assert!(sd_where_a_fold_differs(0.0) < 1.1 * least_sd());
    }

    #[test]
    fn an_estimate_shows_as_many_digits_as_it_is_known_to() {
        let shown = |value, low, high| Estimate { value, low, high, unit: "m", off: 0.0 }.digits();
        assert_eq!(shown(5.97e-5, 5.71e-5, 6.23e-5), ["0.0000597", "0.0000571", "0.0000623"]);
        assert_eq!(shown(209.7698, 179.35, 240.19), ["210", "179", "240"]);
        assert_eq!(shown(-3.197, -4.369, -2.025), ["-3.2", "-4.4", "-2.0"]);
        assert_eq!(shown(0.25, 0.25, 0.25), ["0.2500", "0.2500", "0.2500"]);
        assert_eq!(shown(0.0, 0.0, 0.0), ["0", "0", "0"]);
        let unit_after =
            |unit| Estimate { value: 1.4, low: 1.3, high: 1.5, unit, off: 1.0 }.unit_after();
        assert_eq!((&*unit_after("mm/s"), &*unit_after("1")), (" mm/s", ""));
    }
}
