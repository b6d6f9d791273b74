//! What differs on any rig from mounting to mounting and from run to run, and is no effect: a diagnosis
//! must see through it. Its priors (docs/explanation/diagnosis.md) are the standard deviations here.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::change::Change;
use crate::motion::STEP_S;
use crate::noise::Noise;
use crate::play::{Row, Trial};

/// Zero of the force sensor, every axis \[N\].
const ZERO_SD_N: f64 = 3e-3;
/// Sensors are read later than encoders, or earlier \[s\].
const LATER_SD_S: f64 = 3e-3;
/// What is inside when a run begins, beside what the encoder tells \[m\].
const FED_SD_M: f64 = 3e-4;
/// Where the phantom stands, every axis \[m\], \[rad\].
const MOUNTED_SD_M: f64 = 3e-4;
const MOUNTED_SD_RAD: f64 = 0.3 * std::f64::consts::PI / 180.0;
/// Standard deviations beyond which it would be an effect.
const LIMIT: f64 = 2.0;
/// A rig that is mounted carelessly differs by so many times the priors.
const WIDE: f64 = 2.0;
/// Degrees of freedom of heavy tails: as few as leave a finite variance.
const FREEDOM: usize = 3;
/// Standard deviations at which heavy tails end: farther off, every rig would be taken apart again.
const FARTHEST: f64 = 5.0;

/// How nuisances are distributed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Spread {
    /// As the priors, within two standard deviations.
    #[default]
    Priors,
    /// Twice as wide.
    Wide,
    /// Student's t with three degrees of freedom, times the priors' standard deviations.
    HeavyTailed,
}

impl Spread {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Priors, Self::Wide, Self::HeavyTailed];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Priors => "as the priors",
            Self::Wide => "twice as wide",
            Self::HeavyTailed => "heavy tails",
        }
    }

    /// One number, in standard deviations of the priors.
    fn draw(self, noise: &mut Noise) -> f64 {
        loop {
            let (drawn, limit) = match self {
                Self::Priors => (noise.normal(), LIMIT),
                Self::Wide => (WIDE * noise.normal(), WIDE * LIMIT),
                Self::HeavyTailed => {
                    let square = (0..FREEDOM).map(|_| noise.normal().powi(2)).sum::<f64>();
                    (noise.normal() / (square / FREEDOM as f64).sqrt(), FARTHEST)
                }
            };
            if drawn.abs() <= limit {
                return drawn;
            }
        }
    }
}

/// Of a rig that was mounted once, and of every run on it.
#[derive(Clone, Debug)]
pub struct Nuisances {
    offset_m: Vector3<f64>,
    tilt_rad: Vector3<f64>,
    runs: Vec<Run>,
}

#[derive(Clone, Copy, Debug)]
struct Run {
    zero_n: Vector3<f64>,
    later_s: f64,
    fed_m: f64,
}

impl Nuisances {
    /// For so many runs; the same seed gives the same.
    pub fn of_seed(seed: u64, runs: usize) -> Self {
        Self::spread(Spread::Priors, seed, runs)
    }

    /// The same, distributed otherwise.
    pub fn spread(spread: Spread, seed: u64, runs: usize) -> Self {
        let mut noise = Noise::of_seed(seed);
        let mut within = || spread.draw(&mut noise);
        let mut vector = |sd: f64| Vector3::from_fn(|_, _| sd * within());
        let (offset_m, tilt_rad) = (vector(MOUNTED_SD_M), vector(MOUNTED_SD_RAD));
        let run = |_| {
            let [zero_n, once] = [vector(ZERO_SD_N), vector(1.0)];
            Run { zero_n, later_s: LATER_SD_S * once.x, fed_m: FED_SD_M * once.y }
        };
        Self { offset_m, tilt_rad, runs: (0..runs).map(run).collect() }
    }

    /// Changes of a rig, and how it was mounted. A registration that is an effect is all of it.
    pub fn mounted(&self, changes: &[Change]) -> Vec<Change> {
        let Self { offset_m, tilt_rad, .. } = *self;
        let is_registered = |change: &Change| matches!(change, Change::Registration { .. });
        let own = Change::Registration { offset_m, tilt_rad };
        let own = (!changes.iter().any(is_registered)).then_some(own);
        own.into_iter().chain(changes.iter().cloned()).collect()
    }

    /// Where the phantom stands \[m\], and a rotation vector by which it is turned \[rad\].
    pub fn mounting(&self) -> (Vector3<f64>, Vector3<f64>) {
        (self.offset_m, self.tilt_rad)
    }

    /// What is recorded of runs on the rig that was mounted so.
    pub fn recorded(&self, runs: &[Trial]) -> Vec<Trial> {
        runs.iter().zip(&self.runs).map(|(trial, run)| run.recorded(trial)).collect()
    }
}

impl Run {
    fn recorded(&self, trial: &Trial) -> Trial {
        let last = trial.len() - 1;
        let recorded = |(k, row): (usize, &Row)| {
            let at = (k as f64 + self.later_s / STEP_S).clamp(0.0, last as f64);
            let (low, share) = (at.floor() as usize, at.fract());
            let (one, other) = (&trial[low], &trial[(low + 1).min(last)]);
            let mut row = row.clone();
            row.encoder.insertion_m += self.fed_m;
            row.force_n = one.force_n.lerp(&other.force_n, share) + self.zero_n;
            let drive_n = [one, other].map(|row| row.drive_force_n);
            row.drive_force_n = drive_n[0] + share * (drive_n[1] - drive_n[0]);
            row.tip_m = one.tip_m.lerp(&other.tip_m, share);
            row
        };
        trial.iter().enumerate().map(recorded).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rigs::rigs;
    use crate::stand::Stand;

    #[test]
    fn runs_differ_within_the_priors_of_a_diagnosis() {
        let drawn = Nuisances::of_seed(5, 400);
        let spread = |of: &dyn Fn(&Run) -> f64| {
            let values: Vec<f64> = drawn.runs.iter().map(of).collect();
            let square = values.iter().map(|value| value * value).sum::<f64>() / 400.0;
            assert!(values.iter().all(|value| *value != 0.0));
            (square.sqrt(), values.iter().fold(0.0, |most: f64, value| most.max(value.abs())))
        };
        for (of, sd) in [
            (&(|run: &Run| run.zero_n.x) as &dyn Fn(&Run) -> f64, ZERO_SD_N),
            (&|run| run.zero_n.z, ZERO_SD_N),
            (&|run| run.later_s, LATER_SD_S),
            (&|run| run.fed_m, FED_SD_M),
        ] {
            let (rms, most) = spread(of);
            // Without its tails a normal distribution is 0.88 times as wide.
            assert!((rms / sd - 0.88).abs() < 0.08 && most <= LIMIT * sd, "{rms} {most} {sd}");
        }
        let again = Nuisances::of_seed(5, 2);
        assert_eq!((again.offset_m, again.tilt_rad), (drawn.offset_m, drawn.tilt_rad));
        assert_eq!(again.runs[1].zero_n, drawn.runs[1].zero_n);
    }

    #[test]
    fn careless_mounting_is_twice_as_wide_and_heavy_tails_reach_farther() {
        let drawn = |spread: Spread| {
            let mut noise = Noise::of_seed(3);
            let mut sizes: Vec<f64> = (0..4000).map(|_| spread.draw(&mut noise).abs()).collect();
            sizes.sort_by(f64::total_cmp);
            [sizes[2000], sizes[3960], sizes[3999]]
        };
        let [priors, wide, heavy] = Spread::ALL.map(drawn);
        assert!((wide[0] / priors[0] - 2.0).abs() < 1e-12, "the same numbers, twice as large");
        // Half of a Student's t of three degrees of freedom is within 0.765, 99 % within 5.8.
        assert!((heavy[0] - 0.765).abs() < 0.04, "{heavy:?}");
        assert!(priors[2] <= LIMIT && heavy[1] > 3.5 && heavy[2] <= FARTHEST, "{heavy:?}");
    }

    #[test]
    fn what_is_recorded_is_later_farther_in_and_from_another_zero() {
        let mut stand = Stand::own(&rigs()[0]);
        stand.motions.truncate(1);
        let played = stand.play(&[]).unwrap();
        let zero_n = Vector3::new(1e-3, -2e-3, 3e-3);
        let run = Run { zero_n, later_s: 1.5 * STEP_S, fed_m: 2e-4 };
        let recorded = run.recorded(&played[0]);
        let k = played[0].len() / 2;
        let (own, [first, second]) = (&recorded[k], [1, 2].map(|later| &played[0][k + later]));
        assert_eq!(own.t_s, played[0][k].t_s);
        assert!((own.encoder.insertion_m - played[0][k].encoder.insertion_m - 2e-4).abs() < 1e-12);
        let half = 0.5 * (first.force_n + second.force_n) + zero_n;
        assert!((own.force_n - half).norm() < 1e-12, "{}", own.force_n);
        let drive_n = 0.5 * (first.drive_force_n + second.drive_force_n);
        assert!((own.drive_force_n - drive_n).abs() < 1e-12);
        assert!((own.tip_m - 0.5 * (first.tip_m + second.tip_m)).norm() < 1e-12);
    }

    #[test]
    fn a_phantom_that_is_registered_wrongly_is_not_mounted_a_second_time() {
        let drawn = Nuisances::of_seed(1, 1);
        let bias = Change::Bias { force_n: Vector3::zeros() };
        assert_eq!(drawn.mounted(std::slice::from_ref(&bias)).len(), 2);
        let wrong = Change::Registration { offset_m: Vector3::x(), tilt_rad: Vector3::zeros() };
        assert_eq!(drawn.mounted(&[bias.clone(), wrong.clone()]), [bias, wrong]);
    }
}
