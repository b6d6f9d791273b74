//! What would have been missed: for each effect, the size that these trials would have shown.

use nalgebra::DVector;
use serde::Serialize;

use crate::evidence::discrepancy::Screen;
use crate::fitting::problem::Problem;
use crate::parallel::each;
use crate::plant::{Effect, Parameter, Point};
use crate::rounding::shortest;
use crate::scoring::candidate::Candidate;

/// Quantile of the standard normal distribution below which nine tenths lie.
const NINE_TENTHS: f64 = 1.2816;
/// Digits of a size that is just seen.
const DIGITS: u8 = 2;
/// Starting values of an effect that are tried: its typical sizes, of an oscillation its frequencies.
const STARTS: usize = 2;

/// The smallest size of an effect that would have been seen with a probability of 90 %.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Detectable {
    pub id: &'static str,
    /// The parameter that tells the size: of the first one and those in its unit, the one that moves farthest in
    /// standard deviations of its prior. The others say where and how the effect acts.
    pub parameter: &'static str,
    /// `None` where no size within the bounds would have been seen.
    pub size: Option<f64>,
    pub unit: &'static str,
    /// Whether the effect would have been seen at its usual size, one standard deviation of the prior.
    #[serde(skip)]
    pub is_seen_as_usual: bool,
    /// The value that is no effect.
    #[serde(skip)]
    pub off: f64,
}

impl Detectable {
    /// The value from which on the effect is seen, with its unit; `never` where none is.
    pub fn seen_from(&self) -> String {
        match self.size {
            None => "never".to_owned(),
            Some(size) if self.unit == "1" => shortest(size, DIGITS),
            Some(size) => format!("{} {}", shortest(size, DIGITS), self.unit),
        }
    }
}

/// For every effect. `screen`: of the nominal model.
///
/// An effect of x times a change of D standard deviations raises the score by T (x² D²/2 ± x D), T the mean temper.
/// It is seen with nine tenths if that exceeds the ln odds L of one effect more:
///
/// > x D = q + √(q² − 2 L/T),   q = 1.28
///
/// See docs/explanation/diagnosis.md (D13).
pub fn detectable(
    problem: &Problem<'_>,
    nominal: &Candidate,
    screen: &Screen<'_>,
) -> Vec<Detectable> {
    let prior = problem.rules.prior;
    let q = NINE_TENTHS;
    let needed = q + (q * q - 2.0 * prior.of_effect / prior.mean_temper(&screen.size())).sqrt();
    let effects: Vec<usize> = (0..problem.plant.effects().len()).collect();
    each(effects, |effect| {
        let known = &problem.plant.effects()[effect];
        let starts = known.starts.iter().take(STARTS);
        let seen = starts.filter_map(|start| {
            let share = needed / distance(problem, nominal, screen, effect, start)?;
            let own = Seen::of(known, start, share);
            Some((own.sds, own))
        });
        let smallest = seen.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, own)| own);
        let first = &known.parameters[0];
        let parameter = smallest.as_ref().map_or(first, |own| own.parameter);
        Detectable {
            id: known.id,
            parameter: parameter.name,
            size: smallest.as_ref().filter(|own| own.is_within).map(|own| own.value),
            unit: parameter.unit,
            is_seen_as_usual: smallest.is_some_and(|own| own.is_within && own.sds <= 1.0),
            off: parameter.off,
        }
    })
}

/// A size that is just seen.
struct Seen<'a> {
    parameter: &'a Parameter,
    value: f64,
    /// From off, in standard deviations of the prior.
    sds: f64,
    is_within: bool,
}

impl<'a> Seen<'a> {
    /// At a share of the way from off to a start.
    fn of(known: &'a Effect, start: &[f64], share: f64) -> Self {
        let at = |(p, value): (&Parameter, &f64)| p.off + share * (value - p.off);
        let sds = |(p, value): (&'a Parameter, &f64)| ((value - p.off) / p.scale).abs();
        let is_size = |p: &Parameter| p.unit == known.parameters[0].unit;
        let pairs = || known.parameters.iter().zip(start).filter(|(p, _)| is_size(p));
        let most = pairs().max_by(|a, b| sds(*a).total_cmp(&sds(*b)));
        let (parameter, value) = most.unwrap_or((&known.parameters[0], &0.0));
        let value = at((parameter, value));
        Self {
            parameter,
            value,
            sds: ((value - parameter.off) / parameter.scale).abs(),
            is_within: (parameter.low..=parameter.high).contains(&value),
        }
    }
}

/// How far an effect at a start moves the nominal model, in standard deviations. `None` when a simulation
/// breaks down, or the effect shows nothing.
fn distance(
    problem: &Problem<'_>,
    nominal: &Candidate,
    screen: &Screen<'_>,
    effect: usize,
    start: &[f64],
) -> Option<f64> {
    let mut point: Point = nominal.fit.point.clone();
    point.effects[effect] = start.to_vec();
    let on = problem.residuals(&point)?;
    let does = on.iter().zip(&nominal.fit.trials).map(|(on, off)| on - &off.raw);
    screen.distance(&does.collect::<Vec<DVector<f64>>>()).filter(|distance| *distance > 0.0)
}
