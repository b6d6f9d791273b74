//! Blind checks of the diagnosis: bundles whose effect is known here and withheld there.
//!
//! Nothing of the device's model is used. The mechanics are those of `cathforce-reference-solver`
//! (absolute coordinates, finer mesh, second-order implicit steps, Coulomb's law met exactly);
//! effects are added around it with shapes that differ from those that the diagnosis fits.
//!
//! | module | what it holds |
//! | --- | --- |
//! | `rigs` | two vessels, two instruments |
//! | `motion` | what the drive does in every trial |
//! | `stand` | a rig with its motions and the noise of its sensors |
//! | `given` | the same of a bundle that somebody else made |
//! | `change` | effects of a reality, in and out of the library |
//! | `world`, `train`, `sensor` | where they act |
//! | `nuisance` | what differs from run to run and is no effect |
//! | `play` | one trial of a reality |
//! | `draw` | cases from a seed |
//! | `bundle`, `noise` | a case as a trial bundle |
//! | `seal` | labels, their hashes, what was answered |
//! | `score` | answers against labels |

#![forbid(unsafe_code)]

mod bundle;
mod change;
mod draw;
mod given;
mod make;
mod motion;
mod noise;
mod nuisance;
mod play;
mod rigs;
mod score;
mod seal;
mod sensor;
mod stand;
mod train;
mod world;

pub use change::{Change, Truth};
pub use draw::{Case, Kind, LIBRARY, OUTSIDE, cases, single};
pub use given::GivenError;
pub use motion::{TRIALS, schedule};
pub use noise::Noise;
pub use play::{Row, Trial, play, play_along};
pub use rigs::{CONTACT_SPACING_M, Instrument, Rig, rigs};
pub use score::{Right, SMALLEST_GAP, Score, Tally, score};
pub use seal::{Challenge, ChallengeError, Label, Seals};
pub use stand::{Accuracy, Stand};
