//! The release of a weight that hangs from the tip.

use cathforce_reference_solver::{Drive, Integrator, Problem, Simulation, SolveError, TipLoad};
use nalgebra::Vector3;
use thiserror::Error;

use crate::crossing::{first_crossing, last_crossing};

/// Share of the record at its end over which the tip is taken to be at rest.
const AT_REST: f64 = 0.1;
/// The rise is timed between these shares of the way to rest.
const RISE: [f64; 2] = [0.1, 0.9];
/// Step while a weight is hung on \[s\]: many periods of a catheter's first swing. The weight hangs still
/// when a step moves the tip by less than this share of the length, which takes 5 to 15 steps.
const HANGING_STEP_S: f64 = 1.0;
const HANGS_STILL: f64 = 1e-9;
const MOST_HANGING_STEPS: usize = 100;

/// Six features of a release. Displacements are along the thread, against the weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReleaseFeatures {
    /// Position of the suspended tip before the thread is cut \[m\].
    pub initial_m: f64,
    /// Displacement from there to the first peak \[m\].
    pub peak_m: f64,
    /// Displacement from there to rest \[m\].
    pub rest_m: f64,
    /// Time from a tenth to nine tenths of the way to rest \[s\].
    pub rise_s: f64,
    /// Width of the first peak at half of its prominence \[s\].
    pub peak_width_s: f64,
    /// Width of the first valley at half of its prominence \[s\].
    pub valley_width_s: f64,
}

impl ReleaseFeatures {
    /// The features in the order of their declaration.
    pub fn to_array(self) -> [f64; 6] {
        let Self { initial_m, peak_m, rest_m, rise_s, peak_width_s, valley_width_s } = self;
        [initial_m, peak_m, rest_m, rise_s, peak_width_s, valley_width_s]
    }

    /// Weighted sum of the magnitudes of the differences to measured features.
    pub fn cost(self, measured: Self, weights: [f64; 6]) -> f64 {
        let both = self.to_array().into_iter().zip(measured.to_array());
        both.zip(weights).map(|((own, measured), weight)| weight * (own - measured).abs()).sum()
    }
}

/// Why a record has no features.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum ReleaseError {
    #[error("the record has {0} samples; take at least 20 from the release to the rest")]
    TooShort(usize),
    #[error("sample {0} is not a finite number")]
    NotFinite(usize),
    #[error("the step between samples is {0} s; it has to be above 0")]
    Step(f64),
    #[error(
        "the tip does not swing: after its first peak it has no valley and no second peak. Record longer"
    )]
    NoSwing,
    #[error("the tip does not move away from where it hung: check the sign of the position")]
    NoRise,
}

/// Features of a record of the tip's position, one sample each `step_s` from the moment of release on,
/// positive against the weight.
pub fn release_features(position_m: &[f64], step_s: f64) -> Result<ReleaseFeatures, ReleaseError> {
    if position_m.len() < 20 {
        return Err(ReleaseError::TooShort(position_m.len()));
    }
    if let Some(sample) = position_m.iter().position(|x| !x.is_finite()) {
        return Err(ReleaseError::NotFinite(sample));
    }
    if step_s.is_nan() || step_s <= 0.0 {
        return Err(ReleaseError::Step(step_s));
    }
    let initial_m = position_m[0];
    let resting = (position_m.len() as f64 * AT_REST).ceil() as usize;
    let end = &position_m[position_m.len() - resting..];
    let rest_m = end.iter().sum::<f64>() / end.len() as f64 - initial_m;
    if rest_m <= 0.0 {
        return Err(ReleaseError::NoRise);
    }
    let [low, high] = RISE.map(|share| first_crossing(position_m, 0, initial_m + share * rest_m));
    let (low, high) = low.zip(high).ok_or(ReleaseError::NoRise)?;
    // The swing is about the rest: its peaks lie above, its valleys below.
    let level = initial_m + rest_m;
    let lobes = lobes(position_m, level);
    let [peak, valley, second, ..] = lobes[..] else { return Err(ReleaseError::NoSwing) };
    let width = |at: usize, half: f64| {
        let (before, after) =
            (last_crossing(position_m, at, half), first_crossing(position_m, at, half));
        before.zip(after).map(|(before, after)| (after - before) * step_s)
    };
    let (top, bottom, next) = (position_m[peak], position_m[valley], position_m[second]);
    let peak_width_s = width(peak, 0.5 * (top + bottom)).ok_or(ReleaseError::NoSwing)?;
    let valley_width_s = width(valley, 0.5 * (bottom + next)).ok_or(ReleaseError::NoSwing)?;
    Ok(ReleaseFeatures {
        initial_m,
        peak_m: top - initial_m,
        rest_m,
        rise_s: (high - low) * step_s,
        peak_width_s,
        valley_width_s,
    })
}

/// The extremes of the first three lobes of a swing about a level, from above it on.
fn lobes(position_m: &[f64], level: f64) -> Vec<usize> {
    let mut found = Vec::new();
    let Some(first) = position_m.iter().position(|&x| x > level) else { return found };
    let (mut best, mut above) = (first, true);
    for (i, &x) in position_m.iter().enumerate().skip(first) {
        if (x > level) != above {
            found.push(best);
            (best, above) = (i, !above);
            if found.len() == 3 {
                break;
            }
        }
        let farther = if above { x > position_m[best] } else { x < position_m[best] };
        if farther {
            best = i;
        }
    }
    found
}

/// A catheter that is clamped along the horizontal, with a weight on a thread from its tip.
#[derive(Clone, Copy, Debug)]
pub struct Suspended<'a> {
    /// The catheter and its surroundings, without the weight.
    pub problem: &'a Problem,
    /// Free length \[m\].
    pub length_m: f64,
    pub weight_kg: f64,
}

/// Record of a simulated release.
#[derive(Clone, Debug, PartialEq)]
pub struct Release {
    /// Position of the tip against gravity \[m\], from the release on.
    pub position_m: Vec<f64>,
    pub step_s: f64,
}

impl Suspended<'_> {
    /// Hangs the weight, lets the catheter rest, cuts the thread and records for `duration_s`.
    pub fn release(&self, duration_s: f64) -> Result<Release, SolveError> {
        let at = self.at();
        let simulation = Simulation::settled(&self.laden(), at)?.released(self.problem);
        self.record(simulation, duration_s)
    }

    /// The same from the rest of another catheter of the same length and mesh, which saves feeding it in.
    ///
    /// `rest`: without a weight. Errors: no balance is found.
    pub fn release_from(
        &self,
        rest: &Simulation<'_>,
        duration_s: f64,
    ) -> Result<Release, SolveError> {
        let mut laden = self.laden();
        // Inertia over the square of such a step is nothing: each of them is one of rest.
        laden.numerics.integrator = Integrator::Euler;
        let mut simulation = rest.clone().released(&laden);
        let mut tip_m = simulation.sample().tip_m;
        for _ in 0..MOST_HANGING_STEPS {
            let next_m = simulation.step(HANGING_STEP_S, self.at())?.tip_m;
            let moved_m = (next_m - tip_m).norm();
            tip_m = next_m;
            if moved_m < HANGS_STILL * self.length_m {
                break;
            }
        }
        self.record(simulation.released(self.problem), duration_s)
    }

    fn at(&self) -> Drive {
        Drive { insertion_m: self.length_m, rotation_rad: 0.0 }
    }

    fn laden(&self) -> Problem {
        let mut laden = self.problem.clone();
        laden.tip_load = TipLoad {
            force_n: self.problem.tip_load.force_n + self.problem.gravity_m_per_s2 * self.weight_kg,
            ..self.problem.tip_load
        };
        laden
    }

    fn record(
        &self,
        mut simulation: Simulation<'_>,
        duration_s: f64,
    ) -> Result<Release, SolveError> {
        let down = self.problem.gravity_m_per_s2;
        let against = down.try_normalize(0.0).map_or_else(Vector3::zeros, |down| -down);
        let height = |tip_m: Vector3<f64>| (tip_m - self.problem.entry.position_m).dot(&against);
        let step_s = self.problem.numerics.step_s;
        let mut position_m = vec![height(simulation.sample().tip_m)];
        for _ in 0..(duration_s / step_s).round() as usize {
            position_m.push(height(simulation.step(step_s, self.at())?.tip_m));
        }
        Ok(Release { position_m, step_s })
    }
}

impl Release {
    /// Every so many samples of the record, from the release on.
    pub fn every(&self, samples: usize) -> Self {
        let samples = samples.max(1);
        Self {
            position_m: self.position_m.iter().step_by(samples).copied().collect(),
            step_s: self.step_s * samples as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_damped_swing_has_the_features_of_its_closed_form() {
        // x'' + 2 ζ ω x' + ω² (x − 1) = 0 from rest at 0.
        let (zeta, omega, step_s) = (0.1_f64, 40.0_f64, 1e-4);
        let damped = omega * (1.0 - zeta * zeta).sqrt();
        let x = |t: f64| {
            let fade = (-zeta * omega * t).exp();
            1.0 - fade * ((damped * t).cos() + zeta * omega / damped * (damped * t).sin())
        };
        let record: Vec<f64> =
            (0..30_000).map(|i| -0.2 + 0.05 * x(f64::from(i) * step_s)).collect();
        let found = release_features(&record, step_s).unwrap();
        // Extremes at multiples of half a period; each is farther from rest than the next by exp(ζ ω π/ω_d).
        let overshoot = (-zeta * omega * std::f64::consts::PI / damped).exp();
        assert!((found.initial_m + 0.2).abs() < 1e-12);
        assert!((found.rest_m - 0.05).abs() < 1e-6, "{found:?}");
        assert!((found.peak_m / (0.05 * (1.0 + overshoot)) - 1.0).abs() < 1e-4, "{found:?}");
        let root = |level: f64, mut low: f64, mut high: f64| {
            let rising = x(low) < level;
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if (x(middle) < level) == rising { low = middle } else { high = middle }
            }
            low
        };
        let half = std::f64::consts::PI / damped;
        let rise_s = root(0.9, 0.0, half) - root(0.1, 0.0, half);
        assert!((found.rise_s - rise_s).abs() < 1e-6, "{found:?} {rise_s}");
        let level = 0.5 * (x(half) + x(2.0 * half));
        let width_s = root(level, half, 2.0 * half) - root(level, 0.0, half);
        assert!((found.peak_width_s - width_s).abs() < 1e-6, "{found:?} {width_s}");
        let level = 0.5 * (x(2.0 * half) + x(3.0 * half));
        let width_s = root(level, 2.0 * half, 3.0 * half) - root(level, half, 2.0 * half);
        assert!((found.valley_width_s - width_s).abs() < 1e-6, "{found:?} {width_s}");
        assert_eq!(found.cost(found, [1.0; 6]), 0.0);
    }

    #[test]
    fn a_record_without_a_swing_says_why() {
        let slow: Vec<f64> = (0..100).map(|i| 1.0 - (-0.1 * f64::from(i)).exp()).collect();
        assert_eq!(release_features(&slow, 1e-3), Err(ReleaseError::NoSwing));
        let fallen: Vec<f64> = slow.iter().map(|x| -x).collect();
        assert_eq!(release_features(&fallen, 1e-3), Err(ReleaseError::NoRise));
        assert_eq!(release_features(&slow[..5], 1e-3), Err(ReleaseError::TooShort(5)));
        assert_eq!(release_features(&slow, 0.0), Err(ReleaseError::Step(0.0)));
        let mut broken = slow;
        broken[7] = f64::NAN;
        assert_eq!(release_features(&broken, 1e-3), Err(ReleaseError::NotFinite(7)));
    }
}
