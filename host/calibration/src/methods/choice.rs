//! The methods by name, and which one fits a problem.

use serde::{Deserialize, Serialize};

use crate::ask::Optimiser;
use crate::methods::cma_es::CmaEs;
use crate::methods::cross_entropy::CrossEntropy;
use crate::methods::multi_start::MultiStart;

/// Parameters up to which samples fill the space well enough to start from: eight a parameter leave
/// none farther than about a third of the cube's side from the nearest.
const FEW: usize = 6;
/// Evaluations that a few generations take.
const FEW_GENERATIONS: usize = 8;
/// Restarts of CMA-ES, each with twice the agents.
const RESTARTS: usize = 2;
/// Standard deviation in the unit cube at which the cross-entropy method has converged, where the caller
/// states none.
const CONVERGED_SD: f64 = 1e-3;
/// Agents for each parameter, at least; a quarter of them explores. A vessel's modulus and Poisson's ratio
/// were found with eight, two of which explored ("3D deformation from 2D images", section II).
const AGENTS_EACH: usize = 4;
const FEWEST_AGENTS: usize = 8;

/// A method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    CrossEntropy,
    CmaEs,
    MultiStart,
}

/// A method and why it was taken.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Choice {
    pub method: Method,
    pub reason: String,
}

impl Method {
    pub fn name(self) -> &'static str {
        match self {
            Self::CrossEntropy => "cross-entropy",
            Self::CmaEs => "CMA-ES",
            Self::MultiStart => "multi-start",
        }
    }

    /// The method for so many parameters and evaluations.
    pub fn choose(parameters: usize, budget: usize, has_residuals: bool) -> Choice {
        let of = |method, reason: String| Choice { method, reason };
        let agents = FEWEST_AGENTS.max(AGENTS_EACH * parameters);
        match () {
            () if has_residuals && parameters <= FEW => of(
                Self::MultiStart,
                format!(
                    "residuals have a slope, and samples of {parameters} parameters leave no large hole: \
                     local searches from the best of them find every valley"
                ),
            ),
            () if parameters <= 2 || budget < FEW_GENERATIONS * agents * 2 => of(
                Self::CrossEntropy,
                format!(
                    "{budget} evaluations of {parameters} parameters are a few generations, in which no \
                     covariance is learnt"
                ),
            ),
            () => of(
                Self::CmaEs,
                format!(
                    "{parameters} parameters are too many to sample, and {budget} evaluations are enough to \
                     learn how they go together"
                ),
            ),
        }
    }

    /// A search of this method with the usual numbers. `start`: in the unit cube.
    pub fn optimiser(self, start: &[f64], has_residuals: bool, seed: u64) -> Box<dyn Optimiser> {
        let count = start.len();
        match self {
            Self::CrossEntropy => {
                let agents = FEWEST_AGENTS.max(AGENTS_EACH * count);
                let search = CrossEntropy::new(agents, agents / 4, vec![CONVERGED_SD; count], seed);
                Box::new(search.around(start.to_vec()))
            }
            Self::CmaEs => Box::new(CmaEs::new(start.to_vec(), RESTARTS, seed)),
            Self::MultiStart => Box::new(MultiStart::new(start.to_vec(), has_residuals, seed)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_choice_goes_by_parameters_and_budget_and_says_why() {
        let method = |parameters, budget, residuals| {
            let choice = Method::choose(parameters, budget, residuals);
            assert!(choice.reason.contains(&parameters.to_string()), "{}", choice.reason);
            choice.method
        };
        assert_eq!(method(2, 500, true), Method::MultiStart);
        assert_eq!(method(2, 500, false), Method::CrossEntropy);
        assert_eq!(method(8, 100, false), Method::CrossEntropy);
        assert_eq!(method(8, 5000, true), Method::CmaEs);
        assert_eq!(method(5, 5000, false), Method::CmaEs);
    }
}
