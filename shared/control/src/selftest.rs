//! The self-test of settings and limiter, without which nothing can be armed.

use crate::limits::{AxisLimits, Limiter};
use crate::{FORCE_HARD_N, Settings, TICK_S, TORQUE_HARD_N_M};

/// The settings are in range, the model is made for this tick, and the limiter works on both axes.
pub(crate) fn run(settings: &Settings, tick_s: f32) -> bool {
    settings.validate().is_ok()
        && tick_s == TICK_S
        && limiter_holds(&AxisLimits::force(settings), FORCE_HARD_N)
        && limiter_holds(&AxisLimits::torque(settings), TORQUE_HARD_N_M)
}

/// Asked for excessive values and for values that are not finite, the limiter stays within `hard`.
fn limiter_holds(limits: &AxisLimits, hard: f32) -> bool {
    let mut limiter = Limiter::new();
    let mut holds = limits.magnitude <= hard;
    for wanted in [1e3, -1e3, f32::NAN, f32::INFINITY] {
        let before = limiter.output();
        let (output, why) = limiter.limit(limits, wanted, f32::MAX);
        holds &= output.abs() <= limits.magnitude;
        holds &= (output - before).abs() <= limits.slew + hard * f32::EPSILON;
        holds &= why != Default::default();
    }
    holds
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_with_the_defaults_only_at_the_device_tick() {
        assert!(run(&Settings::default(), TICK_S));
        assert!(!run(&Settings::default(), 2.0 * TICK_S));
        assert!(!run(&Settings::default(), f32::NAN));
    }

    #[test]
    fn refuses_settings_out_of_range() {
        let settings = Settings { force_limit_n: f32::NAN, ..Settings::default() };
        assert!(!run(&settings, TICK_S));
        let settings = Settings { force_limit_n: FORCE_HARD_N * 1.01, ..Settings::default() };
        assert!(!run(&settings, TICK_S));
    }
}
