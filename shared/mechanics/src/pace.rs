//! The drives' pace: what a step of theirs is of those before, and so what links and samples, which
//! follow the drives, are likely to do in it.

use crate::model::{maximum, minimum};
use crate::{Drive, Drives, Model, Real, State};

/// Drives that move by less in a step say nothing of how links will turn \[m\].
const LEAST_M: f64 = 1e-7;
/// What a step may be of those before it. Never nothing: what it multiplies is divided by.
const PACED: core::ops::Range<f64> = 1e-6..1.0;
/// After a step of an encoder that did not come a rate stands for several of them; coarser steps than
/// this many are no motion any more.
const STEPS_AT_ONCE: f64 = 16.0;

/// How far the drives move the surfaces of the instruments in a step \[m\].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moved<T> {
    /// Of the catheter, then of the guidewire: along and about it.
    surfaces: [T; 4],
}

impl<T: Real> Moved<T> {
    pub fn between<const LINKS: usize>(
        model: &Model<T, LINKS>,
        before: &Drives<T>,
        now: &Drives<T>,
    ) -> Self {
        let radius_m = model.description().instrument.outer_radius_m;
        let along = |before: &Drive<T>, now: &Drive<T>| now.insertion_m - before.insertion_m;
        let about =
            |before: &Drive<T>, now: &Drive<T>| (now.rotation_rad - before.rotation_rad) * radius_m;
        Self {
            surfaces: [
                along(&before.catheter, &now.catheter),
                about(&before.catheter, &now.catheter),
                along(&before.guidewire, &now.guidewire),
                about(&before.guidewire, &now.guidewire),
            ],
        }
    }

    fn none() -> Self {
        Self { surfaces: [T::zero(); 4] }
    }

    /// The way of the faster one \[m\].
    pub fn surface_m(&self) -> T {
        let [a, b, c, d] = self.surfaces;
        maximum(a * a + b * b, c * c + d * d).root()
    }

    /// Goes on towards `other` by that share of the way.
    fn approach(&mut self, other: &Self, share: T) {
        self.surfaces = core::array::from_fn(|i| {
            self.surfaces[i] + (other.surfaces[i] - self.surfaces[i]) * share
        });
    }

    fn dot(&self, other: &Self) -> T {
        let ([a, b, c, d], [e, f, g, h]) = (self.surfaces, other.surfaces);
        a * e + b * f + (c * g + d * h)
    }

    /// What `other` is of it, and goes the same way.
    fn measures(&self, other: &Self) -> T {
        let least = T::lit(LEAST_M * LEAST_M);
        (self.dot(other) + least) / (self.dot(self) + least)
    }
}

/// How the drives moved before.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace<T> {
    last: Moved<T>,
    /// Smoothed as the rates of the links are.
    smoothed: Moved<T>,
}

/// How a step goes on from those before.     docs/model.md (44)
#[derive(Clone, Copy, Debug)]
pub(crate) struct Paced<T> {
    /// What the links' rates are worth in it.
    pub rates: T,
    /// What samples will slide of what they slid in the last one, at most 1.
    pub sliding: T,
}

impl<T: Real> Pace<T> {
    /// Drives that rest.
    pub fn none() -> Self {
        Self { last: Moved::none(), smoothed: Moved::none() }
    }

    /// Takes a step into account; `gain` is that of the rates.     docs/model.md (44)
    fn go_on(&mut self, moved: &Moved<T>, gain: T) -> Paced<T> {
        let [least, most] = [PACED.start, PACED.end].map(T::lit);
        // What speeds up may go another way than it went. An encoder that steps in some ticks alone
        // does not.
        let stepped = self.last.dot(&self.last) * T::int(4) < self.smoothed.dot(&self.smoothed);
        let most_rates = if stepped { T::lit(STEPS_AT_ONCE) } else { most };
        let paced = Paced {
            rates: minimum(maximum(self.smoothed.measures(moved), least), most_rates),
            sliding: minimum(maximum(self.last.measures(moved), least), most),
        };
        self.last = *moved;
        self.smoothed.approach(moved, gain);
        paced
    }
}

impl<T: Real, const LINKS: usize> State<T, LINKS> {
    /// Takes a step of the drives into account.     docs/model.md (44)
    pub(crate) fn keep_pace(&mut self, moved: &Moved<T>, gain: T) -> Paced<T> {
        if self.count == 0 {
            // The links whose rates go by it are gone.
            self.pace = Pace::none();
            return Paced { rates: T::one(), sliding: T::one() };
        }
        self.pace.go_on(moved, gain)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moved(surfaces: [f64; 4]) -> Moved<f64> {
        Moved { surfaces }
    }

    #[test]
    fn a_surface_moves_by_feed_and_turn_and_the_faster_one_counts() {
        let is = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-15, "{found}");
        is(moved([0.0; 4]).surface_m(), 0.0);
        is(moved([-3e-6, 4e-6, 0.0, 0.0]).surface_m(), 5e-6);
        is(moved([0.0, 0.0, 7e-6, 0.0]).surface_m(), 7e-6);
    }

    /// What a step is worth after many steps `before`.
    fn after(before: Moved<f64>, now: Moved<f64>) -> [f64; 2] {
        let mut pace = Pace::none();
        for _ in 0..300 {
            pace.go_on(&before, 0.12);
        }
        let Paced { rates, sliding } = pace.go_on(&now, 0.12);
        [rates, sliding]
    }

    #[test]
    fn a_drive_that_goes_on_is_worth_what_it_was_and_one_that_stops_or_turns_nothing() {
        let feed = moved([1e-5, 0.0, 0.0, 0.0]);
        let near = |found: [f64; 2], expected: f64| {
            let off = found.map(|x| (x - expected).abs());
            assert!(off[0] < 1e-3 && off[1] < 1e-3, "{found:?}, not {expected}");
        };
        near(after(feed, feed), 1.0);
        near(after(feed, moved([5e-6, 0.0, 0.0, 0.0])), 0.5);
        near(after(feed, moved([2e-5, 0.0, 0.0, 0.0])), 1.0);
        near(after(feed, Moved::none()), 1e-4);
        near(after(feed, moved([-1e-5, 0.0, 0.0, 0.0])), 1e-6);
        // A turn is no feed.
        near(after(feed, moved([0.0, 1e-5, 0.0, 0.0])), 1e-4);
        near(after(Moved::none(), Moved::none()), 1.0);
    }

    #[test]
    fn steps_of_an_encoder_are_worth_as_many_ticks_as_they_stand_for() {
        let mut pace = Pace::none();
        let step = moved([1e-5, 0.0, 0.0, 0.0]);
        let mut worth = [0.0; 4];
        for tick in 0..400 {
            let now = if tick % 4 == 0 { step } else { Moved::none() };
            worth[tick % 4] = pace.go_on(&now, 0.12).rates;
        }
        assert!(worth[0] > 3.0 && worth[0] < 6.0, "{worth:?}");
        assert!(worth[1..].iter().all(|of| *of < 0.01), "{worth:?}");
    }
}
