//! Where cases are played: a rig, what its drive does, and how well its sensors read.

use std::path::PathBuf;

use cathforce_reference_solver::{Schedule, SolveError};
use rayon::prelude::*;

use crate::change::Change;
use crate::motion::{TRIALS, schedule};
use crate::play::{Row, Trial, play_along};
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

/// What a stand does without any effect, and what nobody knows of its wall.
#[derive(Clone, Debug)]
pub struct Unchanged {
    pub nominal: Vec<Trial>,
    /// What two walls do that may both be the vessel's: by what they differ is no gap.
    pub doubts: Vec<[Vec<Trial>; 2]>,
}

impl Unchanged {
    /// That of the same stand, whose vessel divides a little elsewhere.
    pub fn divided_as(&self, stand: &Stand) -> Result<Self, SolveError> {
        if stand.rig.branches.len() < 2 {
            return Ok(self.clone());
        }
        let nominal = stand.play(&[])?;
        let mut doubts = self.doubts.clone();
        doubts.push([self.nominal.clone(), nominal.clone()]);
        Ok(Self { nominal, doubts })
    }
}

/// The tip is seen 25 times a second.
const OWN: Accuracy =
    Accuracy { force_n: 2e-3, drive_n: 2e-3, tip_m: 1.5e-4, shape_m: None, tip_every: 10 };

/// How well a wall is known: facets, segmentation \[m\].
pub(crate) const WALL_DOUBT_M: f64 = 4e-5;

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

    /// Every motion without any effect.
    pub fn unchanged(&self) -> Result<Unchanged, SolveError> {
        let mut nearer = self.clone();
        for station in nearer.rig.branches.iter_mut().flatten() {
            station.radius_m -= WALL_DOUBT_M;
        }
        let (nominal, nearer) = (self.play(&[])?, nearer.play(&[])?);
        Ok(Unchanged { doubts: vec![[nominal.clone(), nearer]], nominal })
    }

    /// √(1 + mean square of the difference over the noise), of the best channel.
    pub fn gap_over_noise(&self, real: &[Trial], without: &[Trial]) -> f64 {
        self.gap(real, without, None)
    }

    /// The same over the floor: the noise, and what nobody knows of the wall.
    pub fn gap_over_floor(&self, real: &[Trial], without: &[Trial], unchanged: &Unchanged) -> f64 {
        self.gap(real, without, Some(unchanged))
    }

    fn gap(&self, real: &[Trial], without: &[Trial], unchanged: Option<&Unchanged>) -> f64 {
        let noise = {
            let Accuracy { force_n, drive_n, tip_m, .. } = self.accuracy;
            [force_n / AVERAGED_ROWS.sqrt(), drive_n / AVERAGED_ROWS.sqrt(), tip_m]
        };
        let squares = |a: &Row, b: &Row| {
            [
                (a.force_n - b.force_n).norm_squared() / 3.0,
                (a.drive_force_n - b.drive_force_n).powi(2),
                (a.tip_m - b.tip_m).norm_squared() / 3.0,
            ]
        };
        let mut sums = [0.0; 3];
        let mut rows = 0.0;
        for (trial, (real, without)) in real.iter().zip(without).enumerate() {
            for (i, (a, b)) in real.iter().zip(without).enumerate() {
                let mut doubt = noise.map(|sd| sd * sd);
                for [one, other] in unchanged.iter().flat_map(|own| &own.doubts) {
                    let squares = squares(&one[trial][i], &other[trial][i]);
                    doubt.iter_mut().zip(squares).for_each(|(sum, square)| *sum += square);
                }
                for (k, square) in squares(a, b).into_iter().enumerate() {
                    sums[k] += square / doubt[k];
                }
                rows += 1.0;
            }
        }
        sums.iter().map(|sum| (1.0 + sum / rows).sqrt()).fold(1.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::change::Change;

    #[test]
    fn what_a_nearer_wall_does_as_well_is_a_small_gap_over_the_floor() {
        let mut stand = Stand::own(&rigs()[0]);
        stand.motions.truncate(1);
        let unchanged = stand.unchanged().unwrap();
        let gaps = |real: &[Trial]| {
            [
                stand.gap_over_noise(real, &unchanged.nominal),
                stand.gap_over_floor(real, &unchanged.nominal, &unchanged),
            ]
        };
        assert_eq!(gaps(&unchanged.nominal), [1.0, 1.0]);
        // As large as the doubt itself, which is next to nothing in tubes that are known this well.
        let [noise, floor] = gaps(&unchanged.doubts[0][1]);
        assert!(noise > 1.01 && floor > 1.0 && floor < noise, "{noise} {floor}");
        // A vessel without branches divides nowhere else.
        assert_eq!(unchanged.divided_as(&stand).unwrap().doubts.len(), 1);
        // A force of 5 mN from nowhere is no wall.
        let bias = Change::Bias { force_n: nalgebra::Vector3::new(5e-3, 0.0, 0.0) };
        let [noise, floor] = gaps(&stand.play(&[bias]).unwrap());
        assert!(noise > 3.0 && floor > 2.0 && floor < noise, "{noise} {floor}");
    }
}
