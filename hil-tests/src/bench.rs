//! A device in lock step with a host that follows the protocol.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use cathforce_bus::service::Status as Report;
use cathforce_bus::{
    Command, Contact, Counter, Counters, Encoder, Frame, Haptic, Id, Insertion, MODE_UNCONFIGURED,
    Process, Protection, Rotation, Sealer, Status, Sync,
};
use cathforce_control::{Fault, Mode};
use cathforce_device::{ControlLoop, TickFrames};
use cathforce_link::{Client, Sim};

use crate::{Drive, Rig};

/// Longest silence of a device within a tick.
const PATIENCE: Duration = Duration::from_secs(20);
/// Largest number of ticks under way; their frames fit into the queue of every device.
const WINDOW: usize = 12;
/// Largest number of ticks in which a model settles.
const SETTLE_TICKS: usize = 10_000;

/// Frames that the device sent in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    pub haptic: Haptic,
    pub contact: Contact,
    /// The third frame, in ticks that have one.
    pub third: Option<Process>,
    /// The raw frames.
    pub frames: TickFrames,
}

impl Tick {
    /// Decodes the frames of a tick.
    pub fn decode(frames: TickFrames) -> Self {
        let decode = |frame: Frame| {
            let id = Id::from_raw(frame.id());
            let payload = frame.data().first_chunk::<6>();
            let process = id.zip(payload).and_then(|(id, payload)| Process::decode(id, *payload));
            process.unwrap_or_else(|| panic!("{frame} means nothing"))
        };
        let [Some(Process::Haptic(haptic)), Some(Process::Contact(contact)), third] =
            frames.map(|frame| frame.map(decode))
        else {
            panic!("a tick is HAPTIC, CONTACT and perhaps a third frame, not {frames:?}")
        };
        Self { haptic, contact, third, frames }
    }

    /// The raw frames but for a heartbeat, which states counters.
    pub fn outputs(&self) -> TickFrames {
        self.frames.map(|frame| frame.filter(|frame| frame.id() != Id::Heartbeat.raw()))
    }

    /// The mode; `None` while there is no configuration.
    pub fn mode(&self) -> Option<Mode> {
        if (self.haptic.mode, self.haptic.fault) == (MODE_UNCONFIGURED, 0) {
            return None;
        }
        let mode = Mode::from_codes(self.haptic.mode, self.haptic.fault);
        Some(mode.unwrap_or_else(|| panic!("no mode: {:?}", self.haptic)))
    }

    /// The fault that the mode names, if any.
    pub fn fault(&self) -> Option<Fault> {
        self.mode().and_then(Mode::fault)
    }

    /// Whether the haptic output is zero.
    pub fn is_silent(&self) -> bool {
        (self.haptic.force.0, self.haptic.torque.0) == (0, 0)
    }
}

/// A device in lock step, and its host.
pub struct Bench<R: Rig> {
    client: Client<R>,
    sealer: Sealer,
    protection: Protection,
    received: Counters,
    host_tick: u32,
}

impl<R: Rig> Bench<R> {
    /// A device that has just been switched on.
    pub fn booted() -> Self {
        Self::over(R::boot())
    }

    /// A device that is there.
    pub fn over(rig: R) -> Self {
        let mut client = Client::connect(rig).unwrap_or_else(|error| panic!("{error}"));
        client.set_lock_step(true).unwrap_or_else(|error| panic!("{error}"));
        Self {
            client,
            sealer: Sealer::default(),
            protection: Protection::default(),
            received: Counters::default(),
            host_tick: 0,
        }
    }

    /// A device with this image.
    pub fn configured(image: &[u8]) -> Self {
        let mut bench = Self::booted();
        bench.upload(image).unwrap_or_else(|error| panic!("{error}"));
        bench
    }

    /// A device with this image, armed, with the drive at rest.
    pub fn armed(image: &[u8], at: Drive) -> Self {
        let mut bench = Self::configured(image);
        bench.arm(at);
        bench
    }

    /// Sends an image to the device, which starts again if it accepts it.
    pub fn upload(&mut self, image: &[u8]) -> Result<(), cathforce_link::ClientError> {
        self.client.upload_image(image, |_| ControlFlow::Continue(()))?;
        self.protection = Protection::default();
        Ok(())
    }

    /// Runs self-test, settling and arming with the drive at rest; returns all ticks.
    pub fn arm(&mut self, at: Drive) -> Vec<Tick> {
        self.arm_holding(&[encoder(at)])
    }

    /// The same with these frames of all drives in every tick.
    pub fn arm_holding(&mut self, still: &[Process]) -> Vec<Tick> {
        let with = |command| still.iter().copied().chain([Process::Command(command)]).collect();
        let mut ticks = self.play([with(Command::SelfTest)]);
        while ticks.last().and_then(Tick::mode) != Some(Mode::Ready) {
            assert!(ticks.len() < SETTLE_TICKS, "never ready: {:?}", ticks.last());
            ticks.extend(self.play(std::iter::repeat_n(still.to_vec(), WINDOW)));
        }
        // A device does not arm in a tick that its model did not resolve.
        while ticks.last().and_then(Tick::mode) != Some(Mode::Armed) {
            assert!(ticks.len() < SETTLE_TICKS, "never armed: {:?}", ticks.last());
            ticks.extend(self.play([with(Command::Arm)]));
        }
        ticks
    }

    /// Seals a frame as the next one of its kind.
    pub fn seal(&mut self, process: Process) -> Frame {
        self.sealer.seal(process, Status::default())
    }

    /// A copy of the sealer of the next frames, for frames that are sent elsewhere.
    pub fn clone_sealer(&self) -> Sealer {
        self.sealer.clone()
    }

    /// The drive's frame.
    pub fn encoder(&mut self, at: Drive) -> Frame {
        self.seal(encoder(at))
    }

    /// A command's frame.
    pub fn command(&mut self, command: Command) -> Frame {
        self.seal(Process::Command(command))
    }

    /// Sends frames without changing them and lets one tick run.
    pub fn tick(&mut self, frames: &[Frame]) -> Tick {
        for frame in frames {
            self.send(frame);
        }
        self.grant();
        self.receive()
    }

    /// Grants ticks that nobody waits for, such as those in which a board resets itself.
    pub fn grant_ticks(&mut self, ticks: u16) {
        let host_tick = self.host_tick;
        self.host_tick += u32::from(ticks);
        let sync = self.seal(Process::Sync(Sync { grant: ticks, host_tick }));
        self.send(&sync);
        self.client.link_mut().flush().unwrap_or_else(|error| panic!("{error}"));
    }

    /// The client, to talk to the device otherwise.
    pub fn client_mut(&mut self) -> &mut Client<R> {
        &mut self.client
    }

    /// The device again, after it has been reset, with what it has saved.
    pub fn again(self) -> Self {
        Self::over(self.client.into_link())
    }

    /// Plays one tick for each step; seals and sends its frames in order.
    pub fn play(&mut self, steps: impl IntoIterator<Item = Vec<Process>>) -> Vec<Tick> {
        let (mut ticks, mut granted) = (Vec::new(), 0);
        for step in steps {
            for process in step {
                let frame = self.seal(process);
                self.send(&frame);
            }
            self.grant();
            granted += 1;
            while granted - ticks.len() >= WINDOW {
                ticks.push(self.receive());
            }
        }
        while ticks.len() < granted {
            ticks.push(self.receive());
        }
        ticks
    }

    /// The device's report.
    pub fn report(&mut self) -> Report {
        self.client.status().unwrap_or_else(|error| panic!("{error}"))
    }

    /// Resets the device's counters.
    pub fn reset_counters(&mut self) {
        self.client.reset_counters().unwrap_or_else(|error| panic!("{error}"));
    }

    /// The link, for sending bytes that are no frame.
    pub fn link_mut(&mut self) -> &mut R {
        self.client.link_mut()
    }

    fn send(&mut self, frame: &Frame) {
        self.client.link_mut().send(frame).unwrap_or_else(|error| panic!("{error}"));
    }

    fn grant(&mut self) {
        let host_tick = self.host_tick;
        self.host_tick += 1;
        let sync = self.seal(Process::Sync(Sync { grant: 1, host_tick }));
        self.send(&sync);
    }

    fn receive(&mut self) -> Tick {
        let mut ended = false;
        let frames = std::array::from_fn(|_| {
            (!ended).then(|| {
                let (frame, status) = self.receive_frame();
                ended = status.last;
                frame
            })
        });
        assert!(ended, "no frame is the last of its tick: {frames:?}");
        Tick::decode(frames)
    }

    /// The device's next frame. A lost, repeated or broken frame fails the test.
    fn receive_frame(&mut self) -> (Frame, Status) {
        let deadline = Instant::now() + PATIENCE;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let received = self.client.link_mut().receive(left);
            let frame = match received.unwrap_or_else(|error| panic!("{error}")) {
                Some(frame) => frame,
                None if left.is_zero() => panic!("no tick within {PATIENCE:?}"),
                None => continue,
            };
            let id = match Id::from_raw(frame.id()) {
                // A late segment of a request that was answered already.
                Some(Id::ServiceResponse) => continue,
                Some(id) if !id.is_from_host() => id,
                _ => panic!("not of a device: {frame}"),
            };
            let accepted = self.protection.receive(id, &frame, &mut self.received);
            let accepted = accepted.unwrap_or_else(|why| panic!("{frame}: {why:?}"));
            assert_eq!(self.received.get(Counter::Lost), 0, "before {frame}");
            return (frame, accepted.status);
        }
    }
}

impl Bench<Sim> {
    /// The control loop of the device, for inspection.
    pub fn ticker(&self) -> &ControlLoop {
        self.client.link().ticker()
    }
}

/// The drive's sample.
pub fn encoder(at: Drive) -> Process {
    Process::Encoder(Encoder {
        insertion: Insertion::from_m(at.insertion_m),
        rotation: Rotation::from_rad(at.rotation_rad),
    })
}
