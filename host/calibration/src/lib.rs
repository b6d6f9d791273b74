//! Fits named parameters within bounds to whatever an [`Objective`] computes.
//!
//! | file | what it holds |
//! | --- | --- |
//! | `parameter` | names, bounds, start; the unit cube that the methods search in |
//! | `objective` | what is minimised: residuals, or a cost |
//! | `ask` | the trait of all methods: they ask for points and are told what was found there |
//! | `local` | Levenberg–Marquardt within bounds, Nelder–Mead |
//! | `methods` | cross-entropy, CMA-ES, multi-start with local searches, and which one fits a problem |
//! | `run` | evaluates what is asked for on every core, within a budget; can be interrupted |
//! | `state` | the file from which an interrupted run goes on |
//! | `certainty` | intervals, and parameters that the data cannot tell apart |
//! | `held_out` | what a fit would be without each of its trials |
//!
//! A method never evaluates anything itself. It asks for points that do not depend on each other, so
//! that they are computed side by side, and what it asks for depends only on its seed and on what it
//! was told. An interrupted run is therefore resumed by telling the method again what is known already.
//! Libraries of optimisers (argmin 0.11, cmaes 0.2) call the objective themselves, which allows neither.

#![forbid(unsafe_code)]

mod ask;
mod certainty;
mod held_out;
mod local;
mod methods;
mod objective;
mod parameter;
mod run;
mod state;

pub use ask::{Answer, Optimiser, Question, Slope};
pub use certainty::{Certainty, NINETY, Pair};
pub use held_out::{jackknife, without_each};
pub use local::{Descent, Simplex};
pub use methods::choice::{Choice, Method};
pub use methods::cma_es::CmaEs;
pub use methods::cross_entropy::CrossEntropy;
pub use methods::multi_start::MultiStart;
pub use objective::{Cost, Evaluation, Objective, Residuals};
pub use parameter::{Parameter, ParameterError, check};
pub use run::{Options, Outcome, Progress, RunError, Stop, jacobian, minimise, optimise};
pub use state::{State, StateError};
