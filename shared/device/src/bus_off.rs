//! When a controller that went bus-off may come back.

/// Ticks until the first attempt. A controller needs 128 × 11 recessive bits, 1.4 ms at 1 Mbit/s; a
/// device that came back as fast as that would disturb a broken bus half of the time.
const FIRST_WAIT_TICKS: u32 = 100;
/// The longest wait, which each attempt in vain doubles up to.
const LONGEST_WAIT_TICKS: u32 = 1600;
/// After so many ticks on the bus the next bus-off is a new one.
const CALM_TICKS: u32 = 10_000;

/// Limits how often a bus controller is started again after bus-off (P19).
///
/// The waits are 100, 200, 400, 800 and then 1600 ticks: at most 9 attempts in the first 10 s, and one
/// in 1.6 s from there on. A controller that comes back and fails again within 10 s does not start over
/// at the shortest wait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BusRecovery {
    off: bool,
    /// Ticks until the next attempt, or since the controller came back.
    ticks: u32,
    wait_ticks: u32,
}

impl Default for BusRecovery {
    fn default() -> Self {
        Self { off: false, ticks: 0, wait_ticks: FIRST_WAIT_TICKS }
    }
}

impl BusRecovery {
    /// The controller says whether it is off.
    pub fn on_state(&mut self, off: bool) {
        if off == self.off {
            return;
        }
        self.off = off;
        self.ticks = if off { self.wait_ticks } else { 0 };
    }

    /// Nothing can be sent.
    pub fn is_off(&self) -> bool {
        self.off
    }

    /// Counts a tick. Returns `true` if the controller is to be started again now.
    pub fn tick(&mut self) -> bool {
        if !self.off {
            self.ticks = self.ticks.saturating_add(1);
            if self.ticks >= CALM_TICKS {
                self.wait_ticks = FIRST_WAIT_TICKS;
            }
            return false;
        }
        self.ticks = self.ticks.saturating_sub(1);
        if self.ticks > 0 {
            return false;
        }
        self.wait_ticks = self.wait_ticks.saturating_mul(2).min(LONGEST_WAIT_TICKS);
        self.ticks = self.wait_ticks;
        true
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    /// Ticks of the attempts within `ticks` while the controller stays off.
    fn attempts(recovery: &mut BusRecovery, ticks: u32) -> Vec<u32> {
        (1..=ticks).filter(|_| recovery.tick()).collect()
    }

    #[test]
    fn p19_waits_double_up_to_the_longest() {
        let mut recovery = BusRecovery::default();
        assert_eq!(attempts(&mut recovery, 1000), [0; 0]);
        recovery.on_state(true);
        let made = attempts(&mut recovery, 10_000);
        assert_eq!(made, [100, 300, 700, 1500, 3100, 4700, 6300, 7900, 9500]);
    }

    #[test]
    fn p19_a_bus_that_fails_again_soon_waits_longer_and_a_calm_one_does_not() {
        let mut recovery = BusRecovery::default();
        recovery.on_state(true);
        assert_eq!(attempts(&mut recovery, 100), [100]);
        recovery.on_state(false);
        assert_eq!(attempts(&mut recovery, 500), [0; 0]);
        recovery.on_state(true);
        assert_eq!(attempts(&mut recovery, 200), [200]);
        recovery.on_state(false);
        assert_eq!(attempts(&mut recovery, CALM_TICKS), [0; 0]);
        recovery.on_state(true);
        assert_eq!(attempts(&mut recovery, 100), [100]);
    }

    #[test]
    fn p19_saying_the_same_again_does_not_shorten_a_wait() {
        let mut recovery = BusRecovery::default();
        recovery.on_state(true);
        let made = (1..=100).filter(|_| {
            recovery.on_state(true);
            recovery.tick()
        });
        assert_eq!(made.collect::<Vec<_>>(), [100]);
    }
}
