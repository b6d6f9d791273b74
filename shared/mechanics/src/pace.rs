//! The drives' pace: what a tick of theirs is of those before, and so what links and samples, which
//! follow the drives, are likely to do in it.

use crate::model::{maximum, minimum};
use crate::{Drive, Drives, Model, Real, State};

/// Drives that move by less in a tick say nothing of how links will turn \[m\].
const LEAST_M: f64 = 1e-7;
/// What a tick may be of those before it. Never nothing: what it multiplies is divided by.
const PACED: core::ops::Range<f64> = 1e-6..1.0;
/// An encoder whose steps are farther apart than so many ticks stands still in between; rates are worth
/// no more than as many of them.
const TICKS_A_STEP: u8 = 16;

/// How far a drive moves the surface of its instrument in a tick, along and about it \[m\].
#[derive(Clone, Copy, Debug)]
struct Moved<T>([T; 2]);

impl<T: Real> Moved<T> {
    const NOT: Self = Self([T::ZERO; 2]);

    fn between(before: &Drive<T>, now: &Drive<T>, radius_m: T) -> Self {
        let turned_rad = now.rotation_rad - before.rotation_rad;
        Self([now.insertion_m - before.insertion_m, turned_rad * radius_m])
    }

    fn dot(&self, other: &Self) -> T {
        let ([a, b], [c, d]) = (self.0, other.0);
        a * c + b * d
    }

    /// Goes on towards `other` by that share of the way.
    fn approach(&mut self, other: &Self, share: T) {
        let ([a, b], [c, d]) = (self.0, other.0);
        self.0 = [a + (c - a) * share, b + (d - b) * share];
    }
}

/// How the drives moved before; of each pair the catheter's comes first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace<T> {
    last: [Moved<T>; 2],
    /// Smoothed as the rates of the links are.
    smoothed: [Moved<T>; 2],
    /// Ticks since the last one that was worth as much as half of those before it.
    still: u8,
}

/// How a tick goes on from those before.     docs/model.md (44)
#[derive(Clone, Copy, Debug)]
pub(crate) struct Paced<T> {
    /// What the links' rates are worth in it.
    pub rates: T,
    /// What samples on the catheter and on the guidewire will slide of what they slid in the last
    /// one, at most 1.
    pub sliding: [T; 2],
}

impl<T: Real> Paced<T> {
    /// As before.
    pub const EVEN: Self = Self { rates: T::ONE, sliding: [T::ONE; 2] };

    /// In the next part of the same tick: as in the one before, which the rates know of now.
    pub fn go_on(&mut self, gain: T) {
        self.rates /= T::ONE + gain * (self.rates - T::ONE);
        self.sliding = Self::EVEN.sliding;
    }
}

impl<T: Real> Pace<T> {
    /// Drives that rest.
    pub const fn none() -> Self {
        Self { last: [Moved::NOT; 2], smoothed: [Moved::NOT; 2], still: 0 }
    }

    /// Takes a tick of the catheter and the guidewire into account; `gain` is that of the rates.
    ///                                                                      docs/model.md (44)
    fn go_on(&mut self, moved: [Moved<T>; 2], gain: T) -> Paced<T> {
        let [least, most] = [PACED.start, PACED.end].map(T::lit);
        let within = |paced: T, most: T| minimum(maximum(paced, least), most);
        // What speeds up may go another way than it went. A step of an encoder after ticks without
        // one does not: it stands for all of them, in which the rates have faded.
        let stands_for = match self.still {
            0 | TICKS_A_STEP.. => 1,
            still => (2 * (still + 1)).min(TICKS_A_STEP),
        };
        let [last, smoothed] = [&self.last, &self.smoothed];
        let paced = Paced {
            rates: within(measure(smoothed, &moved), T::int(i32::from(stands_for))),
            sliding: [0, 1].map(|i| within(measure(&last[i..=i], &moved[i..=i]), most)),
        };
        let is_still = dot(&moved, &moved) * T::int(4) < dot(smoothed, smoothed);
        self.still = if is_still { self.still.saturating_add(1) } else { 0 };
        self.last = moved;
        for (smoothed, moved) in self.smoothed.iter_mut().zip(&moved) {
            smoothed.approach(moved, gain);
        }
        paced
    }
}

impl<T: Real, const LINKS: usize> State<T, LINKS> {
    /// Takes a tick of the drives into account, which are to go to `target`.     docs/model.md (44)
    pub(crate) fn keep_pace(&mut self, model: &Model<T, LINKS>, target: &Drives<T>) -> Paced<T> {
        if self.count == 0 {
            // The links whose rates go by it are gone.
            self.pace = Pace::none();
        }
        let description = model.description();
        let solver = &description.solver;
        // The rates are smoothed once a step.
        let kept = T::one() - solver.predictor_gain;
        let kept = (1..solver.substeps.max(1)).fold(kept, |kept_until, _| kept_until * kept);
        let before = &self.drives;
        let radius_m = description.instrument.outer_radius_m;
        let catheter = Moved::between(&before.catheter, &target.catheter, radius_m);
        let guidewire = description.guidewire.as_ref().map_or(Moved::NOT, |wire| {
            Moved::between(&before.guidewire, &target.guidewire, wire.outer_radius_m)
        });
        self.pace.go_on([catheter, guidewire], T::one() - kept)
    }
}

fn dot<T: Real>(a: &[Moved<T>], b: &[Moved<T>]) -> T {
    a.iter().zip(b).fold(T::ZERO, |sum, (a, b)| sum + a.dot(b))
}

/// What the motion `of` is of the one that it is measured `by`, and goes the same way.
fn measure<T: Real>(by: &[Moved<T>], of: &[Moved<T>]) -> T {
    let least = T::lit(LEAST_M * LEAST_M);
    (dot(by, of) + least) / (dot(by, by) + least)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn go(pace: &mut Pace<f64>, [along, about, wire_along, wire_about]: [f64; 4]) -> Paced<f64> {
        pace.go_on([Moved([along, about]), Moved([wire_along, wire_about])], 0.12)
    }

    /// What a tick is worth after many `before`.
    fn after(before: [f64; 4], now: [f64; 4]) -> [f64; 3] {
        let mut pace = Pace::none();
        for _ in 0..300 {
            go(&mut pace, before);
        }
        let Paced { rates, sliding: [catheter, guidewire] } = go(&mut pace, now);
        [rates, catheter, guidewire]
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
        // A turn is no feed.
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
        let mut pace = Pace::none();
        let mut worth = [0.0; 4];
        for tick in 0..400 {
            let by_m = if tick % 4 == 0 { 1e-5 } else { 0.0 };
            worth[tick % 4] = go(&mut pace, [by_m, 0.0, 0.0, 0.0]).rates;
        }
        assert!(worth[0] > 4.0 && worth[0] <= 8.0, "{worth:?}");
        assert!(worth[1..].iter().all(|of| *of < 0.01), "{worth:?}");
    }

    #[test]
    fn a_drive_that_starts_again_is_worth_no_more_than_it_was() {
        let mut pace = Pace::none();
        let feed = [1e-5, 0.0, 0.0, 0.0];
        for _ in 0..300 {
            go(&mut pace, feed);
        }
        for _ in 0..TICKS_A_STEP {
            go(&mut pace, [0.0; 4]);
        }
        assert_near(
            {
                let Paced { rates, sliding: [catheter, guidewire] } = go(&mut pace, feed);
                [rates, catheter, guidewire]
            },
            [1.0; 3],
        );
    }
}
