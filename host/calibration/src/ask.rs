//! How a method and whoever evaluates for it talk.

use serde::{Deserialize, Serialize};

/// A point of the unit cube at which something is wanted.
#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    pub at: Vec<f64>,
    /// Whether the slope is wanted too, which costs one evaluation more for each parameter.
    pub slope: bool,
}

impl Question {
    pub fn cost(at: Vec<f64>) -> Self {
        Self { at, slope: false }
    }

    pub fn slope(at: Vec<f64>) -> Self {
        Self { at, slope: true }
    }

    /// Evaluations that it takes.
    pub fn evaluations(&self) -> usize {
        if self.slope { 1 + self.at.len() } else { 1 }
    }
}

/// What was found at a point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// `None` where nothing could be computed.
    pub cost: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slope: Option<Slope>,
}

impl Answer {
    /// What is minimised; infinite where nothing could be computed.
    pub fn cost(&self) -> f64 {
        self.cost.unwrap_or(f64::INFINITY)
    }
}

/// The cost r·r near a point, from the derivatives J of the residuals r with respect to the coordinates
/// of the unit cube.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Slope {
    /// Jᵀr, half of the gradient.
    pub pull: Vec<f64>,
    /// JᵀJ row by row, half of the curvature.
    pub curvature: Vec<f64>,
}

/// A method of minimisation in the unit cube.
///
/// What it asks for depends only on how it was made and on what it was told.
pub trait Optimiser {
    /// Points that do not depend on each other; none when it has come to its end.
    fn ask(&mut self) -> Vec<Question>;

    /// The answers to what it asked last, in that order.
    fn tell(&mut self, answers: &[Answer]);

    /// Whether it came to its end by itself.
    fn has_converged(&self) -> bool;
}
