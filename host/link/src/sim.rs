//! A device in this process: the code that runs on a board, without the board.
//!
//! In lock step only SYNC frames advance its time. Running free, its ticks follow this computer's
//! clock: those that are due run whenever the link is used. When more than [`MOST_AT_ONCE`] are
//! due, the others do not run and are counted as missed.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use cathforce_bus::service::{Load, Refusal, Status};
use cathforce_bus::{Counter, Counters, Frame, Id, NextCounters};
use cathforce_config::{Settings, image};
use cathforce_control::Config;
use cathforce_device::{Board, ControlLoop, Identity, Image, Service, copy_from};

use crate::{Link, LinkError};

const TICK: Duration = Duration::from_millis(1);

/// Most ticks that run at once, fewer than an encoder may be silent for. No frame is taken between
/// them. On a computer too slow for real time the backlog would otherwise grow each time, and the
/// device would never answer.
const MOST_AT_ONCE: u32 = 4;

/// Most frames that wait to be read; then the oldest are dropped.
const MAX_UNREAD: usize = 65_536;

/// Bytes of an image buffer, as on the emulated board.
const IMAGE_BUFFER_LEN: usize = 2 << 20;

self_cell::self_cell!(
    /// An image and the configuration that reads in it.
    struct Configured {
        owner: Vec<u8>,
        #[covariant]
        dependent: Config,
    }
);

/// A virtual board, and the link to it.
pub struct Sim {
    service: Service<Vec<u8>>,
    board: VirtualBoard,
    unread: VecDeque<Frame>,
    next_tick: Instant,
}

struct VirtualBoard {
    ticker: ControlLoop,
    configured: Option<Configured>,
    /// Frames dropped because nobody read them.
    carrier: Counters,
    missed_ticks: u32,
}

impl Default for Sim {
    fn default() -> Self {
        Self::new()
    }
}

impl Sim {
    /// A board that has just been switched on: no configuration, running free.
    pub fn new() -> Self {
        let identity = Identity {
            firmware: env!("CARGO_PKG_VERSION"),
            board: "sim",
            can_lock_step: true,
            max_image_len: IMAGE_BUFFER_LEN as u32,
        };
        let (ticker, carrier) = (ControlLoop::new(), Counters::default());
        Self {
            service: Service::new(identity, vec![0; IMAGE_BUFFER_LEN]),
            board: VirtualBoard { ticker, configured: None, carrier, missed_ticks: 0 },
            unread: VecDeque::new(),
            next_tick: Instant::now() + TICK,
        }
    }

    /// The same in lock step, as the emulated board starts.
    pub fn in_lock_step() -> Self {
        let mut sim = Self::new();
        // Only an armed device refuses, and this one is not.
        let _ = sim.board.ticker.set_lock_step(true);
        sim
    }

    /// The half of the device that ticks, for inspection.
    pub fn ticker(&self) -> &ControlLoop {
        &self.board.ticker
    }

    /// The settings in use.
    pub fn settings(&self) -> Option<&Settings> {
        self.board.configured.as_ref().map(|c| &c.borrow_dependent().settings)
    }

    fn tick(&mut self) {
        let config = self.board.configured.as_ref().map(Configured::borrow_dependent);
        let sent = self.board.ticker.tick(config, None);
        self.put(sent.into_iter().flatten());
    }

    fn put(&mut self, frames: impl IntoIterator<Item = Frame>) {
        for frame in frames {
            if self.unread.len() >= MAX_UNREAD {
                self.unread.pop_front();
                self.board.carrier.count(Counter::QueueFull);
            }
            self.unread.push_back(frame);
        }
    }

    /// Runs the ticks that are due by the clock; none in lock step.
    fn catch_up(&mut self) {
        let now = Instant::now();
        if self.board.ticker.lock_step() {
            self.next_tick = now + TICK;
            return;
        }
        let Some(late) = now.checked_duration_since(self.next_tick) else { return };
        let due = u32::try_from(late.as_nanos() / TICK.as_nanos() + 1).unwrap_or(u32::MAX);
        for _ in 0..due.min(MOST_AT_ONCE) {
            self.tick();
        }
        let missed = due.saturating_sub(MOST_AT_ONCE);
        self.board.missed_ticks = self.board.missed_ticks.saturating_add(missed);
        self.next_tick += TICK * due;
    }
}

impl Link for Sim {
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.catch_up();
        if Id::from_raw(frame.id()) == Some(Id::ServiceRequest) {
            self.service.on_frame(frame, &mut self.board);
            while let Some(frame) = self.service.next_frame(0) {
                self.put([frame]);
            }
        } else {
            self.board.ticker.on_frame(frame);
            while self.board.ticker.granted() > 0 {
                self.tick();
            }
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<(), LinkError> {
        Ok(())
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>, LinkError> {
        self.catch_up();
        if self.unread.is_empty() {
            let until_tick = match self.board.ticker.lock_step() {
                true => timeout,
                false => self.next_tick.saturating_duration_since(Instant::now()),
            };
            std::thread::sleep(until_tick.min(timeout));
            self.catch_up();
        }
        Ok(self.unread.pop_front())
    }

    fn name(&self) -> &str {
        "sim"
    }
}

impl Board<Vec<u8>> for VirtualBoard {
    fn is_armed(&mut self) -> bool {
        !self.ticker.may_reconfigure()
    }

    fn status(&mut self) -> Status {
        let load = Load { missed_ticks: self.missed_ticks, ..Load::default() };
        let mut status = self.ticker.report(load);
        status.counters = status.counters.merged(&self.carrier);
        status
    }

    fn next_counters(&mut self) -> NextCounters {
        self.ticker.next_counters()
    }

    fn activate(
        &mut self,
        image: Image<Vec<u8>>,
    ) -> Result<Option<Vec<u8>>, (Vec<u8>, Refusal<'static>)> {
        let (mut buffer, len) = image.into_parts();
        buffer.truncate(len);
        let refused =
            Refusal::Image { offset: 0, reason: "changed since it was checked", field: "" };
        let configured = Configured::try_new_or_recover(buffer, |image| image::decode(image))
            .map_err(|(mut buffer, _)| {
                buffer.resize(IMAGE_BUFFER_LEN, 0);
                (buffer, refused)
            })?;
        // Decoded a moment ago, so it can be read.
        self.ticker.restart(image::master(configured.borrow_owner()).unwrap_or_default());
        let mut spare = match self.configured.replace(configured) {
            Some(old) => old.into_owner(),
            None => Vec::new(),
        };
        spare.resize(IMAGE_BUFFER_LEN, 0);
        Ok(Some(spare))
    }

    fn set_lock_step(&mut self, on: bool) -> Result<(), Refusal<'static>> {
        if self.ticker.set_lock_step(on) { Ok(()) } else { Err(Refusal::Armed) }
    }

    fn reset_counters(&mut self) {
        self.ticker.reset_counters();
        self.carrier = Counters::default();
        self.missed_ticks = 0;
    }

    fn read_image(&mut self, offset: usize, into: &mut [u8]) -> Option<usize> {
        let image = self.configured.as_ref()?.borrow_owner();
        Some(copy_from(image, offset, into))
    }
}
