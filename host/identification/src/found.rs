//! What is found, for whoever asked: values with intervals, what is not told, and the spread over trials.

use serde::Serialize;

use crate::description::{Description, Range};
use crate::quantity::Quantity;
use crate::search::Identified;
use crate::spread::Spread;

/// Standard deviations of a normal distribution on either side within which 95 of 100 lie.
const NINETY_FIVE: f64 = 1.959_964;
/// A value is at a bound when it is nearer to it than this share of the way between both.
const AT_BOUND: f64 = 1e-2;

/// How a parameter's value is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Known {
    /// From the records.
    Found,
    /// The description states it.
    Given,
    /// The records do not tell it.
    NotTold,
}

/// A parameter after a search.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParameterFound {
    pub name: &'static str,
    pub unit: &'static str,
    pub known: Known,
    /// `None` of one that is not told.
    pub value: Option<f64>,
    /// By the noise of the sensor, in the parameter's unit; of one that is not told, how far it would have
    /// to change for these records to show it.
    pub sd: Option<f64>,
    /// Within the bounds.
    pub interval_95: Option<[f64; 2]>,
    pub bounds: Option<[f64; 2]>,
    /// Whether the value is at one of its bounds, and may lie beyond.
    pub at_bound: bool,
    /// What would tell a parameter that is not told.
    pub advice: Option<String>,
}

/// Two parameters of which the records tell a combination only.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PairFound {
    pub first: String,
    pub second: String,
    /// Of their errors, from −1 to 1.
    pub correlation: f64,
    /// What to measure to tell them apart.
    pub advice: String,
}

/// What one trial tells.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrialFound {
    /// From 1.
    pub trial: usize,
    pub records: usize,
    pub features: usize,
    pub parameters: Vec<ParameterFound>,
    pub inseparable: Vec<PairFound>,
    /// Sum of the squared differences of features over their noise, by feature: near 1 where the model
    /// explains the records.
    pub cost_per_feature: f64,
    /// Coarse and fine ones.
    pub simulations: [usize; 2],
}

/// What several trials make of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SpreadFound {
    pub name: &'static str,
    pub unit: &'static str,
    /// Trials that tell it.
    pub trials: usize,
    /// Mean, least and largest value over those trials, and standard deviation among them.
    pub nominal: f64,
    pub lower: f64,
    pub upper: f64,
    pub sd: f64,
}

/// What all trials tell.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Found {
    pub trials: Vec<TrialFound>,
    /// Empty of a single trial.
    pub spread: Vec<SpreadFound>,
}

impl TrialFound {
    /// From a search. `trial`: its number, from 1; `records`: of it.
    pub(crate) fn of(
        description: &Description,
        trial: usize,
        [records, features]: [usize; 2],
        found: &Identified,
    ) -> Self {
        let Description { kind, parameters, .. } = description;
        let mut searched = 0;
        let parameter = |(own, range): (&Quantity, &Range)| match *range {
            Range::Known(value) => given(own, value),
            Range::Within(bounds) => {
                let k = searched;
                searched += 1;
                parameter_found(own, bounds, found.values[k], found.sd[k], found.told[k])
            }
        };
        let parameters = kind.quantities().iter().zip(parameters).map(parameter).collect();
        let inseparable = found.inseparable.iter().map(|pair| {
            let advice = [&pair.first, &pair.second].map(|name| {
                let own = kind.quantities().iter().find(|own| own.name == name);
                format!("give `{name}` as a number ({})", own.map_or("", |own| own.alone))
            });
            PairFound {
                first: pair.first.clone(),
                second: pair.second.clone(),
                correlation: pair.correlation,
                advice: advice.join(", or "),
            }
        });
        Self {
            trial,
            records,
            features,
            parameters,
            inseparable: inseparable.collect(),
            cost_per_feature: found.cost / features as f64,
            simulations: found.evaluations,
        }
    }
}

fn given(own: &Quantity, value: f64) -> ParameterFound {
    ParameterFound {
        name: own.name,
        unit: own.unit,
        known: Known::Given,
        value: Some(value),
        sd: None,
        interval_95: None,
        bounds: None,
        at_bound: false,
        advice: None,
    }
}

fn parameter_found(
    own: &Quantity,
    bounds: [f64; 2],
    value: f64,
    sd: f64,
    told: bool,
) -> ParameterFound {
    let [low, high] = bounds;
    let margin = AT_BOUND * (high - low);
    let ends = [value - NINETY_FIVE * sd, value + NINETY_FIVE * sd];
    ParameterFound {
        name: own.name,
        unit: own.unit,
        known: if told { Known::Found } else { Known::NotTold },
        value: told.then_some(value),
        sd: Some(sd),
        interval_95: told.then_some(ends.map(|end| end.clamp(low, high))),
        bounds: Some(bounds),
        at_bound: told && (value - low < margin || high - value < margin),
        advice: (!told).then(|| format!("{}; or {}, and give it as a number", own.more, own.alone)),
    }
}

/// Nominal value and bounds over trials; empty of a single one.
pub(crate) fn spread(trials: &[TrialFound]) -> Vec<SpreadFound> {
    let Some(first) = trials.first().filter(|_| trials.len() > 1) else { return Vec::new() };
    let of = |(k, own): (usize, &ParameterFound)| {
        let all = trials.iter().map(|trial| &trial.parameters[k]);
        let values: Vec<f64> =
            all.filter(|own| own.known == Known::Found).filter_map(|own| own.value).collect();
        let Spread { nominal, lower, upper, sd } = Spread::of(&values)?;
        let (name, unit, trials) = (own.name, own.unit, values.len());
        Some(SpreadFound { name, unit, trials, nominal, lower, upper, sd })
    };
    first.parameters.iter().enumerate().filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::OF_RELEASE;

    #[test]
    fn what_is_not_told_has_advice_and_what_is_has_an_interval_within_its_bounds() {
        let own = &OF_RELEASE[4];
        let found = parameter_found(own, [1e-3, 9e-3], 2e-3, 1e-3, true);
        let [low, high] = found.interval_95.unwrap();
        assert!(low == 1e-3 && (high - 3.96e-3).abs() < 1e-5 && !found.at_bound, "{found:?}");
        let found = parameter_found(own, [1e-3, 9e-3], 5e-3, 1.0, false);
        assert!(found.value.is_none() && found.advice.unwrap().contains("weigh"));
        assert!(parameter_found(own, [1e-3, 9e-3], 8.99e-3, 1e-3, true).at_bound);
    }

    #[test]
    fn trials_have_a_spread_and_one_trial_has_none() {
        let trial = |value: f64| TrialFound {
            trial: 1,
            records: 1,
            features: 6,
            parameters: vec![
                parameter_found(&OF_RELEASE[0], [0.0, 10.0], value, 1.0, true),
                parameter_found(&OF_RELEASE[1], [0.0, 10.0], value, 1.0, false),
            ],
            inseparable: Vec::new(),
            cost_per_feature: 1.0,
            simulations: [1, 1],
        };
        assert!(spread(&[trial(1.0)]).is_empty());
        let [own] = spread(&[trial(1.0), trial(3.0)])[..] else { panic!("the told one only") };
        assert_eq!((own.nominal, own.lower, own.upper, own.trials), (2.0, 1.0, 3.0, 2));
    }
}
