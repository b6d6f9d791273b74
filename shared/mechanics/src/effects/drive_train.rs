//! The drive train, from the encoder to the instrument at the entry plane.
//! docs/explanation/model.md (33)–(35)

use super::DriveEffects;
use crate::math::{maximum, minimum, sin_cos};
use crate::{Drive, Real};

/// Number of encoder samples that are kept for the latency: at 1 kHz more than the 0.12 s that may be set.
pub const LONGEST_LATENCY_TICKS: usize = 128;

/// State of the drive train.
#[derive(Clone, Debug)]
pub struct DriveTrain<T> {
    /// Ring of the newest encoder samples; `None` before the first one.
    samples: Option<[Drive<T>; LONGEST_LATENCY_TICKS]>,
    /// Index of the newest one.
    newest: usize,
    /// The delayed sample of the last tick.
    delayed: Drive<T>,
    /// Motion that scale, ripple and slip have added since the run began.
    accumulated: Drive<T>,
    /// Lead of the output over the gears, 0 to the width of the dead zone.
    lead: Drive<T>,
    /// Phase of the ripple \[periods, modulo 1\].
    turns: T,
}

impl<T: Real> Default for DriveTrain<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> DriveTrain<T> {
    /// Nothing has moved.
    pub const fn new() -> Self {
        Self {
            samples: None,
            newest: 0,
            delayed: Drive::ZERO,
            accumulated: Drive::ZERO,
            lead: Drive::ZERO,
            turns: T::ZERO,
        }
    }

    /// Position of the instrument at the entry plane for the encoder's position `encoder`.
    ///
    /// `load_n`: force at the drive in the last tick, positive when pushing \[N\]. With every effect off
    /// the result is `encoder` to the bit. The first call begins the run with no loss, and with the
    /// backlash taken up towards insertion and positive rotation.
    pub fn follow(
        &mut self,
        effects: &DriveEffects<T>,
        tick_s: T,
        load_n: T,
        encoder: Drive<T>,
    ) -> Drive<T> {
        if effects.is_off() {
            return encoder;
        }
        let last = self.delayed;
        let first = self.samples.is_none();
        let delayed = self.delay(effects.latency.time_s / tick_s, encoder);
        self.delayed = delayed;
        if first {
            return delayed;
        }
        // Scale and dead zone.     docs/explanation/model.md (33)
        let scale = &effects.encoder_scale;
        let dead = &effects.backlash;
        let fed = (delayed.insertion_m - last.insertion_m) * scale.insertion;
        let turned = (delayed.rotation_rad - last.rotation_rad) * scale.rotation;
        let lead = self.lead;
        self.lead = Drive {
            insertion_m: take_up(lead.insertion_m, fed, dead.insertion_m, dead.gradual),
            rotation_rad: take_up(lead.rotation_rad, turned, dead.rotation_rad, dead.gradual),
        };
        // Ripple and slip of the motion past the backlash.     docs/explanation/model.md (34), (35)
        let moved = fed + self.lead.insertion_m - lead.insertion_m;
        let ripple = &effects.ripple;
        let turns = self.turns + ripple.cycles_per_m * moved + ripple.cycles_per_s * tick_s;
        self.turns = turns - T::int(turns.floor_int());
        let (sin, _) = sin_cos(self.turns * T::lit(core::f64::consts::TAU) + ripple.phase_rad);
        let distance = if moved < T::zero() { -moved } else { moved };
        let one = T::one();
        // The limit keeps the load of the last tick from moving the instrument by itself.
        let lost = maximum(minimum(effects.slip.per_n * load_n, one), -one);
        self.accumulated.insertion_m += (delayed.insertion_m - last.insertion_m)
            * (scale.insertion - one)
            + moved * ripple.ratio * sin
            - distance * lost;
        self.accumulated.rotation_rad +=
            (delayed.rotation_rad - last.rotation_rad) * (scale.rotation - one);
        Drive {
            insertion_m: delayed.insertion_m
                + (self.accumulated.insertion_m + self.lead.insertion_m),
            rotation_rad: delayed.rotation_rad
                + (self.accumulated.rotation_rad + self.lead.rotation_rad),
        }
    }

    /// The encoder's sample `ticks` ago, interpolated; the first sample for times before the run.
    fn delay(&mut self, ticks: T, encoder: Drive<T>) -> Drive<T> {
        let samples = self.samples.get_or_insert([encoder; LONGEST_LATENCY_TICKS]);
        self.newest = (self.newest + 1) % LONGEST_LATENCY_TICKS;
        if let Some(newest) = samples.get_mut(self.newest) {
            *newest = encoder;
        }
        let whole = ticks.floor_int().clamp(0, LONGEST_LATENCY_TICKS as i32 - 2);
        let share = minimum(ticks - T::int(whole), T::one());
        let at = |age: usize| {
            let index = (self.newest + LONGEST_LATENCY_TICKS - age) % LONGEST_LATENCY_TICKS;
            samples.get(index).copied().unwrap_or(encoder)
        };
        let (newer, older) = (at(whole as usize), at(whole as usize + 1));
        let blend = |a: T, b: T| a + (b - a) * share;
        Drive {
            insertion_m: blend(newer.insertion_m, older.insertion_m),
            rotation_rad: blend(newer.rotation_rad, older.rotation_rad),
        }
    }
}

/// Lead that is left after the gears have moved by `moved`.     docs/explanation/model.md (33)
fn take_up<T: Real>(lead: T, moved: T, width: T, gradual: T) -> T {
    if gradual <= T::zero() || width <= T::zero() {
        return clamp(lead - moved, width);
    }
    let across = clamp(lead / width, T::one());
    let done = if moved > T::zero() { T::one() - across } else { across };
    clamp(lead - moved * (T::one() - gradual * done), width)
}

/// `x` clamped to 0 … `width`.
fn clamp<T: Real>(x: T, width: T) -> T {
    let x = if x < T::zero() { T::zero() } else { x };
    if x > width { width } else { x }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use std::vec::Vec;

    const TICK_S: f64 = 1e-3;

    fn effects(change: impl Fn(&mut DriveEffects<f64>)) -> DriveEffects<f64> {
        let mut effects = DriveEffects::off();
        change(&mut effects);
        effects
    }

    /// Insertions at the entry plane for insertions of the encoder, under a constant load.
    fn follow(effects: &DriveEffects<f64>, load_n: f64, encoder_m: &[f64]) -> Vec<f64> {
        let mut train = DriveTrain::new();
        let drive = |&insertion_m: &f64| Drive { insertion_m, rotation_rad: -2.0 * insertion_m };
        let at = |x| train.follow(effects, TICK_S, load_n, drive(x)).insertion_m;
        encoder_m.iter().map(at).collect()
    }

    /// 20 mm forward and 10 mm back at 20 mm/s, from 30 mm.
    fn there_and_back() -> Vec<f64> {
        let forward = (0..=1000).map(|i| 0.03 + 2e-5 * f64::from(i));
        let back = (1..=500).map(|i| 0.05 - 2e-5 * f64::from(i));
        forward.chain(back).collect()
    }

    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-9
    }

    #[test]
    fn off_passes_every_bit() {
        let encoder = there_and_back();
        assert_eq!(follow(&DriveEffects::off(), 0.7, &encoder), encoder);
    }

    #[test]
    fn latency_delays_by_a_broken_number_of_ticks() {
        let late = effects(|e| e.latency.time_s = 7.5e-3);
        let out = follow(&late, 0.0, &there_and_back());
        assert!(near(out[1000], 0.05 - 7.5 * 2e-5), "{}", out[1000]);
        assert!(near(out[5], 0.03), "what was before the run is its first sample");
        let latest = effects(|e| e.latency.time_s = 120e-3);
        assert!(near(follow(&latest, 0.0, &there_and_back())[1000], 0.05 - 120.0 * 2e-5));
    }

    #[test]
    fn scale_acts_on_what_was_fed_since_the_start() {
        let scaled = effects(|e| e.encoder_scale.insertion = 1.1);
        let out = follow(&scaled, 0.0, &there_and_back());
        assert!(near(out[0], 0.03) && near(out[1000], 0.03 + 1.1 * 0.02));
        assert!(near(out[1500], 0.03 + 1.1 * 0.01));
    }

    #[test]
    fn slip_loses_at_most_what_moves() {
        let slipping = effects(|e| e.slip.per_n = 0.5);
        let ends = |load_n: f64| follow(&slipping, load_n, &there_and_back())[1000];
        assert!(near(ends(0.4), 0.03 + 0.8 * 0.02) && near(ends(-0.4), 0.03 + 1.2 * 0.02));
        assert!(near(ends(1e4), 0.03) && near(ends(-1e4), 0.03 + 2.0 * 0.02));
    }

    #[test]
    fn a_gradual_backlash_comes_through_ever_more() {
        const WIDTH_M: f64 = 2e-3;
        let gradual = effects(|e| {
            (e.backlash.insertion_m, e.backlash.gradual) = (WIDTH_M, 0.8);
        });
        let mut train = DriveTrain::new();
        let mut at = |insertion_m: f64| {
            let encoder = Drive { insertion_m, rotation_rad: 0.0 };
            train.follow(&gradual, TICK_S, 0.0, encoder).insertion_m
        };
        // Taken up where the run begins; then withdrawn in steps of 1 µm.
        const STEP_M: f64 = 1e-6;
        let there = at(0.05);
        let back: Vec<f64> = (1..=5000).map(|k| there - at(0.05 - STEP_M * f64::from(k))).collect();
        // x′ = 1 − g x, x of the dead zone: what is lost of a way u is x B, x = (1 − e^(−g u/B))/g.
        for (k, moved) in back.iter().enumerate() {
            let way_m = STEP_M * (k + 1) as f64;
            let across = ((1.0 - (-0.8 * way_m / WIDTH_M).exp()) / 0.8).min(1.0);
            assert!((way_m - moved - across * WIDTH_M).abs() < 2e-6, "{k}: {moved}");
        }
        // All of it is lost in the end.
        assert!((back[4999] - (5e-3 - WIDTH_M)).abs() < 1e-9);
    }

    #[test]
    fn backlash_loses_its_width_at_reversal_only() {
        let loose = effects(|e| e.backlash.insertion_m = 2e-3);
        let out = follow(&loose, 0.0, &there_and_back());
        assert!(near(out[1000], 0.05) && near(out[1050], 0.05), "it stands still after reversal");
        assert!(near(out[1500], 0.042));
    }

    #[test]
    fn ripple_comes_back_after_a_period_and_rests_in_a_dwell() {
        let rippled = effects(|e| {
            e.ripple.ratio = 0.1;
            e.ripple.cycles_per_m = 100.0;
        });
        let out = follow(&rippled, 0.0, &there_and_back());
        // Half a period is 5 mm: gained 0.1 · 2/(2π · 100/m) at its end.
        let most = 0.1 / (100.0 * core::f64::consts::PI);
        assert!((out[250] - 0.035 - most).abs() < 1e-6, "{}", out[250] - 0.035);
        assert!((out[500] - 0.04).abs() < 1e-6);
        let mut dwell = there_and_back();
        dwell.truncate(300);
        dwell.resize(600, dwell[299]);
        let out = follow(&rippled, 0.0, &dwell);
        assert_eq!(out[320], out[599]);
    }

    #[test]
    fn slip_gives_way_to_the_load() {
        let slips = effects(|e| e.slip.per_n = 0.2);
        let out = follow(&slips, 0.5, &there_and_back());
        assert!(near(out[1000], 0.05 - 0.1 * 0.02), "{}", out[1000]);
        assert!(near(out[1500], 0.04 - 0.1 * 0.03), "pulling back, the load helps");
    }
}
