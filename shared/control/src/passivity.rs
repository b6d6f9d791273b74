//! Passivity: an axis never delivers more energy than it has received plus a budget.
//!
//! An output holds until the next tick, so the energy that an axis receives in a tick is the last
//! output times the drive's motion (output is positive against the motion). Let E be the budget and
//! A = received + E the energy that may still be delivered. A magnitude f is safe if A stays
//! non-negative while the drive moves at its largest speed, d per tick, and the output slews down by s
//! per tick:
//!
//! ```text
//! d · (f + (f − s) + (f − 2 s) + …)  ≤  d · (f²/(2 s) + f)  ≤  A
//! ```
//!
//! [`Passivity::bound`] is the largest such f. Because of the reserve, the bound holds without violating
//! the slew limit.
//!
//! A tick without a sample is charged with the worst case. The next sample tells how far the drive
//! moved in the meantime, and the charge is corrected to motion at constant speed.

use cathforce_mechanics::Number;

use crate::freshness::Motion;
use crate::limits::positive;
use crate::memory_visitor::{MemoryWord, VisitMemory};
use crate::settings::ROUNDING;

/// Energy account of one axis. Energies in J, outputs in N or N·m, motions in m or rad.
#[derive(Clone, Debug)]
pub(crate) struct Passivity {
    /// Net energy received since arming, without the unconfirmed ticks.
    received_j: f32,
    /// Worst-case energy delivered in the ticks since the last sample.
    unconfirmed_j: f32,
    /// Sum of the outputs in those ticks.
    unconfirmed_output: f32,
}

impl Passivity {
    /// The account at arming.
    pub fn new() -> Self {
        Self { received_j: 0.0, unconfirmed_j: 0.0, unconfirmed_output: 0.0 }
    }

    /// Accounts for the time since `output` was set. `moved`: motion of this axis in `motion`; `step`:
    /// largest motion in a tick.
    pub fn observe(&mut self, output: f32, motion: Motion, moved: f32, step: f32) {
        match motion {
            Motion::Unknown => {
                self.unconfirmed_j += output.abs() * step;
                self.unconfirmed_output += output;
            }
            Motion::Known { ticks, .. } => {
                let a_tick = moved / f32::from(ticks.max(1));
                self.received_j += (output + self.unconfirmed_output) * a_tick;
                self.unconfirmed_j = 0.0;
                self.unconfirmed_output = 0.0;
            }
        }
    }

    /// Changes to another drive. Its samples tell nothing about the unconfirmed ticks, so their worst case
    /// is kept.
    pub fn change_drive(&mut self) {
        self.received_j -= self.unconfirmed_j;
        self.unconfirmed_j = 0.0;
        self.unconfirmed_output = 0.0;
    }

    /// Largest output that keeps the axis within `budget_j` \[J\]; 0 if the memory is corrupt.
    pub fn bound(&self, budget_j: f32, slew: f32, step: f32) -> f32 {
        let left_j = positive(budget_j + self.received_j - self.unconfirmed_j);
        // f²/(2 s) + f = a, solved without cancellation.
        let a = ROUNDING * left_j / step;
        positive(2.0 * a / (1.0 + (1.0 + 2.0 * a / slew).root()))
    }
}

impl VisitMemory for Passivity {
    fn visit_memory(&mut self, visit: &mut dyn FnMut(MemoryWord<'_>)) {
        visit(MemoryWord::F32(&mut self.received_j));
        visit(MemoryWord::F32(&mut self.unconfirmed_j));
        visit(MemoryWord::F32(&mut self.unconfirmed_output));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::{AxisLimits, Limiter};
    use proptest::prelude::*;

    const STEP_M: f32 = 2e-4;

    proptest! {
        /// P08: whatever is asked for, however the drive moves within its speed, with
        /// samples missing: net energy out stays within the budget.
        #[test]
        fn p08_net_energy_out_stays_within_the_budget(
            budget_j in 0.0f32..0.01,
            // Long stretches in one direction against an adversary that always pushes along.
            ticks in prop::collection::vec((-10.0f32..10.0, 0.0f32..1.0, any::<bool>()), 1..400),
            adversary: bool,
            missing in prop::collection::vec(0u8..5, 400),
        ) {
            let limits = AxisLimits { magnitude: 3.0, slew: 0.2 };
            let (mut limiter, mut passivity) = (Limiter::new(), Passivity::new());
            let mut truth_j = 0.0f64;
            let mut gap = 0;
            for ((wanted, share, forwards), missing) in ticks.into_iter().zip(missing) {
                // `missing` ticks without a sample, then one with; even speed in between.
                let output = limiter.output();
                let forwards = if adversary { output < 0.0 } else { forwards };
                let a_tick = if forwards { share * STEP_M } else { -share * STEP_M };
                let wanted = if adversary { 10.0 } else { wanted };
                for k in 0..=missing {
                    let motion = if k < missing {
                        gap += 1;
                        Motion::Unknown
                    } else {
                        let ticks = gap + 1;
                        gap = 0;
                        Motion::Known { insertion_m: 0.0, rotation_rad: 0.0, ticks }
                    };
                    let output = limiter.output();
                    truth_j += f64::from(output) * f64::from(a_tick);
                    prop_assert!(truth_j >= -f64::from(budget_j) - 1e-7, "{truth_j} J");
                    let moved = a_tick * f32::from(missing + 1);
                    passivity.observe(output, motion, moved, STEP_M);
                    let bound = passivity.bound(budget_j, limits.slew, STEP_M);
                    limiter.limit(&limits, wanted, bound);
                }
            }
        }

        #[test]
        fn p05_any_memory_gives_a_finite_bound(bits: [u32; 3], budget: u32, slew: u32, step: u32) {
            let [received_j, unconfirmed_j, unconfirmed_output] = bits.map(f32::from_bits);
            let passivity = Passivity { received_j, unconfirmed_j, unconfirmed_output };
            let f = f32::from_bits;
            let bound = passivity.bound(f(budget), f(slew), f(step));
            prop_assert!(bound >= 0.0 && bound.is_finite());
        }
    }

    #[test]
    fn the_budget_can_be_spent() {
        // A bound of zero would hold any promise.
        let bound = Passivity::new().bound(0.1, 0.2, STEP_M);
        assert!(bound > 3.0, "{bound}");
    }
}
