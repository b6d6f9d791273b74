//! What the drive does: never the protocol that a diagnosis asks for.

use cathforce_reference_solver::Schedule;
use rand::Rng;
use serde::{Deserialize, Serialize};

/// How the drive was moved in all trials of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MotionKind {
    /// Fed at one speed, without a reversal.
    OneSpeed,
    /// By hand: the speed wanders, with pauses and small steps back.
    Hand,
    /// Fed in pieces with dwells between them.
    Dwells,
    /// Turned much and fed little.
    Rotation,
    /// Trials of less than two seconds.
    Short,
}

/// Where motions may go \[m\].
#[derive(Clone, Copy, Debug)]
pub struct Way {
    pub start_m: f64,
    pub reach_m: f64,
}

/// Rest before the first motion, so that the zero of the sensors shows \[s\].
const REST_S: f64 = 0.3;
/// A motor changes its speed within this, a hand more slowly \[s\].
const RAMP_S: f64 = 0.08;
const HAND_RAMP_S: [f64; 2] = [0.15, 0.35];

impl MotionKind {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::OneSpeed, Self::Hand, Self::Dwells, Self::Rotation, Self::Short];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::OneSpeed => "one speed",
            Self::Hand => "by hand",
            Self::Dwells => "dwells",
            Self::Rotation => "mostly rotation",
            Self::Short => "short trials",
        }
    }

    /// The motion of one trial.
    pub fn draw(self, way: Way, rng: &mut impl Rng) -> Schedule {
        let turned = rng.random_range(0.0..std::f64::consts::TAU);
        let length_m = way.reach_m - way.start_m;
        let begin = |at_m: f64| Schedule::starting_at(at_m, turned).then(REST_S, 0.0, 0.0, 0.0);
        match self {
            Self::OneSpeed => {
                let (speed, share) = (rng.random_range(0.009..0.028), rng.random_range(0.75..0.98));
                let fed = begin(way.start_m).then(share * length_m / speed, RAMP_S, speed, 0.0);
                fed.then(REST_S, RAMP_S, 0.0, 0.0)
            }
            Self::Hand => by_hand(begin(way.start_m), way, rng),
            Self::Dwells => {
                let pieces = rng.random_range(3..6);
                let mut own = begin(way.start_m);
                for _ in 0..pieces {
                    let speed = rng.random_range(0.015..0.03);
                    let fed_m = 0.95 * length_m / f64::from(pieces);
                    own = own.then(fed_m / speed, RAMP_S, speed, 0.0);
                    own = own.then(rng.random_range(0.3..0.8), RAMP_S, 0.0, 0.0);
                }
                own
            }
            Self::Rotation => {
                // Deep enough inside that a turn of the bend meets the wall.
                let speed = rng.random_range(0.018..0.03);
                let mut own = begin(way.start_m);
                own = own.then(rng.random_range(0.4..0.8) * length_m / speed, RAMP_S, speed, 0.0);
                let mut sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
                for _ in 0..rng.random_range(2..4) {
                    let spin = sign * rng.random_range(0.8..3.0);
                    own = own.then(rng.random_range(0.5..1.2), RAMP_S, 0.0, spin);
                    own = own.then(rng.random_range(0.1..0.4), RAMP_S, 0.0, 0.0);
                    sign = if rng.random_bool(0.8) { -sign } else { sign };
                }
                own.then(0.3, RAMP_S, -0.01, 0.0)
            }
            Self::Short => {
                let from_m = way.start_m + rng.random_range(0.0..0.4) * length_m;
                let speed: f64 = rng.random_range(0.015..0.03);
                let fed_s = rng.random_range(0.7..1.1_f64).min((way.reach_m - from_m) / speed);
                let own = begin(from_m).then(fed_s, RAMP_S, speed, 0.0);
                let after_s = rng.random_range(0.2..0.4);
                match rng.random_range(0..3) {
                    0 => own.then(after_s, RAMP_S, 0.0, 0.0),
                    1 => own.then(after_s, RAMP_S, -speed, 0.0),
                    _ => own.then(after_s, RAMP_S, 0.0, 2.0),
                }
            }
        }
    }
}

/// A hand feeds on the whole; it pauses, turns and steps back in between.
fn by_hand(mut own: Schedule, way: Way, rng: &mut impl Rng) -> Schedule {
    const LONGEST_S: f64 = 6.5;
    while own.end_s() < LONGEST_S {
        let at_m = own.at(own.end_s()).insertion_m;
        let time_s: f64 = rng.random_range(0.3..0.9);
        let ramp_s = rng.random_range(HAND_RAMP_S[0]..HAND_RAMP_S[1]);
        let mut feed = match rng.random_range(0..10) {
            0 | 1 => 0.0,
            2 | 3 => -rng.random_range(0.003..0.015),
            _ => rng.random_range(0.006..0.028),
        };
        // What a hand cannot know exactly, but does not do either: beyond the end, or out again. A change
        // of speed over the ramp may still carry on a little.
        if at_m + feed * time_s > way.reach_m || at_m + feed * time_s < way.start_m {
            feed = if at_m > 0.5 * (way.start_m + way.reach_m) { -0.012 } else { 0.012 };
        }
        let spin = if rng.random_bool(0.4) { rng.random_range(-2.0..2.0) } else { 0.0 };
        own = own.then(time_s, ramp_s, feed, spin);
    }
    own.then(REST_S, RAMP_S, 0.0, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    fn speeds(schedule: &Schedule) -> Vec<[f64; 2]> {
        let steps = (schedule.end_s() / 0.02) as usize;
        let speed = |k: usize| {
            let (a, b) = (schedule.at(0.02 * k as f64), schedule.at(0.02 * (k + 1) as f64));
            [(b.insertion_m - a.insertion_m) / 0.02, (b.rotation_rad - a.rotation_rad) / 0.02]
        };
        (0..steps).map(speed).collect()
    }

    #[test]
    fn motions_are_what_their_kind_says_and_stay_on_their_way() {
        let way = Way { start_m: 0.03, reach_m: 0.085 };
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        for kind in MotionKind::ALL {
            for _ in 0..30 {
                let own = kind.draw(way, &mut rng);
                let speeds = speeds(&own);
                let back = speeds.iter().any(|[feed, _]| *feed < -1e-4);
                let turned: f64 = speeds.iter().map(|[_, spin]| 0.02 * spin.abs()).sum();
                let end_s = own.end_s();
                assert!((1.0..9.0).contains(&end_s), "{kind:?}: {end_s}");
                for k in 0..200 {
                    let at_m = own.at(end_s * f64::from(k) / 200.0).insertion_m;
                    let (low, high) = (way.start_m - 5e-3, way.reach_m + 5e-3);
                    assert!((low..high).contains(&at_m), "{kind:?}: {at_m}");
                }
                match kind {
                    MotionKind::OneSpeed => assert!(!back && turned == 0.0),
                    MotionKind::Dwells => assert!(!back),
                    MotionKind::Rotation => assert!(turned > 0.6, "{turned}"),
                    MotionKind::Short => assert!(end_s < 2.0, "{end_s}"),
                    MotionKind::Hand => assert!(end_s > 6.0),
                }
            }
        }
    }
}
