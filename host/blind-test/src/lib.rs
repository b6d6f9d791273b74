//! Blind checks of the diagnosis: bundles whose effect is known here and withheld there.
//!
//! Nothing of the device's model is used. The mechanics are those of `cathforce-reference-solver`
//! (absolute coordinates, finer mesh, second-order implicit steps, Coulomb's law met exactly);
//! effects are added around it with shapes that differ from those that the diagnosis fits.
//!
//! | module | what it holds |
//! | --- | --- |
//! | `rigs` | four rigs: two vessels, two instruments |
//! | `given` | a rig of a bundle that somebody else made |
//! | `stand` | a rig with its motions and the noise of its sensors |
//! | `motion` | the motions of the drive, and the time step |
//! | `change` | effects that a reality can have, in and out of the library |
//! | `world`, `train`, `sensor` | effects on the vessel and the instrument, in the drive train, in the sensor |
//! | `nuisance` | differences from run to run that are not effects |
//! | `play` | simulates one trial of a reality |
//! | `deck`, `draw` | draws cases from a seed |
//! | `bundle`, `noise` | writes a case as a trial bundle with sensor noise |
//! | `strangers` | cases whose rigs, sensors, motions and shapes nobody tuned the diagnosis on |
//! | `label` | the effects that are really there, withheld until every case is answered |
//! | `make` | makes the cases of a blind test, and resumes an interrupted run |
//! | `blind_test` | a blind test on disk: cases, sealed labels, answers |
//! | `answer`, `figures`, `count`, `parts`, `score`, `report` | compare the answers with the labels |
//! | `history` | the scores of all sets over time, as a page and a chart |

#![forbid(unsafe_code)]

mod answer;
mod blind_test;
mod bundle;
mod change;
mod count;
mod deck;
mod draw;
mod figures;
mod given;
pub mod history;
mod label;
mod make;
mod motion;
mod noise;
mod nuisance;
mod parts;
mod play;
mod reliability;
mod report;
mod rigs;
mod score;
mod sensor;
mod stand;
mod strangers;
mod train;
mod world;

pub use answer::Answer;
pub use blind_test::{BlindTest, BlindTestError, Seals};
pub use change::{Change, Truth};
pub use draw::{Case, Kind, LIBRARY, OUTSIDE, cases, single};
pub use figures::{Counted, Figure, SMALLEST_GAP, Target};
pub use given::GivenError;
pub use label::{Label, Strangeness};
pub use motion::{TRIALS, schedule};
pub use noise::Noise;
pub use nuisance::Spread;
pub use parts::Part;
pub use play::{Row, Trial, play, play_along};
pub use reliability::Reliability;
pub use rigs::{CONTACT_SPACING_M, Instrument, Rig, rigs};
pub use score::{Published, Right, Rigs, Score, score};

pub use stand::{Accuracy, Stand};
pub use strangers::{
    DropOuts, Electronics, Filter, MotionKind, RigTruth, Set, Stated, Stranger, strangers,
};
