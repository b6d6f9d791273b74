//! Parameters with their bounds.
//!
//! All methods search the unit cube: coordinate u of a parameter between `low` and `high` is its share
//! of the way between them, or of the way between their logarithms.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// One number that is searched for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    pub name: String,
    pub low: f64,
    pub high: f64,
    /// Where a search begins, within the bounds.
    pub start: f64,
    /// Step of differences, in the unit of the parameter.
    pub step: f64,
    /// Whether ratios matter, not differences: a modulus from 1 kPa to 1 GPa. Both bounds are above 0.
    pub logarithmic: bool,
}

/// Why parameters cannot be searched for.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ParameterError {
    #[error("there are no parameters to fit")]
    None,
    #[error("parameter `{0}` is named twice")]
    Twice(String),
    #[error("the bounds of `{name}` are reversed: {low} is not below {high}")]
    Reversed { name: String, low: f64, high: f64 },
    #[error("the start of `{name}`, {start}, is not within its bounds, {low} to {high}")]
    Start { name: String, start: f64, low: f64, high: f64 },
    #[error("the bounds of `{0}` must be above 0, because it is searched by ratios")]
    Logarithm(String),
    #[error("the step of `{0}` must be a number above 0")]
    Step(String),
}

impl Parameter {
    /// Differences count; the start is in the middle, and the step a thousandth of the way between the
    /// bounds.
    pub fn new(name: impl Into<String>, low: f64, high: f64) -> Self {
        let (start, step) = (0.5 * (low + high), 1e-3 * (high - low));
        Self { name: name.into(), low, high, start, step, logarithmic: false }
    }

    /// The same with another start.
    pub fn starting_at(self, start: f64) -> Self {
        Self { start, ..self }
    }

    /// The value of a coordinate.
    pub fn value(&self, coordinate: f64) -> f64 {
        let value = match self.logarithmic {
            true => self.low * (self.high / self.low).powf(coordinate),
            false => self.low + coordinate * (self.high - self.low),
        };
        // Rounding leads beyond no bound.
        value.clamp(self.low, self.high)
    }

    /// The coordinate of a value.
    pub fn coordinate(&self, value: f64) -> f64 {
        let share = match self.logarithmic {
            true => (value / self.low).ln() / (self.high / self.low).ln(),
            false => (value - self.low) / (self.high - self.low),
        };
        share.clamp(0.0, 1.0)
    }

    fn check(&self) -> Result<(), ParameterError> {
        let Self { name, low, high, start, step, logarithmic } = self.clone();
        // In this form NaN is refused.
        if !(low < high && low.is_finite() && high.is_finite()) {
            return Err(ParameterError::Reversed { name, low, high });
        }
        if !(low..=high).contains(&start) {
            return Err(ParameterError::Start { name, start, low, high });
        }
        if logarithmic && low <= 0.0 {
            return Err(ParameterError::Logarithm(name));
        }
        if !(step > 0.0 && step.is_finite()) {
            return Err(ParameterError::Step(name));
        }
        Ok(())
    }
}

/// Refuses parameters that cannot be searched for.
pub fn check(parameters: &[Parameter]) -> Result<(), ParameterError> {
    if parameters.is_empty() {
        return Err(ParameterError::None);
    }
    for (i, own) in parameters.iter().enumerate() {
        own.check()?;
        if parameters[..i].iter().any(|other| other.name == own.name) {
            return Err(ParameterError::Twice(own.name.clone()));
        }
    }
    Ok(())
}

/// The values of a point of the unit cube.
pub(crate) fn values(parameters: &[Parameter], at: &[f64]) -> Vec<f64> {
    parameters.iter().zip(at).map(|(own, u)| own.value(*u)).collect()
}

/// Where values lie in the unit cube.
pub(crate) fn coordinates(parameters: &[Parameter], values: &[f64]) -> Vec<f64> {
    parameters.iter().zip(values).map(|(own, value)| own.coordinate(*value)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coordinate_is_a_share_of_the_way_or_of_the_ratio() {
        let linear = Parameter::new("a", 2.0, 6.0);
        assert_eq!((linear.value(0.25), linear.coordinate(5.0)), (3.0, 0.75));
        let ratio = Parameter { logarithmic: true, ..Parameter::new("b", 1e3, 1e9) };
        assert!((ratio.value(0.5) / 1e6 - 1.0).abs() < 1e-12);
        assert!((ratio.coordinate(1e8) - 5.0 / 6.0).abs() < 1e-12);
        assert_eq!((ratio.value(1.0), ratio.value(0.0)), (1e9, 1e3));
    }

    #[test]
    fn what_cannot_be_searched_is_refused_by_name() {
        let fine = || Parameter::new("a", 0.0, 1.0);
        assert_eq!(check(&[fine()]), Ok(()));
        assert_eq!(check(&[]), Err(ParameterError::None));
        assert_eq!(check(&[fine(), fine()]), Err(ParameterError::Twice("a".into())));
        let reversed = check(&[Parameter::new("a", 2.0, 1.0)]).unwrap_err();
        assert!(reversed.to_string().contains("2 is not below 1"), "{reversed}");
        assert!(matches!(check(&[fine().starting_at(2.0)]), Err(ParameterError::Start { .. })));
        assert!(check(&[Parameter { logarithmic: true, ..fine() }]).is_err());
        assert!(check(&[Parameter { step: f64::NAN, ..fine() }]).is_err());
    }
}
