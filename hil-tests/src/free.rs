//! A host of a device that runs free: its samples follow the device's ticks.
//!
//! A real board cannot be granted ticks. The host therefore answers each HAPTIC that it hears with the frames for
//! the next tick, and counts time in ticks of the device, never by this computer's clock.

use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use cathforce_bus::service::Status as Report;
use cathforce_bus::{Command, Counter, Counters, Frame, Id, Process, Protection, Sealer, Status};
use cathforce_control::Mode;
use cathforce_link::{Client, Link, LinkError};

use crate::{Drive, Rig, Tick, encoder};

/// Longest silence of a device.
const PATIENCE: Duration = Duration::from_secs(20);
/// Most ticks in which a device has to reach a mode.
const MOST_TICKS: usize = 10_000;

/// What the host does for every tick that it hears.
#[derive(Clone, Copy, Debug, Default)]
pub struct Plan {
    /// Where the drive is; without it no samples are sent.
    pub at: Option<Drive>,
    /// Feed in a tick \[m\].
    pub feed_m: f64,
    /// Frames of 8 bytes with identifiers that nobody on the bus uses.
    pub foreign: u32,
}

/// A link that carries out a [`Plan`], and keeps the ticks that it hears, whoever reads from it.
pub struct Paced<R> {
    rig: R,
    pub plan: Plan,
    once: VecDeque<Frame>,
    sealer: Sealer,
    protection: Protection,
    received: Counters,
    partial: Vec<Frame>,
    heard: VecDeque<Tick>,
    /// Foreign frames sent so far.
    sent_foreign: u32,
}

impl<R: Rig> Paced<R> {
    fn new(rig: R) -> Self {
        Self {
            rig,
            plan: Plan::default(),
            once: VecDeque::new(),
            sealer: Sealer::default(),
            protection: Protection::default(),
            received: Counters::default(),
            partial: Vec::new(),
            heard: VecDeque::new(),
            sent_foreign: 0,
        }
    }

    /// The device starts again with counters and ticks.
    fn restart(&mut self) {
        self.protection = Protection::default();
        self.received = Counters::default();
        self.partial.clear();
        self.heard.clear();
    }

    fn hear(&mut self, frame: Frame) -> Result<(), LinkError> {
        let id = Id::from_raw(frame.id()).filter(|id| !id.is_from_host());
        let Some(id) = id.filter(|&id| id != Id::ServiceResponse) else { return Ok(()) };
        let accepted = self.protection.receive(id, &frame, &mut self.received);
        let begins = id == Id::Haptic;
        if begins {
            self.partial.clear();
        }
        let Ok(accepted) = accepted else { return Ok(()) };
        // A host that joins within a tick waits for the next one.
        if begins || !self.partial.is_empty() {
            self.partial.push(frame);
        }
        if accepted.status.last && (2..=3).contains(&self.partial.len()) {
            let mut frames = self.partial.drain(..);
            self.heard.push_back(Tick::decode(std::array::from_fn(|_| frames.next())));
        }
        if begins { self.answer() } else { Ok(()) }
    }

    /// Sends what belongs to the next tick.
    fn answer(&mut self) -> Result<(), LinkError> {
        while let Some(frame) = self.once.pop_front() {
            self.rig.send(&frame)?;
        }
        for n in 0..self.plan.foreign {
            let id = 0x7F0 + n % 8;
            self.rig.send(&Frame::new(id, &[n as u8; 8]).expect("8 bytes"))?;
            self.sent_foreign += 1;
        }
        if let Some(at) = &mut self.plan.at {
            at.insertion_m += self.plan.feed_m;
            let sample = self.sealer.seal(encoder(*at), Status::default());
            self.rig.send(&sample)?;
        }
        self.rig.flush()
    }
}

impl<R: Rig> Link for Paced<R> {
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.rig.send(frame)
    }

    fn flush(&mut self) -> Result<(), LinkError> {
        self.rig.flush()
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>, LinkError> {
        let frame = self.rig.receive(timeout)?;
        if let Some(frame) = frame {
            self.hear(frame)?;
        }
        Ok(frame)
    }

    fn name(&self) -> &str {
        self.rig.name()
    }
}

/// A device that runs free, and its host.
pub struct Free<R: Rig> {
    client: Client<Paced<R>>,
}

impl<R: Rig> Free<R> {
    /// A device that is there. One in lock step stands still, and answers requests.
    pub fn over(rig: R) -> Self {
        let client = Client::connect(Paced::new(rig)).unwrap_or_else(|e| panic!("{e}"));
        Self { client }
    }

    /// A device with this image.
    pub fn configured(rig: R, image: &[u8]) -> Self {
        let mut free = Self::over(rig);
        free.upload(image).unwrap_or_else(|e| panic!("{e}"));
        free
    }

    /// Sends an image, with which the device starts again.
    pub fn upload(&mut self, image: &[u8]) -> Result<(), cathforce_link::ClientError> {
        self.client.upload_image(image, |_| ControlFlow::Continue(()))?;
        self.client.link_mut().restart();
        Ok(())
    }

    /// What the host does for every tick.
    pub fn plan(&mut self) -> &mut Plan {
        &mut self.client.link_mut().plan
    }

    /// The next `ticks` ticks that are heard.
    pub fn hear(&mut self, ticks: usize) -> Vec<Tick> {
        let mut until = Instant::now() + PATIENCE;
        let mut heard = Vec::new();
        while heard.len() < ticks {
            if let Some(tick) = self.client.link_mut().heard.pop_front() {
                heard.push(tick);
                until = Instant::now() + PATIENCE;
                continue;
            }
            let left = until.saturating_duration_since(Instant::now());
            assert!(!left.is_zero(), "no tick within {PATIENCE:?}");
            self.client.link_mut().receive(left).unwrap_or_else(|e| panic!("{e}"));
        }
        heard
    }

    /// Sends these frames with the next tick that is heard, as they are.
    pub fn send(&mut self, frames: impl IntoIterator<Item = Frame>) {
        self.client.link_mut().once.extend(frames);
    }

    /// Sends a command with the next tick.
    pub fn command(&mut self, command: Command) {
        let frame = self.seal(Process::Command(command));
        self.send([frame]);
    }

    /// Seals a frame as the next one of its kind.
    pub fn seal(&mut self, process: Process) -> Frame {
        self.client.link_mut().sealer.seal(process, Status::default())
    }

    /// Tests and arms the device with the drive at rest. Returns all ticks, and how many of them pass from a
    /// command's tick to the one in which it acts: what the link takes.
    pub fn arm(&mut self, at: Drive) -> (Vec<Tick>, usize) {
        *self.plan() = Plan { at: Some(at), ..Plan::default() };
        let mut ticks = self.hear(1);
        self.command(Command::SelfTest);
        let tested = self.reach("tested", |mode| mode != Mode::Boot);
        // The first tick may be heard already, and the one after it is the earliest that can act.
        let delay = tested.len().saturating_sub(2);
        ticks.extend(tested);
        ticks.extend(self.reach("ready", |mode| mode == Mode::Ready));
        while ticks.last().and_then(Tick::mode) != Some(Mode::Armed) {
            assert!(ticks.len() < MOST_TICKS, "never armed: {:?}", ticks.last());
            self.command(Command::Arm);
            ticks.extend(self.hear(10));
        }
        (ticks, delay)
    }

    fn reach(&mut self, what: &str, is_there: impl Fn(Mode) -> bool) -> Vec<Tick> {
        let mut ticks = Vec::new();
        while !ticks.last().and_then(Tick::mode).is_some_and(&is_there) {
            assert!(ticks.len() < MOST_TICKS, "never {what}: {:?}", ticks.last());
            ticks.extend(self.hear(1));
        }
        ticks
    }

    /// The device's report.
    pub fn report(&mut self) -> Report {
        self.client.status().unwrap_or_else(|e| panic!("{e}"))
    }

    /// The client, to ask the device something else.
    pub fn client_mut(&mut self) -> &mut Client<Paced<R>> {
        &mut self.client
    }

    /// Frames of the device that did not arrive.
    pub fn lost(&self) -> u32 {
        self.client.link().received.get(Counter::Lost)
    }

    /// Foreign frames sent since the device was found.
    pub fn sent_foreign(&self) -> u32 {
        self.client.link().sent_foreign
    }

    /// The device after somebody has pressed its button.
    pub fn again(self) -> Self {
        Self::over(self.client.into_link().rig.again())
    }
}
