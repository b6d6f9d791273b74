//! Diagnosis of the gap between model and measurement: where it lies, which effect that the
//! model lacks causes it, and how far it shrinks once that effect is added.
//!
//! [`plant::Plant`] is what a plant tells the diagnosis; everything else is independent of it.
//!
//! | module | what it answers |
//! | --- | --- |
//! | `floor` | what would be left if the model were perfect |
//! | `problem`, `nuisance`, `fit` | the best parameters of one set of effects |
//! | `sanity` | whether axes and units are the model's |
//! | `score` | its error on data that the fit has not seen |
//! | `select` | which effects the data support |
//! | `metric`, `confuse`, `calibration` | what cannot be told apart, and how certain the rest is |
//! | `locate` | where the gap lies |
//! | `experiment` | what to record next |
//! | `report`, `page` | the answer for programs and for people |

#![forbid(unsafe_code)]

pub mod assumed;
mod calibration;
pub mod catheter;
mod confuse;
mod diagnose;
pub mod drive;
mod experiment;
mod fit;
mod floor;
mod locate;
mod metric;
mod nuisance;
mod page;
pub mod plant;
mod problem;
pub mod report;
mod sanity;
mod score;
mod select;
mod signal;

pub use diagnose::{diagnose, expected_simulations};
pub use nuisance::NUISANCE_LIMIT;
pub use page::page;
pub use problem::Progress;
