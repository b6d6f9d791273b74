//! Phases and regimes of a drive: what it does at a moment, by its speed and its acceleration.

use super::effects::Scale;
use super::motion::Motion;

/// Slower than this share of the largest speed is standing.
const STANDING_SHARE: f64 = 0.01;
/// Faster than this share of the largest speed is fast, slower than the other one is slow.
const FAST_SHARE: f64 = 2.0 / 3.0;
const SLOW_SHARE: f64 = 1.0 / 3.0;
/// An acceleration above this share of the largest one is hard.
const HARD_SHARE: f64 = 0.3;
/// Samples within this of a change of direction belong to the reversal \[s\].
const REVERSAL_S: f64 = 0.05;

pub(super) const PHASES: [&str; 5] =
    ["standing", "reversal", "speeding up", "slowing down", "steady"];

/// Where regimes and phases of a bundle begin.
pub(super) struct Limits {
    speed_m_per_s: f64,
    acceleration_m_per_s2: f64,
}

/// Standing, or direction × speed × acceleration.
pub(super) struct Regime;

impl Regime {
    pub(super) fn names() -> Vec<String> {
        let mut names = vec!["standing".to_owned()];
        for direction in ["forward", "backward"] {
            for speed in ["slow", "middle", "fast"] {
                for load in ["", ", hard"] {
                    names.push(format!("{direction}, {speed}{load}"));
                }
            }
        }
        names
    }
}

impl Limits {
    pub(super) fn of(scale: &Scale, motions: &[Motion]) -> Self {
        let all = motions.iter().flat_map(|m| m.acceleration_m_per_s2.iter().map(|a| a.abs()));
        let acceleration_m_per_s2 = all.fold(0.0, f64::max);
        Self { speed_m_per_s: scale.speed_m_per_s, acceleration_m_per_s2 }
    }

    pub(super) fn regime(&self, velocity: f64, acceleration: f64) -> usize {
        let share = velocity.abs() / self.speed_m_per_s;
        if share < STANDING_SHARE {
            return 0;
        }
        let speed = usize::from(share > SLOW_SHARE) + usize::from(share > FAST_SHARE);
        let hard = acceleration.abs() > HARD_SHARE * self.acceleration_m_per_s2;
        1 + usize::from(velocity < 0.0) * 6 + speed * 2 + usize::from(hard)
    }

    pub(super) fn phase(&self, motion: &Motion, i: usize) -> usize {
        let velocity = &motion.velocity_m_per_s;
        let reach = (REVERSAL_S / motion.dt_s) as usize;
        let around = &velocity[i.saturating_sub(reach)..(i + reach).min(velocity.len())];
        let standing = STANDING_SHARE * self.speed_m_per_s;
        let turns = around.iter().any(|v| *v > standing) && around.iter().any(|v| *v < -standing);
        let power = velocity[i] * motion.acceleration_m_per_s2[i];
        let steady = motion.acceleration_m_per_s2[i].abs() < 0.05 * self.acceleration_m_per_s2;
        match () {
            () if turns => 1,
            () if velocity[i].abs() < standing => 0,
            () if steady => 4,
            () if power > 0.0 => 2,
            () => 3,
        }
    }
}
