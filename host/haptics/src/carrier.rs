//! Frames on their way, which come later than they were sent.

use std::collections::VecDeque;

use cathforce_bus::Frame;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

/// How late frames come, in each direction \[ticks of 1 ms\].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Delay {
    /// Always.
    pub ticks: u32,
    /// Up to so many more, differently for each frame. Frames do not overtake each other.
    pub jitter_ticks: u32,
}

/// One direction of the bus.
pub(crate) struct Carrier {
    delay: Delay,
    under_way: VecDeque<(u32, Frame)>,
    now: u32,
}

impl Carrier {
    pub fn new(delay: Delay) -> Self {
        Self { delay, under_way: VecDeque::new(), now: 0 }
    }

    pub fn send(&mut self, frame: Frame, rng: &mut ChaCha8Rng) {
        let own = self.now + self.delay.ticks + rng.random_range(0..=self.delay.jitter_ticks);
        let last = self.under_way.back().map_or(own, |(due, _)| *due);
        self.under_way.push_back((own.max(last), frame));
    }

    /// Frames that arrive in this tick; the next call is of the next tick.
    pub fn arrived(&mut self) -> Vec<Frame> {
        let mut arrived = Vec::new();
        while self.under_way.front().is_some_and(|(due, _)| *due <= self.now) {
            arrived.extend(self.under_way.pop_front().map(|(_, frame)| frame));
        }
        self.now += 1;
        arrived
    }
}
