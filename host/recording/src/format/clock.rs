//! The time of frames in recordings.

use std::time::{Duration, Instant};

use cathforce_bus::{Direction, Frame, Id};
use cathforce_control::TICK_S;

/// Length of a tick \[ns\].
const TICK_NS: u64 = (TICK_S as f64 * 1e6).round() as u64 * 1000;

/// Stamps frames with the time at which they crossed the bus.
///
/// In lock step a frame has the time of its tick, whenever the host saw it; running free, it has the
/// time of the host's monotonic clock.
#[derive(Clone, Debug)]
pub struct BusClock {
    lock_step: bool,
    started: Instant,
    granted: u64,
    answered: u64,
}

impl BusClock {
    /// Time 0 is now, or in lock step the first tick granted from now on.
    pub fn new(lock_step: bool) -> Self {
        Self { lock_step, started: Instant::now(), granted: 0, answered: 0 }
    }

    /// Time of this frame \[ns\]. Must be called once for every frame, in order.
    pub fn stamp(&mut self, direction: Direction, frame: &Frame) -> u64 {
        if !self.lock_step {
            return self.elapsed_ns();
        }
        let id = Id::from_raw(frame.id());
        let tick = match direction {
            Direction::ToDevice => {
                let tick = self.granted;
                self.granted += u64::from(id == Some(Id::Sync));
                tick
            }
            Direction::ToHost => {
                self.answered += u64::from(id == Some(Id::Haptic));
                self.answered.saturating_sub(1)
            }
        };
        tick * TICK_NS
    }

    /// When a frame that the host saw at `at_ns` reached this computer, where it had `waited` \[ns\].
    /// In lock step, or without `waited`, that is `at_ns`.
    pub fn arrived_ns(&self, at_ns: u64, waited: Option<Duration>) -> u64 {
        let waited = waited.filter(|_| !self.lock_step);
        let waited_ns = waited.map_or(0, |waited| waited.as_nanos());
        at_ns.saturating_sub(u64::try_from(waited_ns).unwrap_or(0))
    }

    /// Time of the next frame to the device \[ns\].
    pub fn now_ns(&self) -> u64 {
        if self.lock_step { self.granted * TICK_NS } else { self.elapsed_ns() }
    }

    /// Whether ticks run only when granted.
    pub fn lock_step(&self) -> bool {
        self.lock_step
    }

    /// Time at which the recorder gets a frame \[ns\]: now, or in lock step the frame's own.
    pub(crate) fn logged_ns(&self, frame: &crate::BusFrame) -> u64 {
        if self.lock_step { frame.at_ns } else { self.elapsed_ns() }
    }

    fn elapsed_ns(&self) -> u64 {
        u64::try_from(self.started.elapsed().as_nanos()).unwrap_or(u64::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_arrived_before_it_was_seen() {
        let waited = Some(Duration::from_micros(3));
        let free = BusClock::new(false);
        assert_eq!(free.arrived_ns(10_000, waited), 7000);
        assert_eq!((free.arrived_ns(10_000, None), free.arrived_ns(1000, waited)), (10_000, 0));
        assert_eq!(BusClock::new(true).arrived_ns(10_000, waited), 10_000);
    }

    #[test]
    fn in_lock_step_a_frame_has_the_time_of_its_tick() {
        use Direction::{ToDevice, ToHost};
        let mut clock = BusClock::new(true);
        let mut stamp = |direction, id: Id| {
            clock.stamp(direction, &Frame::new(id.raw(), &[]).unwrap()) / TICK_NS
        };
        let sent = [Id::Encoder, Id::Sync, Id::Encoder, Id::Sync].map(|id| stamp(ToDevice, id));
        let answers = [Id::Haptic, Id::Tick, Id::Haptic, Id::Drive].map(|id| stamp(ToHost, id));
        assert_eq!((sent, answers), ([0, 0, 1, 1], [0, 0, 1, 1]));
        assert_eq!(clock.now_ns(), 2_000_000);
    }
}
