//! Diagnosis of the gap between model and measurement: where it lies, which effect that the
//! model lacks causes it, and how far it shrinks once that effect is added.
//!
//! [`plant::Plant`] is what a plant tells the diagnosis; everything else is independent of it.
//!
//! | module | what it answers |
//! | --- | --- |
//! | `floor` | what would be left if the model were perfect |
//! | `problem`, `loss`, `nuisance`, `fit`, `search`, `swing` | the best parameters of one set of effects |
//! | `sanity` | whether axes and units are the model's |
//! | `score` | its error on data that the fit has not seen |
//! | `figures`, `frechet`, `series` | how far it is off in newtons and millimetres |
//! | `select`, `pairs`, `extend`, `prune`, `exchange`, `again`, `given` | which effects the data support; those that somebody asks for |
//! | `impostor` | what in no library an effect may be mistaken for |
//! | `criteria` | when a model is better than another |
//! | `verdict` | whether what it closes is the answer, a part of it, or nothing to be named |
//! | `metric`, `confuse`, `calibration` | what cannot be told apart, and how certain the rest is |
//! | `diagnose`, `answer` | the whole run; what is said of it, step by step |
//! | `fresh` | what the answer closes on a trial that it has not seen |
//! | `band` | how far the forces of a device may be off that is set like the answer |
//! | `estimate` | parameters with intervals, what each effect closed |
//! | `locate`, `descriptors`, `map`, `silhouette`, `on_vessel` | where the gap lies, and what it looks like |
//! | `left` | the same of what an explanation leaves |
//! | `experiment` | what to record next |
//! | `isolability`, `protocol` | what a recording can tell before it is made; what it should hold |
//! | `spike` | which effects are put into measured data |
//! | `report`, `page` | the answer for programs and for people |

#![forbid(unsafe_code)]

mod again;
mod altered;
mod answer;
mod band;
mod calibration;
pub mod catheter;
mod clock;
mod confuse;
mod copies;
mod correct;
mod criteria;
mod descriptors;
mod diagnose;
pub mod drive;
mod estimate;
mod exchange;
mod experiment;
mod extend;
mod figures;
mod fit;
mod floor;
mod folds;
mod frechet;
mod fresh;
mod given;
mod impostor;
pub mod isolability;
mod left;
mod locate;
mod loss;
mod map;
mod metric;
mod nuisance;
mod on_vessel;
mod own_phase;
mod page;
mod pairs;
pub mod plant;
mod problem;
pub mod protocol;
mod prune;
pub mod report;
mod sanity;
mod score;
mod search;
mod select;
mod series;
mod signal;
mod silhouette;
mod snaps;
pub mod spike;
mod swing;
#[cfg(test)]
mod toy;
mod unlike;
mod verdict;
mod within;

pub use altered::Altered;
pub use band::{Band, ROWS, Row};
pub use cathforce_recording::{COLUMNS, Coverage, Covered};
pub use diagnose::{diagnose, diagnose_given, expected_simulations};
pub use fresh::{achieved, covered};
pub use nuisance::NUISANCE_LIMIT;
pub use page::page;
pub use problem::Progress;
pub use silhouette::Silhouette;
