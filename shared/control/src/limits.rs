//! The limiter, the last stage before the output. It is correct whatever the stages before it do.
//!
//! There is one instance per axis. For any demand, the output
//!
//! * is finite and no larger than the limit of the axis,
//! * differs from the last output by no more than the slew limit of a tick, unless the last output was
//!   itself beyond the limit (corrupt memory or settings),
//! * equals the demand if no flag is set.
//!
//! [`Limiter::cut`] is the only way around the slew limit. It sets the output to zero in modes without
//! output.

use crate::memory_visitor::{MemoryWord, VisitMemory};
use crate::settings::{RAMP_HARD_TICKS, ROUNDING};
use crate::{FORCE_HARD_N, Settings, TICK_S, TORQUE_HARD_N_M};

/// Limits of one axis, in its unit (N or N·m). Always finite and not negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AxisLimits {
    /// Largest magnitude.
    pub magnitude: f32,
    /// Largest change in a tick.
    pub slew: f32,
}

impl AxisLimits {
    fn new(limit: f32, hard: f32, slew_per_s: f32, ramp_ticks: u16) -> Self {
        // ROUNDING keeps rounded sums of slewed steps within the limits that were set.
        let slew = positive(slew_per_s * TICK_S * ROUNDING);
        let ticks = f32::from(ramp_ticks.clamp(1, RAMP_HARD_TICKS));
        let in_time = positive(slew * ticks * ROUNDING);
        Self { magnitude: smaller(smaller(positive(limit), hard), in_time), slew }
    }

    pub fn force(s: &Settings) -> Self {
        Self::new(s.force_limit_n, FORCE_HARD_N, s.force_slew_n_per_s, s.ramp_time_ticks)
    }

    pub fn torque(s: &Settings) -> Self {
        let slew = s.torque_slew_n_m_per_s;
        Self::new(s.torque_limit_n_m, TORQUE_HARD_N_M, slew, s.ramp_time_ticks)
    }
}

/// Why the output of an axis differs from the demand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Limited {
    pub magnitude: bool,
    pub energy: bool,
    pub slew: bool,
    pub not_finite: bool,
}

/// State of one axis: its last output.
#[derive(Clone, Debug)]
pub(crate) struct Limiter {
    last: f32,
}

impl Limiter {
    pub fn new() -> Self {
        Self { last: 0.0 }
    }

    /// The last output.
    pub fn output(&self) -> f32 {
        self.last
    }

    /// Sets the output to zero at once.
    pub fn cut(&mut self) {
        self.last = 0.0;
    }

    /// The output nearest to `wanted` that the limits allow. `energy_bound`: largest magnitude that keeps
    /// the axis passive; its reserve leaves time to slew down to it.
    pub fn limit(&mut self, limits: &AxisLimits, wanted: f32, energy_bound: f32) -> (f32, Limited) {
        let energy_bound = if energy_bound >= 0.0 { energy_bound } else { 0.0 };
        let not_finite = !(wanted.is_finite() && self.last.is_finite());
        let wanted = finite(wanted);
        let last = within(finite(self.last), limits.magnitude);
        let target = within(wanted, smaller(limits.magnitude, energy_bound));
        let change = target - last;
        let slewed = change.abs() > limits.slew;
        let output = if slewed { last + within(change, limits.slew) } else { target };
        let output = within(output, limits.magnitude);
        self.last = output;
        let changed = output != wanted;
        let why = Limited {
            magnitude: changed && wanted.abs() > limits.magnitude,
            energy: changed && wanted.abs() > energy_bound,
            slew: changed && slewed,
            not_finite,
        };
        (output, why)
    }
}

impl VisitMemory for Limiter {
    fn visit_memory(&mut self, visit: &mut dyn FnMut(MemoryWord<'_>)) {
        visit(MemoryWord::F32(&mut self.last));
    }
}

/// `x`, or 0 if it is not finite.
pub(crate) fn finite(x: f32) -> f32 {
    if x.is_finite() { x } else { 0.0 }
}

/// `x`, or 0 if it is negative or not finite.
pub(crate) fn positive(x: f32) -> f32 {
    if x >= 0.0 && x.is_finite() { x } else { 0.0 }
}

pub(crate) fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// `x` clamped to ±`bound`; both must be finite.
fn within(x: f32, bound: f32) -> f32 {
    if x > bound {
        bound
    } else if x < -bound {
        -bound
    } else {
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn limits() -> impl Strategy<Value = AxisLimits> {
        (0.0f32..20.0, 0.0f32..5000.0, 0u16..50)
            .prop_map(|(limit, slew, ramp)| AxisLimits::new(limit, FORCE_HARD_N, slew, ramp))
    }

    fn any_bits() -> impl Strategy<Value = f32> {
        prop_oneof![
            Just(f32::NAN),
            Just(f32::INFINITY),
            Just(f32::NEG_INFINITY),
            any::<u32>().prop_map(f32::from_bits),
            -20.0f32..20.0,
        ]
    }

    proptest! {
        /// P02 and P26 for one axis, over any sequence of requests.
        #[test]
        fn p02_p26_bounded_slewed_and_reported(
            limits in limits(),
            requests in prop::collection::vec((any_bits(), any_bits()), 1..60),
        ) {
            let mut limiter = Limiter::new();
            for (wanted, bound) in requests {
                let before = limiter.output();
                let (output, why) = limiter.limit(&limits, wanted, bound);
                prop_assert!(output.abs() <= limits.magnitude && output.abs() <= FORCE_HARD_N);
                // Rounding of the sum; ROUNDING keeps a thousandth for it.
                prop_assert!((output - before).abs() * ROUNDING <= limits.slew);
                prop_assert_eq!(output != wanted, why != Limited::default());
            }
        }

        /// Corrupt settings can make the limits smaller, never larger than compiled in.
        #[test]
        fn p02_hard_limit_holds_for_any_settings(a in any_bits(), b in any_bits(), n: u16) {
            let limits = AxisLimits::new(a, FORCE_HARD_N, b, n);
            prop_assert!(limits.magnitude >= 0.0 && limits.magnitude <= FORCE_HARD_N);
            prop_assert!(limits.slew >= 0.0 && limits.slew.is_finite());
        }

        /// Memory of the last output may be anything.
        #[test]
        fn p05_any_last_output(limits in limits(), last in any_bits(), wanted in any_bits()) {
            let (output, why) = Limiter { last }.limit(&limits, wanted, f32::MAX);
            prop_assert!(output.abs() <= limits.magnitude);
            if !last.is_finite() {
                // As if it had been zero, and reported.
                prop_assert!(output.abs() <= limits.slew && why.not_finite);
            }
        }

        /// From anywhere to exactly zero within the ramp time.
        #[test]
        fn p01_a_ramp_reaches_zero_in_time(
            (limit, slew, ramp, from) in (0.0f32..20.0, 1.0f32..5000.0, 1u16..21, -20.0f32..20.0)
        ) {
            let limits = AxisLimits::new(limit, FORCE_HARD_N, slew, ramp);
            let mut limiter = Limiter { last: within(from, limits.magnitude) };
            for _ in 0..ramp {
                limiter.limit(&limits, 0.0, f32::MAX);
            }
            prop_assert_eq!(limiter.output(), 0.0);
        }
    }
}
