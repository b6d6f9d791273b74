//! Where cases are played: a rig, what its drive does, and how well its sensors read.

use std::path::PathBuf;

use cathforce_reference::{Schedule, SolveError};
use rayon::prelude::*;

use crate::change::Change;
use crate::motion::{TRIALS, schedule};
use crate::play::{Trial, play_along};
use crate::rigs::{Rig, rigs};

/// White noise of a row, and how often a camera sees the tip.
#[derive(Clone, Debug, PartialEq)]
pub struct Accuracy {
    pub force_n: f64,
    pub drive_n: f64,
    pub tip_m: f64,
    /// Of a point on the shape; `None` where nobody looks at it.
    pub shape_m: Option<f64>,
    /// Rows between two of the tip.
    pub tip_every: usize,
}

/// A rig with its motions; the last of them is withheld from the diagnosis.
#[derive(Clone, Debug)]
pub struct Stand {
    pub rig: Rig,
    pub motions: Vec<Schedule>,
    pub accuracy: Accuracy,
    /// The bundle that it was read from, whose files of the rig its cases take as they are.
    pub given: Option<PathBuf>,
}

/// The tip is seen 25 times a second.
const OWN: Accuracy =
    Accuracy { force_n: 2e-3, drive_n: 2e-3, tip_m: 1.5e-4, shape_m: None, tip_every: 10 };

/// Noise of a mean of so many rows is smaller by the square root: force samples of 20 ms.
const AVERAGED_ROWS: f64 = 5.0;

impl Stand {
    /// A rig of this crate with the motions of the blind checks.
    pub fn own(rig: &Rig) -> Self {
        let motions = (0..TRIALS).map(|trial| schedule(trial, rig.start_m)).collect();
        Self { rig: rig.clone(), motions, accuracy: OWN, given: None }
    }

    /// All rigs of this crate.
    pub fn all_own() -> Vec<Self> {
        rigs().iter().map(Self::own).collect()
    }

    /// Every motion on the rig with changes.
    pub fn play(&self, changes: &[Change]) -> Result<Vec<Trial>, SolveError> {
        self.motions.par_iter().map(|motion| play_along(&self.rig, changes, motion)).collect()
    }

    /// √(1 + mean square of the difference over the noise), of the best channel.
    pub fn gap_over_noise(&self, real: &[Trial], nominal: &[Trial]) -> f64 {
        let mut sums = [0.0; 3];
        let mut rows = 0.0;
        for (a, b) in real.iter().zip(nominal).flat_map(|(a, b)| a.iter().zip(b)) {
            let noise = self.accuracy.force_n / AVERAGED_ROWS.sqrt();
            sums[0] += ((a.force_n - b.force_n) / noise).norm_squared() / 3.0;
            let noise = self.accuracy.drive_n / AVERAGED_ROWS.sqrt();
            sums[1] += ((a.drive_force_n - b.drive_force_n) / noise).powi(2);
            sums[2] += ((a.tip_m - b.tip_m) / self.accuracy.tip_m).norm_squared() / 3.0;
            rows += 1.0;
        }
        sums.iter().map(|sum| (1.0 + sum / rows).sqrt()).fold(1.0, f64::max)
    }
}
