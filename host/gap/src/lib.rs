//! Diagnosis of the gap between model and measurement: where it lies, which effect that the
//! model lacks causes it, and how far it shrinks once that effect is added.
//!
//! A diagnosis runs through the folders from top to bottom. [`plant::Plant`] is all that it sees of
//! a rig: trials as numbers with their noise, effects as parameters, one function that simulates.
//! A folder uses those above it in this table, and none below. [`rules`] has every constant by which they
//! decide, and switches them off to measure what each is worth.
//!
//! | folder | what it does |
//! | --- | --- |
//! | `plant` | says what a plant is; a plant with trials withheld or effects assumed; the outline of a vessel |
//! | `noise` | finds the noise floor, which is the error that a perfect model would leave |
//! | `fitting` | fits the parameters of one set of effects, with nuisance parameters, by robust least squares |
//! | `scoring` | scores a fitted model on data that the fit has not seen |
//! | `data` | checks clocks, duplicate trials, axes and units, and trials that are unlike the others |
//! | `evidence` | says how probable the measurements are under a set of effects |
//! | `deciding` | says how probable the sets are, what is concluded, and what would have been missed |
//! | `searching` | searches for the sets of effects under which the measurements are most probable |
//! | `explaining` | says how large the gap is, where it lies, what it looks like and what remains of it |
//! | `planning` | says what a recording can tell before it is made, and what to record next |
//! | `calibrating` | gives a calibration the residuals of settings that somebody names |
//! | `wording` | says effects, their values and places in plain words |
//! | `diagnosis` | runs all of the above and assembles the answer (`report`) |
//! | `catheter`, `drive`, `transmission` | the kinds of rig as plants |

#![forbid(unsafe_code)]

pub mod calibrating;
pub mod catheter;
mod data;
mod deciding;
mod diagnosis;
pub mod drive;
pub mod evidence;
mod explaining;
mod fitting;
mod noise;
mod parallel;
mod planning;
pub mod plant;
pub mod rounding;
pub mod rules;
mod scoring;
mod searching;
mod signal;
#[cfg(any(test, feature = "toy"))]
pub mod toy;
pub mod transmission;
pub mod wording;

pub use cathforce_recording::{COLUMNS, Coverage, Covered};
pub use diagnosis::report;
pub use diagnosis::withheld::{achieved, covered};
pub use diagnosis::{diagnose, diagnose_by, diagnose_given, expected_simulations};
pub use explaining::band::{Band, ROWS, Row};
pub use explaining::locate::Cell;
pub use explaining::map::Map;
pub use explaining::on_vessel::{OnVessel, Square, VesselMap};
pub use fitting::progress::{BestSoFar, EffectSoFar, Progress, Watcher, unwatched};
pub use fitting::refit::NUISANCE_LIMIT;
pub use planning::{isolability, protocol, spike};
pub use plant::{Altered, Silhouette};
