//! A device that runs, for Foxglove.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use cathforce_bus::master::Master;
use cathforce_bus::{Direction, Frame};
use cathforce_recording::{BusFrame, Measured};

use super::outlet::Outlet;
use crate::live::Listener;

/// From one repetition of what a late client must know to the next.
const AGAIN: Duration = Duration::from_secs(1);

/// Stamps what is heard with the time of day, and hands it on.
pub struct Live {
    outlet: Outlet,
    started: Instant,
    started_unix_ns: u64,
    said_at: Option<Instant>,
}

impl Live {
    pub fn new(mut outlet: Outlet, master: Master) -> Self {
        outlet.topics.begin_with(master);
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let started_unix_ns = u64::try_from(since.as_nanos()).unwrap_or(0);
        Self { outlet, started: Instant::now(), started_unix_ns, said_at: None }
    }

    fn now_ns(&self) -> u64 {
        let since = u64::try_from(self.started.elapsed().as_nanos()).unwrap_or(u64::MAX);
        self.started_unix_ns.saturating_add(since)
    }
}

impl Listener for Live {
    fn begins(&mut self, image: &[u8]) {
        self.outlet.topics.begin(image);
        self.said_at = None;
    }

    fn frame(&mut self, direction: Direction, frame: &Frame) {
        let at_ns = self.now_ns();
        if self.said_at.is_none_or(|at| at.elapsed() >= AGAIN) {
            self.said_at = Some(Instant::now());
            let messages = self.outlet.topics.again(at_ns);
            self.outlet.send(messages);
        }
        let frame = BusFrame { at_ns, direction, frame: *frame };
        let messages = self.outlet.topics.frame(&frame, at_ns);
        self.outlet.send(messages);
    }

    fn measured(&mut self, row: &Measured) {
        self.outlet.send(self.outlet.topics.measured(self.now_ns(), row, &[]));
    }
}
