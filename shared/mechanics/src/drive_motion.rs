//! Motion of the drives in a tick over their motion in earlier ticks. Links move because the drives
//! do, so the predictor scales each filtered rate, and each contact its last slip, by this ratio.

use crate::math::{maximum, minimum};
use crate::{Drive, Drives, Model, Real};

/// Motion of a drive in a tick that is too small to predict anything from \[m\].
const NEGLIGIBLE_MOTION_M: f64 = 1e-7;
/// Range of a motion ratio. It excludes 0, because scaled quantities are divided by.
const RATIO_RANGE: core::ops::Range<f64> = 1e-6..1.0;
/// Longest time between two steps of a coarse encoder that counts as motion \[ticks\]; also the largest
/// ratio.
const MAX_TICKS_PER_ENCODER_STEP: u8 = 16;

/// Motion of an instrument's surface in a tick, along and about its axis \[m\].
#[derive(Clone, Copy, Debug)]
struct SurfaceMotion<T>([T; 2]);

impl<T: Real> SurfaceMotion<T> {
    const NONE: Self = Self([T::ZERO; 2]);

    fn between(before: &Drive<T>, now: &Drive<T>, radius_m: T) -> Self {
        let turned_rad = now.rotation_rad - before.rotation_rad;
        Self([now.insertion_m - before.insertion_m, turned_rad * radius_m])
    }

    fn dot(&self, other: &Self) -> T {
        let ([a, b], [c, d]) = (self.0, other.0);
        a * c + b * d
    }

    /// Moves towards `other` by that share of the difference.
    fn approach(&mut self, other: &Self, share: T) {
        let ([a, b], [c, d]) = (self.0, other.0);
        self.0 = [a + (c - a) * share, b + (d - b) * share];
    }
}

/// Earlier motion of the drives. Pairs hold the catheter's first, then the guidewire's.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DriveHistory<T> {
    last: [SurfaceMotion<T>; 2],
    /// Smoothed with the same gain as the rates of the links.
    smoothed: [SurfaceMotion<T>; 2],
    /// Ticks since the last one with at least half the smoothed motion.
    idle_ticks: u8,
}

/// Motion of the drives in this tick over earlier motion.     docs/explanation/model.md (4)
#[derive(Clone, Copy, Debug)]
pub(crate) struct MotionRatio<T> {
    /// Factor on the links' rates, from the smoothed motion of both drives \[1\].
    pub link_rates: T,
    /// Factor on the last slip of samples on the catheter and on the guidewire, from the last motion of
    /// each drive; at most 1 \[1\].
    pub sliding: [T; 2],
}

impl<T: Real> MotionRatio<T> {
    /// The drives move as before.
    pub const STEADY: Self = Self { link_rates: T::ONE, sliding: [T::ONE; 2] };

    /// For the next substep of the same tick, whose motion the rates have already been filtered with.
    pub fn next_substep(&mut self, gain: T) {
        self.link_rates /= T::ONE + gain * (self.link_rates - T::ONE);
        self.sliding = Self::STEADY.sliding;
    }
}

impl<T: Real> DriveHistory<T> {
    /// Drives at rest.
    pub const fn none() -> Self {
        Self { last: [SurfaceMotion::NONE; 2], smoothed: [SurfaceMotion::NONE; 2], idle_ticks: 0 }
    }

    /// Takes in the motion of the drives in a tick, from `before` to `target`.
    /// docs/explanation/model.md (4)
    pub fn observe<const LINKS: usize>(
        &mut self,
        model: &Model<T, LINKS>,
        before: &Drives<T>,
        target: &Drives<T>,
    ) -> MotionRatio<T> {
        let description = model.description();
        let solver = &description.solver;
        // Rates are filtered once per step, so the history is filtered with the gain of all steps.
        let kept = T::one() - solver.predictor_gain;
        let kept = (1..solver.substeps.max(1)).fold(kept, |kept_until, _| kept_until * kept);
        let radius_m = description.instrument.outer_radius_m;
        let catheter = SurfaceMotion::between(&before.catheter, &target.catheter, radius_m);
        let guidewire = description.guidewire.as_ref().map_or(SurfaceMotion::NONE, |wire| {
            SurfaceMotion::between(&before.guidewire, &target.guidewire, wire.outer_radius_m)
        });
        self.update([catheter, guidewire], T::one() - kept)
    }

    /// Takes in the motion of the catheter and the guidewire in a tick; `gain`: of the rates' filter.
    /// docs/explanation/model.md (4)
    fn update(&mut self, moved: [SurfaceMotion<T>; 2], gain: T) -> MotionRatio<T> {
        let [least, most] = [RATIO_RANGE.start, RATIO_RANGE.end].map(T::lit);
        let within = |ratio: T, most: T| minimum(maximum(ratio, least), most);
        // A ratio above 1 would amplify a motion that may have changed direction. A step of a coarse
        // encoder after idle ticks is different: it contains the motion of all of them, while the
        // filtered rates have decayed.
        let stands_for = match self.idle_ticks {
            0 | MAX_TICKS_PER_ENCODER_STEP.. => 1,
            idle_ticks => (2 * (idle_ticks + 1)).min(MAX_TICKS_PER_ENCODER_STEP),
        };
        let [last, smoothed] = [&self.last, &self.smoothed];
        let ratio = MotionRatio {
            link_rates: within(motion_ratio(smoothed, &moved), T::int(i32::from(stands_for))),
            sliding: [0, 1].map(|i| within(motion_ratio(&last[i..=i], &moved[i..=i]), most)),
        };
        let is_still = dot(&moved, &moved) * T::int(4) < dot(smoothed, smoothed);
        self.idle_ticks = if is_still { self.idle_ticks.saturating_add(1) } else { 0 };
        self.last = moved;
        for (smoothed, moved) in self.smoothed.iter_mut().zip(&moved) {
            smoothed.approach(moved, gain);
        }
        ratio
    }
}

fn dot<T: Real>(a: &[SurfaceMotion<T>], b: &[SurfaceMotion<T>]) -> T {
    a.iter().zip(b).fold(T::ZERO, |sum, (a, b)| sum + a.dot(b))
}

/// Projection of the motion `of` on the motion `by`, over the length of `by`.
fn motion_ratio<T: Real>(by: &[SurfaceMotion<T>], of: &[SurfaceMotion<T>]) -> T {
    let least = T::lit(NEGLIGIBLE_MOTION_M * NEGLIGIBLE_MOTION_M);
    (dot(by, of) + least) / (dot(by, by) + least)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn go(
        history: &mut DriveHistory<f64>,
        [along, about, wire_along, wire_about]: [f64; 4],
    ) -> MotionRatio<f64> {
        history
            .update([SurfaceMotion([along, about]), SurfaceMotion([wire_along, wire_about])], 0.12)
    }

    /// The ratios of a tick that moves by `now` after many that moved by `before`.
    fn after(before: [f64; 4], now: [f64; 4]) -> [f64; 3] {
        let mut history = DriveHistory::none();
        for _ in 0..300 {
            go(&mut history, before);
        }
        let MotionRatio { link_rates, sliding: [catheter, guidewire] } = go(&mut history, now);
        [link_rates, catheter, guidewire]
    }

    fn assert_near(found: [f64; 3], expected: [f64; 3]) {
        let near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-3);
        assert!(near, "{found:?}, not {expected:?}");
    }

    #[test]
    fn a_drive_that_goes_on_is_worth_what_it_was_and_one_that_stops_or_turns_nothing() {
        let (rest, feed) = ([0.0; 4], [1e-5, 0.0, 0.0, 0.0]);
        assert_near(after(feed, feed), [1.0; 3]);
        assert_near(after(feed, [5e-6, 0.0, 0.0, 0.0]), [0.5, 0.5, 1.0]);
        assert_near(after(feed, [2e-5, 0.0, 0.0, 0.0]), [1.0; 3]);
        assert_near(after(feed, rest), [0.0, 0.0, 1.0]);
        assert_near(after(feed, [-1e-5, 0.0, 0.0, 0.0]), [0.0, 0.0, 1.0]);
        // Rotation does not predict feed.
        assert_near(after(feed, [0.0, 1e-5, 0.0, 0.0]), [0.0, 0.0, 1.0]);
        assert_near(after(rest, rest), [1.0; 3]);
    }

    #[test]
    fn what_one_drive_does_says_nothing_of_what_slides_on_the_other() {
        let both = [1e-5, 0.0, 1e-5, 0.0];
        assert_near(after(both, [0.0, 0.0, 1e-5, 0.0]), [0.5, 0.0, 1.0]);
        assert_near(after(both, [1e-5, 0.0, 0.0, 0.0]), [0.5, 1.0, 0.0]);
    }

    #[test]
    fn steps_of_an_encoder_are_worth_as_many_ticks_as_they_stand_for() {
        let mut history = DriveHistory::none();
        let mut worth = [0.0; 4];
        for tick in 0..400 {
            let by_m = if tick % 4 == 0 { 1e-5 } else { 0.0 };
            worth[tick % 4] = go(&mut history, [by_m, 0.0, 0.0, 0.0]).link_rates;
        }
        assert!(worth[0] > 4.0 && worth[0] <= 8.0, "{worth:?}");
        assert!(worth[1..].iter().all(|of| *of < 0.01), "{worth:?}");
    }

    #[test]
    fn a_drive_that_starts_again_is_worth_no_more_than_it_was() {
        let mut history = DriveHistory::none();
        let feed = [1e-5, 0.0, 0.0, 0.0];
        for _ in 0..300 {
            go(&mut history, feed);
        }
        for _ in 0..MAX_TICKS_PER_ENCODER_STEP {
            go(&mut history, [0.0; 4]);
        }
        assert_near(
            {
                let MotionRatio { link_rates, sliding: [catheter, guidewire] } =
                    go(&mut history, feed);
                [link_rates, catheter, guidewire]
            },
            [1.0; 3],
        );
    }
}
