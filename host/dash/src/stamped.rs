//! The topics of a device that runs, stamped with the time of day.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use cathforce_bus::master::Master;
use cathforce_bus::{Direction, Frame};
use cathforce_recording::{BusFrame, Measured, TopicError, TopicMessage, Topics};

use crate::live::Listener;

/// From one repetition of what a late listener must know to the next.
const AGAIN: Duration = Duration::from_secs(1);

/// Hands messages on.
pub trait Outlet: Send {
    /// Makes the messages.
    fn topics(&mut self) -> &mut Topics;
    /// Hands on what [`Topics`] made. It must not wait.
    fn send(&mut self, messages: Result<Vec<TopicMessage>, TopicError>);
}

/// Stamps what is heard with the time of day, and hands it on.
pub struct Stamped<O> {
    outlet: O,
    started: Instant,
    started_unix_ns: u64,
    said_at: Option<Instant>,
}

impl<O: Outlet> Stamped<O> {
    /// `master`: where the drives' positions stand in its own frames.
    pub fn new(mut outlet: O, master: Master) -> Self {
        outlet.topics().begin_with(master);
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let started_unix_ns = u64::try_from(since.as_nanos()).unwrap_or(0);
        Self { outlet, started: Instant::now(), started_unix_ns, said_at: None }
    }

    fn now_ns(&self) -> u64 {
        let since = u64::try_from(self.started.elapsed().as_nanos()).unwrap_or(u64::MAX);
        self.started_unix_ns.saturating_add(since)
    }
}

impl<O: Outlet> Listener for Stamped<O> {
    fn begins(&mut self, image: &[u8]) {
        self.outlet.topics().begin(image);
        self.said_at = None;
    }

    fn frame(&mut self, direction: Direction, frame: &Frame) {
        let at_ns = self.now_ns();
        if self.said_at.is_none_or(|at| at.elapsed() >= AGAIN) {
            self.said_at = Some(Instant::now());
            let messages = self.outlet.topics().again(at_ns);
            self.outlet.send(messages);
        }
        let frame = BusFrame { at_ns, direction, frame: *frame };
        let messages = self.outlet.topics().frame(&frame, at_ns);
        self.outlet.send(messages);
    }

    fn measured(&mut self, row: &Measured) {
        let at_ns = self.now_ns();
        let messages = self.outlet.topics().measured(at_ns, row, &[]);
        self.outlet.send(messages);
    }
}
