//! What is minimised.

/// What an objective finds at a point.
#[derive(Clone, Debug, PartialEq)]
pub enum Evaluation {
    /// The sum of their squares is minimised.
    Residuals(Vec<f64>),
    /// This itself is.
    Cost(f64),
}

impl Evaluation {
    /// What is minimised; infinite where it is no number.
    pub fn cost(&self) -> f64 {
        let cost = match self {
            Self::Residuals(own) => own.iter().map(|r| r * r).sum(),
            Self::Cost(cost) => *cost,
        };
        if cost.is_nan() { f64::INFINITY } else { cost }
    }
}

/// A function of the values of the parameters, in their order and units.
///
/// It is called from many threads and must give the same for the same values. [`Residuals`] and
/// [`Cost`] make one of a closure.
pub trait Objective: Sync {
    /// `None` where nothing can be computed, such as a simulation that breaks down.
    fn evaluate(&self, values: &[f64]) -> Option<Evaluation>;

    /// Whether it gives residuals, always as many; local searches then know its slope.
    fn has_residuals(&self) -> bool;
}

/// An objective that gives residuals: measured less predicted, over the standard deviation.
pub struct Residuals<F>(pub F);

impl<F: Fn(&[f64]) -> Option<Vec<f64>> + Sync> Objective for Residuals<F> {
    fn evaluate(&self, values: &[f64]) -> Option<Evaluation> {
        self.0(values).map(Evaluation::Residuals)
    }

    fn has_residuals(&self) -> bool {
        true
    }
}

/// An objective that gives a cost, such as one minus an overlap.
pub struct Cost<F>(pub F);

impl<F: Fn(&[f64]) -> Option<f64> + Sync> Objective for Cost<F> {
    fn evaluate(&self, values: &[f64]) -> Option<Evaluation> {
        self.0(values).map(Evaluation::Cost)
    }

    fn has_residuals(&self) -> bool {
        false
    }
}
