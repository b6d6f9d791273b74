//! What a residual looks like: a few numbers, and those that say something in words.
//!
//! | number | of |
//! | --- | --- |
//! | mean, RMS, correlation with the speed v, the length inside L, L² and the time | a channel in a phase |
//! | shift in time, what it removes, what another size does | the same (`timing`) |
//! | time constant in dwells | the same: e = c + a exp(−t/τ), c and a of each dwell, τ of all |
//! | sign that flips with the direction, area of the loop at reversals, swing and share at 0.2 to 3 Hz | the channel in all phases, because hardly any phase goes both ways, and pieces of a trial swing with anything |
//!
//! Errors are measured less predicted, in the channel's unit.

mod band;
mod dwells;
mod loops;
mod residual;
mod timing;

use serde::Serialize;

use crate::rounding::quantity;
use band::Band;
use dwells::decay_s;
use loops::Loops;
pub use residual::Residual;
use residual::{FEWEST, TOLD, mean};
use timing::Timing;

/// Smallest share, or correlation, of a shift in time that is told, which is looked for among many, and how far it must be ahead of another
/// size.
const TIMING_TOLD: f64 = 0.7;
const TIMING_AHEAD: f64 = 0.1;
/// Correlation by which the square of the length comes before the length.
const SQUARE: f64 = 0.01;
/// A regressor that varies by a smaller share of its largest magnitude says nothing.
const VARIES: f64 = 0.05;
/// Each direction has at least this share of what moves.
const BOTH_WAYS: f64 = 0.1;
/// Numbers of a channel's residual; `None` where the data do not carry one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Descriptors {
    /// Unit of the channel.
    pub mean: f64,
    /// Unit of the channel.
    pub rms: f64,
    /// Half the difference of the means forward and backward, over their RMS: ±1 where the sign flips
    /// and nothing else is there. 0 where they have one sign.
    pub sign_flip: Option<f64>,
    /// Correlation with the speed of what is turned with the direction, while it moves.
    pub speed: Option<f64>,
    /// Correlation with the length inside, or the position.
    pub length: Option<f64>,
    pub length_squared: Option<f64>,
    pub time: Option<f64>,
    /// How much later things come than predicted, if at all, and the share of the squared error that
    /// is gone when they are shifted by it.
    pub shift_s: Option<f64>,
    pub shift_share: Option<f64>,
    /// The share that is gone when they are larger or smaller, and off by a constant, instead.
    pub size_share: Option<f64>,
    /// Time constant; `None` where nothing decays in dwells.
    pub decay_s: Option<f64>,
    /// Mean area of the loop that a reversal opens over the way \[the channel's unit × m\]: forward less
    /// backward, at the same places.
    pub loop_area: Option<f64>,
    /// That area over the length of the loop, in the channel's unit.
    pub loop_width: Option<f64>,
    /// The same over twice the RMS there: ±1 where both branches are apart and nothing else is there.
    pub loop_share: Option<f64>,
    /// Share of the variance, without a trial's straight line, at 0.2 to 3 Hz.
    pub band_share: Option<f64>,
    /// The one frequency in that band that explains most, the same in all trials.
    pub swing_hz: Option<f64>,
    /// Share of the variance that it explains.
    pub swing_share: Option<f64>,
}

impl Descriptors {
    /// Of all phases of a channel.
    pub fn of(channel: &[Residual]) -> Self {
        let loops = Loops::of(channel);
        let band = Band::of(channel);
        Self {
            sign_flip: sign_flip(channel),
            loop_area: loops.map(|own| own.area),
            loop_width: loops.map(|own| own.width),
            loop_share: loops.map(|own| own.share),
            band_share: band.map(|own| own.share),
            swing_hz: band.map(|own| own.strongest_hz),
            swing_share: band.map(|own| own.strongest_share),
            ..Self::in_any_phase(channel, channel)
        }
    }

    /// Of one phase of the channel; `self`: of all of them.
    pub fn of_phase(&self, own: &[Residual], channel: &[Residual]) -> Self {
        let here = Self::in_any_phase(own, channel);
        let moving = own.iter().filter(|residual| residual.direction() != 0.0).count();
        if moving < FEWEST {
            // Nothing goes there or back.
            let Self { band_share, swing_hz, swing_share, .. } = *self;
            return Self { band_share, swing_hz, swing_share, ..here };
        }
        Self {
            sign_flip: self.sign_flip,
            loop_area: self.loop_area,
            loop_width: self.loop_width,
            loop_share: self.loop_share,
            band_share: self.band_share,
            swing_hz: self.swing_hz,
            swing_share: self.swing_share,
            ..here
        }
    }

    /// What a phase says by itself.
    fn in_any_phase(own: &[Residual], channel: &[Residual]) -> Self {
        let timing = Timing::of(own, channel);
        let errors = || own.iter().map(|residual| residual.error);
        let along = |of: fn(&Residual) -> f64| correlation(own, of);
        Self {
            mean: mean(errors()),
            rms: mean(errors().map(|e| e * e)).sqrt(),
            speed: speed(own),
            length: along(|r| r.arc_m),
            length_squared: along(|r| r.arc_m * r.arc_m),
            time: along(|r| r.t_s),
            shift_s: timing.map(|own| own.shift_s),
            shift_share: timing.map(|own| own.share),
            size_share: timing.map(|own| own.size_share),
            decay_s: decay_s(own),
            ..Self::default()
        }
    }

    /// What they say, if anything. `unit`: of the channel.
    pub fn words(&self, unit: &str) -> String {
        if let Some(late) = self.late() {
            // Sizes that are off because something comes at another time say nothing.
            return late;
        }
        let offset = self.mean / self.rms.max(f64::MIN_POSITIVE);
        // Over what a trial feeds, a square is nearly a straight line.
        let straight = self.length.map_or(0.0, f64::abs);
        let square = self.length_squared.filter(|own| own.abs() > straight + SQUARE);
        let shapes = [
            (self.speed, ["grows with the speed", "falls as the speed grows"]),
            (self.length, ["grows with the length inside", "falls with the length inside"]),
            (
                square,
                [
                    "grows with the square of the length inside",
                    "falls with the square of the length inside",
                ],
            ),
            (self.time, ["drifts with time", "drifts with time, downwards"]),
            (
                self.sign_flip,
                ["follows the direction of motion", "is against the direction of motion"],
            ),
        ];
        let told = |share: Option<f64>| share.filter(|share| share.abs() >= TOLD);
        let shapes = shapes.into_iter().filter_map(|(share, what)| Some((told(share)?, what)));
        let strongest = shapes.max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
        let mut words = Vec::new();
        // In a phase that goes one way, a sign that follows the direction does not change.
        let is_offset = told(Some(offset)).is_some() && told(self.sign_flip).is_none();
        match strongest.filter(|(share, _)| !is_offset || share.abs() > offset.abs()) {
            Some((share, what)) => {
                words.push(what[usize::from(share < 0.0)].to_owned());
            }
            None if is_offset => {
                let mean = signed(self.mean, unit);
                words.push(format!("has an offset of {mean}, whose sign does not change"));
            }
            None => {}
        }
        if let Some(decay_s) = self.decay_s {
            words.push(format!("decays in dwells with a time constant of {decay_s:.2} s"));
        }
        // A sign that follows the direction opens loops, and swings with the motion.
        if told(self.sign_flip).is_none() {
            if let (Some(width), Some(_)) = (self.loop_width, told(self.loop_share)) {
                words.push(format!(
                    "differs between the ways in and out: at the same place it is {} larger on the way in",
                    signed(width, unit)
                ));
            }
            if let (Some(hz), Some(share)) = (self.swing_hz, told(self.swing_share)) {
                words
                    .push(format!("swings at {hz:.2} Hz ({:.0} % of its variance)", 100.0 * share));
            }
        }
        words.join(" and ")
    }

    /// What comes early or late and is of the right size: another path.
    fn late(&self) -> Option<String> {
        let (shift_s, share) = (self.shift_s?, self.shift_share?);
        let leads = share >= TIMING_TOLD.max(self.size_share.unwrap_or(0.0) + TIMING_AHEAD);
        let sense = if shift_s < 0.0 { "earlier" } else { "later" };
        leads.then(|| {
            format!(
                "comes {:.2} s {sense} than predicted: {:.0} % of it is a matter of time, not of size",
                shift_s.abs(),
                100.0 * share
            )
        })
    }
}

/// With its sign, a negative one as people write it.
fn signed(value: f64, unit: &str) -> String {
    format!("{}{}", if value < 0.0 { "−" } else { "" }, quantity(value.abs(), unit))
}

/// Of the errors with something that varies.
fn correlation(own: &[Residual], of: impl Fn(&Residual) -> f64) -> Option<f64> {
    let (x, e) = (mean(own.iter().map(&of)), mean(own.iter().map(|r| r.error)));
    let (mut xx, mut ee, mut xe, mut most) = (0.0, 0.0, 0.0, 0.0_f64);
    for residual in own {
        let (a, b) = (of(residual) - x, residual.error - e);
        xx += a * a;
        ee += b * b;
        xe += a * b;
        most = most.max(of(residual).abs());
    }
    let varies = (xx / own.len().max(1) as f64).sqrt() > VARIES * most;
    (own.len() >= FEWEST && varies && ee > 0.0).then(|| xe / (xx * ee).sqrt())
}

/// Of e sign(v) with |v|: a sign that follows the direction is no growth.
fn speed(own: &[Residual]) -> Option<f64> {
    let turned = |residual: &Residual| {
        let direction = residual.direction();
        Residual { error: direction * residual.error, ..*residual }
    };
    let moving = own.iter().filter(|residual| residual.direction() != 0.0).map(turned);
    correlation(&moving.collect::<Vec<_>>(), |residual| residual.speed_m_per_s.abs())
}

/// `None` where it goes one way only.
fn sign_flip(channel: &[Residual]) -> Option<f64> {
    let way = |direction: f64| {
        let own = channel.iter().filter(move |r| r.direction() == direction).map(|r| r.error);
        (own.clone().count(), mean(own.clone()), mean(own.map(|e| e * e)))
    };
    let ((n, forward, energy), (m, backward, other)) = (way(1.0), way(-1.0));
    let fewest = FEWEST.max((BOTH_WAYS * (n + m) as f64) as usize);
    if n.min(m) < fewest {
        return None;
    }
    let rms = (0.5 * (energy + other)).sqrt();
    let flips = forward * backward < 0.0 && rms > 0.0;
    Some(if flips { 0.5 * (forward - backward) / rms } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::loops::LOOP_M;
    use super::*;
    use crate::toy::noise;

    const STEP_S: f64 = 0.02;
    const SAMPLES: usize = 1000;
    const NOISE: f64 = 1e-3;

    /// Two trials: by time, where the tip is, how fast it goes, and the error without noise.
    fn made(at: impl Fn(usize, f64) -> [f64; 3]) -> Vec<Residual> {
        let of = |k: usize| {
            let (trial, t_s) = (k / SAMPLES, STEP_S * (k % SAMPLES) as f64);
            let [arc_m, speed_m_per_s, error] = at(trial, t_s);
            let error = error + NOISE * noise(k);
            Residual { trial, t_s, arc_m, speed_m_per_s, predicted: 0.0, error }
        };
        (0..2 * SAMPLES).map(of).collect()
    }

    /// There and back every 5 s, at 20 mm/s.
    fn to_and_fro(t_s: f64) -> [f64; 2] {
        let (round, within) = ((t_s / 5.0) as usize, t_s % 5.0);
        if round % 2 == 0 { [0.02 + 0.02 * within, 0.02] } else { [0.12 - 0.02 * within, -0.02] }
    }

    /// Errors while it goes to and fro, by place and speed.
    fn moved(error: impl Fn(f64, f64) -> f64) -> Descriptors {
        Descriptors::of(&made(|_, t_s| {
            let [arc_m, speed] = to_and_fro(t_s);
            [arc_m, speed, error(arc_m, speed)]
        }))
    }

    #[test]
    fn what_comes_late_is_told_as_that_and_as_nothing_else() {
        let onset = |t_s: f64, at_s: f64| if t_s < at_s { 0.0 } else { 0.03 };
        let late: Vec<Residual> = made(|_, t_s| [5e-3 * t_s, 5e-3, 0.0])
            .into_iter()
            .map(|own| {
                let predicted = onset(own.t_s, 10.0);
                Residual { predicted, error: own.error + onset(own.t_s, 10.3) - predicted, ..own }
            })
            .collect();
        let words = Descriptors::of(&late).words("N");
        assert!(words.starts_with("comes 0.30 s later than predicted: 9"), "{words}");
        assert!(words.ends_with("a matter of time, not of size"), "{words}");
    }

    #[test]
    fn noise_says_nothing() {
        let found = moved(|_, _| 0.0);
        assert!(found.mean.abs() < 1e-4 && (found.rms - NOISE).abs() < 1e-4, "{found:?}");
        assert_eq!(found.words("N"), "");
    }

    #[test]
    fn an_offset_is_told_with_its_size() {
        let found = moved(|_, _| -0.012);
        assert!((found.mean + 0.012).abs() < 1e-4, "{found:?}");
        assert_eq!(found.sign_flip, Some(0.0));
        assert!(found.words("N").starts_with("has an offset of −1"), "{}", found.words("N"));
    }

    #[test]
    fn a_sign_follows_the_direction_only_where_it_goes_both_ways() {
        let found = moved(|_, speed| 0.01 * speed.signum());
        assert!(found.sign_flip.unwrap() > 0.98 && found.mean.abs() < 1e-3, "{found:?}");
        assert!(found.words("N").starts_with("follows the direction of motion"));
        // In the phase that goes in, it is told of the channel.
        let all = made(|_, t_s| {
            let [arc_m, speed] = to_and_fro(t_s);
            [arc_m, speed, 0.01 * speed.signum()]
        });
        let forward: Vec<Residual> =
            all.iter().filter(|r| r.speed_m_per_s > 0.0).copied().collect();
        assert!(found.of_phase(&forward, &all).words("N").contains("follows the direction"));
        // Alone it is an offset, whatever the model does on the way out.
        let alone = Descriptors::of(&forward);
        assert_eq!(alone.sign_flip, None);
        assert!(alone.words("N").starts_with("has an offset of "), "{}", alone.words("N"));
        // At rest nothing goes either way.
        let at_rest: Vec<Residual> =
            forward.iter().map(|r| Residual { speed_m_per_s: 0.0, ..*r }).collect();
        assert_eq!(found.of_phase(&at_rest, &all).sign_flip, None);
    }

    #[test]
    fn what_grows_is_told_by_what_it_grows_with() {
        let starts = |found: Descriptors, with: &str| {
            let words = found.words("N");
            assert!(words.starts_with(with), "{with}: {words} {found:?}");
        };
        starts(moved(|arc_m, _| 0.3 * (arc_m - 0.07)), "grows with the length inside");
        starts(moved(|arc_m, _| 0.07 - 3.0 * (arc_m - 0.07)), "falls with the length inside");
        let square = |arc_m: f64, _| 5.0 * (arc_m * arc_m - 0.0057);
        starts(moved(square), "grows with the square of the length inside");
        let rising = |_, t_s: f64| {
            let speed = 2e-3 + 5e-3 * (3.0 * t_s).sin().powi(2);
            [0.05, speed, 4.0 * (speed - 4.5e-3)]
        };
        starts(Descriptors::of(&made(rising)), "grows with the speed");
        starts(
            Descriptors::of(&made(|_, t_s| [0.05, 0.0, 2e-3 * (t_s - 10.0)])),
            "drifts with time",
        );
        // It never changes its place or speed.
        let still = Descriptors::of(&made(|_, _| [0.05, 0.01, 0.0]));
        assert_eq!([still.speed, still.length, still.length_squared], [None; 3]);
    }

    #[test]
    fn a_decay_in_dwells_is_told_with_its_time_constant() {
        // It rests for 3 of 5 s.
        let dwelling = |error: fn(f64) -> f64| {
            let found = made(|_, t_s| {
                let within = t_s % 5.0;
                if within < 3.0 { [0.05, 0.0, error(within)] } else { [0.05, 0.02, 0.03] }
            });
            Descriptors::of(&found)
        };
        let found = dwelling(|t_s| 0.005 + 0.02 * (-t_s / 0.8).exp());
        let decay_s = found.decay_s.expect("it decays");
        assert!((decay_s / 0.8 - 1.0).abs() < 0.1, "{decay_s}");
        assert!(found.words("N").contains("decays in dwells with a time constant of 0."));
        assert_eq!(dwelling(|t_s| 0.02 - 0.005 * t_s).decay_s, None, "a straight line");
        assert_eq!(dwelling(|_| 0.02).decay_s, None);
        assert_eq!(moved(|_, speed| 0.01 * speed.signum()).decay_s, None, "no dwells");
    }

    #[test]
    fn a_loop_at_reversals_has_its_area_and_width() {
        // 20 mN more on the way in than on the way out, which have no other sign.
        let found = moved(|_, speed| if speed > 0.0 { 0.02 } else { 0.0 });
        let [width, area] = [found.loop_width, found.loop_area].map(Option::unwrap);
        assert!(
            (width - 0.02).abs() < 1e-3 && (area / (0.02 * LOOP_M) - 1.0).abs() < 0.05,
            "{found:?}"
        );
        assert!(
            found.words("N").contains("differs between the ways in and out: at the same place"),
            "{}",
            found.words("N")
        );
        // What depends on the place alone opens none.
        let none = moved(|arc_m, _| 0.3 * (arc_m - 0.07));
        assert!(
            none.loop_width.unwrap().abs() < 1e-3
                && !none.words("N").contains("the ways in and out")
        );
        assert_eq!(Descriptors::of(&made(|_, t_s| [5e-3 * t_s, 5e-3, 0.1])).loop_area, None);
    }

    #[test]
    fn a_swing_is_told_with_its_frequency_whatever_its_phase_in_each_trial() {
        let swinging = |hz: f64, size: f64| {
            Descriptors::of(&made(|trial, t_s| {
                [0.05, 0.01, size * (TAU * hz * t_s + 2.0 * trial as f64).sin()]
            }))
        };
        let found = swinging(0.83, 0.01);
        assert!((found.swing_hz.unwrap() - 0.83).abs() < 0.02, "{found:?}");
        assert!(found.swing_share.unwrap() > 0.9 && found.band_share.unwrap() > 0.9, "{found:?}");
        assert!(found.words("N").contains("swings at 0.8"), "{}", found.words("N"));
        let fast = swinging(8.0, 0.01);
        assert!(fast.band_share.unwrap() < 0.1 && !fast.words("N").contains("swings"), "{fast:?}");
        // White noise has a ninth of its power there, and next to none at one frequency.
        let none = swinging(1.0, 0.0);
        assert!(none.band_share.unwrap() < 0.2 && none.swing_share.unwrap() < 0.1, "{none:?}");
        // Trials that are shorter than two cycles of the slowest hold no such band.
        let short: Vec<Residual> =
            made(|_, _| [0.0; 3]).into_iter().filter(|r| r.t_s < 0.5).collect();
        assert_eq!(Descriptors::of(&short).swing_hz, None);
    }
}
