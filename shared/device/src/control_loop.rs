//! The control loop: the half of the device that runs in the tick interrupt.

use cathforce_bus::master::{Collector, FrameOutcome, Master, Reading};
use cathforce_bus::service::{Load, Status as Report};
use cathforce_bus::{
    self as bus, Counter, Counters, Frame, Id, MODE_UNCONFIGURED, Process, Protection, Sealer,
};
use cathforce_control::{
    self as control, Config, EncoderSample, Grip, GuidewireSample, HalfWidths, HapticSource,
    Inputs, Mode, Notice, Outputs, TendonPair,
};

/// Largest number of frames of a tick: HAPTIC, CONTACT, and a rotating one.
pub const MAX_FRAMES_PER_TICK: usize = 3;

/// Frames of a tick, in this order. HAPTIC and CONTACT are always sent. The status of the last frame
/// marks it as the last one.
pub type TickFrames = [Option<Frame>; MAX_FRAMES_PER_TICK];

/// Slots of the rotating frame: TICK, DRIVE, MOMENT, SHAPE of a node, FORCE of the same node. With a
/// guidewire there is one more, GUIDEWIREDRIVE.
const SLOTS: u32 = 5;
/// Slot of MOMENT; with a band, BAND takes it every other time.
const MOMENT_SLOT: u32 = 2;
/// Ticks per rotating frame with a guidewire or tendons, whose encoder frames take their share of the bus.
const LADEN_TICKS_PER_SLOT: u32 = 3;

/// A heartbeat takes the first slot of every so many rounds: every 100 ticks, or 300 with tendons and 360
/// with a guidewire.
const ROUNDS_PER_HEARTBEAT: u32 = 20;

/// What the board around the control loop knows of its health, for the heartbeat.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Health {
    /// Resets by the device itself since it was switched on.
    pub resets: u32,
    /// Fault for which it reset itself last; 0 for none, or once it has been cleared.
    pub crash: u8,
    /// Ticks that began late or not at all.
    pub missed_ticks: u32,
}

/// Decoded frames since the last tick, the state of the controller, and counters of frames.
///
/// The configuration stays outside and is lent to each tick; a change of it must be followed by
/// [`ControlLoop::restart`]. From there on all results follow from the frames and their order. The
/// same frames give the same outputs in another control loop, bit for bit.
///
/// In lock step, frames must wait outside while [`ControlLoop::granted`] is not 0. The frames before a
/// SYNC then belong to the first tick that it grants.
#[derive(Clone, Debug)]
pub struct ControlLoop {
    protection: Protection,
    sealer: Sealer,
    counters: Counters,
    inputs: Inputs,
    state: control::State,
    outputs: Option<Outputs>,
    /// Number of the next tick since the restart, with or without configuration.
    tick: u32,
    /// Node of the next SHAPE and FORCE frames.
    node: u8,
    /// With a band: the next frame in this slot is MOMENT, after BAND.
    moment_next: bool,
    lock_step: bool,
    granted: u32,
    master: Collector,
    grip: Grip,
    health: Health,
}

impl Default for ControlLoop {
    fn default() -> Self {
        Self::new()
    }
}

impl ControlLoop {
    /// Free running, at tick 0, with nothing received.
    pub fn new() -> Self {
        Self {
            protection: Protection::default(),
            sealer: Sealer::default(),
            counters: Counters::default(),
            inputs: Inputs::default(),
            state: control::State::new(),
            outputs: None,
            tick: 0,
            node: 0,
            moment_next: false,
            lock_step: false,
            granted: 0,
            master: Collector::default(),
            grip: Grip::default(),
            health: Health::default(),
        }
    }

    /// Starts over at tick 0 for another configuration. `master`: its description of the master's own
    /// frames. Counters and lock step are kept.
    pub fn restart(&mut self, master: Master) {
        self.master = Collector::new(master);
        self.grip = Grip::default();
        self.protection = Protection::default();
        self.sealer = Sealer::default();
        self.inputs = Inputs::default();
        self.state.reset();
        self.outputs = None;
        self.tick = 0;
        self.node = 0;
        self.moment_next = false;
        self.granted = 0;
    }

    /// Takes over what outlives a change of the configuration: counters and lock step.
    pub fn continue_from(&mut self, before: &Self) {
        self.counters = before.counters;
        self.lock_step = before.lock_step;
        self.health = before.health;
        self.granted = 0;
    }

    /// Output is neither armed nor ramping down, so the configuration may change (P17).
    pub fn may_reconfigure(&self) -> bool {
        !matches!(self.outputs.map(|o| o.mode), Some(Mode::Armed | Mode::Ramp { .. }))
    }

    /// Switches between ticks by grant (`on`) and ticks by the clock. Returns `false` and does nothing
    /// while armed.
    #[must_use]
    pub fn set_lock_step(&mut self, on: bool) -> bool {
        if self.may_reconfigure() {
            self.lock_step = on;
            self.granted = 0;
            return true;
        }
        false
    }

    /// Ticks run only when granted.
    pub fn lock_step(&self) -> bool {
        self.lock_step
    }

    /// Granted ticks that have not run yet; always 0 when running free.
    pub fn granted(&self) -> u32 {
        self.granted
    }

    /// Takes one frame for the next tick. Exactly one counter records its outcome. Service frames are
    /// ignored.
    pub fn on_frame(&mut self, frame: &Frame) {
        match Id::from_raw(frame.id()) {
            Some(Id::ServiceRequest) => {}
            Some(id @ (Id::Sync | Id::Tendons(_) | Id::Command)) => self.on_process(id, frame),
            Some(id @ Id::Encoder) if self.master.master().catheter.is_none() => {
                self.on_process(id, frame)
            }
            Some(id @ Id::Guidewire) if self.master.master().guidewire.is_none() => {
                self.on_process(id, frame);
            }
            _ => self.on_master(frame),
        }
    }

    /// Takes a frame with a foreign identifier: the master's own, if the configuration describes it.
    fn on_master(&mut self, frame: &Frame) {
        match self.master.take(frame) {
            FrameOutcome::Foreign => return self.on_foreign(),
            FrameOutcome::Rejected(counter) => {
                self.counters.count(counter);
                self.inputs.rejected_frames = self.inputs.rejected_frames.saturating_add(1);
                return;
            }
            FrameOutcome::Used { superseded } => {
                self.counters.count(Counter::Accepted);
                if superseded {
                    self.counters.count(Counter::Superseded);
                }
            }
        }
        if let Some(reading) = self.master.catheter() {
            self.grip.catheter_button = reading.held;
            self.grip.handle_gripped = Some(reading.gripped);
            replace_sample(&mut self.inputs.encoder, position(reading), &mut self.counters);
        }
        if let Some(reading) = self.master.guidewire() {
            self.grip.guidewire_button = reading.held == Some(true);
            self.grip.handle_gripped = Some(reading.gripped);
            let sample =
                GuidewireSample { at: position(reading), held: self.grip.guidewire_button };
            replace_sample(&mut self.inputs.guidewire, sample, &mut self.counters);
        }
    }

    /// Counts a frame that cannot be ours: with a 29-bit identifier, or remote.
    pub fn on_foreign(&mut self) {
        self.counters.count(Counter::Foreign);
    }

    fn on_process(&mut self, id: Id, frame: &Frame) {
        match self.protection.receive(id, frame, &mut self.counters) {
            Ok(accepted) => match accepted.process {
                Process::Sync(sync) if self.lock_step => {
                    self.granted = self.granted.saturating_add(u32::from(sync.grant));
                }
                Process::Encoder(encoder) => {
                    self.grip.handle_released = accepted.status.hand;
                    replace_sample(&mut self.inputs.encoder, sample(encoder), &mut self.counters);
                }
                Process::Guidewire(encoder) => {
                    let held = accepted.status.hand;
                    self.grip.guidewire_button = held;
                    let sample = GuidewireSample { at: sample(encoder), held };
                    replace_sample(&mut self.inputs.guidewire, sample, &mut self.counters);
                }
                Process::Tendons(tendons) => self.on_tendons(tendons),
                Process::Command(command) => self.on_command(command),
                _ => {}
            },
            // A broken SYNC starts no tick, but it is no evidence against the encoders.
            Err(_) if id == Id::Sync => {}
            Err(_) => {
                self.inputs.rejected_frames = self.inputs.rejected_frames.saturating_add(1);
            }
        }
    }

    fn on_tendons(&mut self, tendons: bus::Tendons) {
        let pair = TendonPair { displacements_m: tendons.displacements.map(|x| x.m()) };
        if let Some(place) = self.inputs.tendons.get_mut(usize::from(tendons.pair)) {
            replace_sample(place, pair, &mut self.counters);
        }
    }

    /// The newest command replaces others, except a disarm.
    fn on_command(&mut self, command: bus::Command) {
        let command = match command {
            bus::Command::SelfTest => control::Command::SelfTest,
            bus::Command::Arm => control::Command::Arm,
            bus::Command::Disarm => control::Command::Disarm,
            bus::Command::ClearFault { token } => control::Command::ClearFault { token },
        };
        if self.inputs.command.is_some() {
            self.counters.count(Counter::Superseded);
        }
        if self.inputs.command != Some(control::Command::Disarm) {
            self.inputs.command = Some(command);
        }
    }

    /// Tells what the next heartbeats state.
    pub fn set_health(&mut self, health: Health) {
        self.health = health;
    }

    /// Runs one tick: a control step with everything taken since the last one. Returns the frames to send.
    ///
    /// Without `config` nothing is computed and the output is zero. `notice`: a problem that the board has
    /// detected in itself.
    pub fn tick(&mut self, config: Option<&Config<'_>>, notice: Option<Notice>) -> TickFrames {
        let grip = Some(self.grip);
        let inputs = Inputs { notice, grip, ..core::mem::take(&mut self.inputs) };
        self.granted = self.granted.saturating_sub(1);
        self.outputs = config.map(|config| control::step(config, &mut self.state, &inputs));
        let sent = match (config, self.outputs) {
            (Some(config), Some(outputs)) => self.configured_frames(config, &outputs),
            _ => self.unconfigured_frames(),
        };
        self.tick = self.tick.wrapping_add(1);
        sent
    }

    fn configured_frames(&mut self, config: &Config<'_>, outputs: &Outputs) -> TickFrames {
        let status = bus::Status {
            unresolved: outputs.contact.unresolved,
            limited: !outputs.limited.is_empty(),
            ..bus::Status::default()
        };
        let haptic = Process::Haptic(bus::Haptic {
            force: bus::HapticForce::from_n(outputs.force_n),
            torque: bus::HapticTorque::from_n_m(outputs.torque_n_m),
            mode: outputs.mode.code(),
            fault: outputs.fault.map_or(0, |fault| fault.code()),
        });
        let contact = Process::Contact(bus::Contact {
            force: outputs.contact.force_on_vessel_n.map(bus::Force::from_n),
        });
        let (ticks, slots) = schedule(config);
        let slot = self.tick.is_multiple_of(ticks).then_some(self.tick / ticks % slots);
        let rotating_frame = slot.map(|slot| self.rotating_frame(slot, config, outputs));
        self.seal([haptic, contact], rotating_frame, status)
    }

    fn seal(
        &mut self,
        always: [Process; 2],
        rotating_frame: Option<Process>,
        status: bus::Status,
    ) -> TickFrames {
        let [haptic, contact] = always;
        let mut seal = |process, last| self.sealer.seal(process, bus::Status { last, ..status });
        [
            Some(seal(haptic, false)),
            Some(seal(contact, rotating_frame.is_none())),
            rotating_frame.map(|rotating_frame| seal(rotating_frame, true)),
        ]
    }

    /// The frame of a slot. While no node is inside the vessel, TICK takes the slots of SHAPE and FORCE.
    fn rotating_frame(&mut self, slot: u32, config: &Config<'_>, outputs: &Outputs) -> Process {
        let band = slot == MOMENT_SLOT && config.band.is_some() && self.band_is_next();
        let model = self.state.mechanics();
        // SHAPE and FORCE send the same node, which is brought into range before them.
        if slot == 0 && usize::from(self.node) >= model.nodes().min(usize::from(bus::MAX_NODES)) {
            self.node = 0;
        }
        let (node, index) = (self.node, usize::from(self.node));
        let tick = Process::Tick(bus::Tick { tick: self.tick as u16, digest: outputs.digest });
        match slot {
            0 if self.tick / ticks_per_round(config) % ROUNDS_PER_HEARTBEAT
                == ROUNDS_PER_HEARTBEAT - 1 =>
            {
                self.heartbeat()
            }
            1 => Process::Drive(bus::Drive {
                force: bus::Force::from_n(outputs.contact.drive_force_n),
                torque: bus::DriveTorque::from_n_m(outputs.contact.drive_torque_n_m),
                limits: outputs.limited.bits(),
                encoder_age_ticks: outputs.encoder_age_ticks,
            }),
            MOMENT_SLOT if band => {
                let HalfWidths { force_n, drive_force_n } = outputs.band;
                Process::Band(bus::Band {
                    force: force_n.map(|n| n.map(bus::BandWidth::from_n)),
                    drive_force: drive_force_n.map(bus::BandWidth::from_n),
                })
            }
            MOMENT_SLOT => Process::Moment(bus::TotalMoment {
                moment: outputs.contact.moment_on_vessel_n_m.map(bus::Moment::from_n_m),
            }),
            3 => model.node_position_m(index).map_or(tick, |[x, y, z]| {
                let [x0, y0, z0] = config.model.description().entry.position_m;
                let position = [x - x0, y - y0, z - z0].map(bus::Position::from_m);
                Process::Shape(bus::Shape { node, position })
            }),
            4 => {
                self.node = node.wrapping_add(1);
                model.node_force_n(index).map_or(tick, |force| {
                    Process::Force(bus::NodeForce { node, force: force.map(bus::Force::from_n) })
                })
            }
            SLOTS => Process::GuidewireDrive(bus::GuidewireDrive {
                force: bus::Force::from_n(outputs.contact.guidewire_force_n),
                torque: bus::DriveTorque::from_n_m(outputs.contact.guidewire_torque_n_m),
                encoder_age_ticks: outputs.guidewire_age_ticks,
                felt: outputs.haptic_source == HapticSource::Guidewire,
            }),
            _ => tick,
        }
    }

    fn heartbeat(&self) -> Process {
        const REJECTED: [Counter; 6] = [
            Counter::Repeat,
            Counter::Reordered,
            Counter::Masquerade,
            Counter::Corrupt,
            Counter::WrongLength,
            Counter::BadValue,
        ];
        let rejected =
            REJECTED.iter().fold(0u32, |sum, &kind| sum.saturating_add(self.counters.get(kind)));
        let latched = self.outputs.and_then(|outputs| outputs.fault).map(|fault| fault.code());
        let byte = |count: u32| count.min(u32::from(u8::MAX)) as u8;
        Process::Heartbeat(bus::Heartbeat {
            mode: self.mode_code(),
            fault: latched.unwrap_or(self.health.crash),
            resets: byte(self.health.resets),
            missed_ticks: byte(self.health.missed_ticks),
            rejected_frames: rejected.min(u32::from(u16::MAX)) as u16,
        })
    }

    /// Alternates between BAND (`true`) and MOMENT.
    fn band_is_next(&mut self) -> bool {
        self.moment_next = !self.moment_next;
        self.moment_next
    }

    fn unconfigured_frames(&mut self) -> TickFrames {
        let haptic = Process::Haptic(bus::Haptic {
            force: bus::HapticForce::default(),
            torque: bus::HapticTorque::default(),
            mode: MODE_UNCONFIGURED,
            fault: 0,
        });
        let contact = Process::Contact(bus::Contact { force: Default::default() });
        let round = self.tick / SLOTS % ROUNDS_PER_HEARTBEAT;
        let third = if self.tick.is_multiple_of(SLOTS) && round == ROUNDS_PER_HEARTBEAT - 1 {
            self.heartbeat()
        } else {
            Process::Tick(bus::Tick { tick: self.tick as u16, digest: 0 })
        };
        self.seal([haptic, contact], Some(third), bus::Status::default())
    }

    /// Outputs of the last tick; `None` before the first one and without configuration.
    pub fn outputs(&self) -> Option<&Outputs> {
        self.outputs.as_ref()
    }

    /// State of the controller, from which results per node are read.
    pub fn state(&self) -> &control::State {
        &self.state
    }

    /// Ticks since the last restart, wrapping.
    pub fn ticks(&self) -> u32 {
        self.tick
    }

    /// Counters of the frames.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Zeroes the counters.
    pub fn reset_counters(&mut self) {
        self.counters = Counters::default();
    }

    /// Counters that the next process frames of [`bus::FROM_HOST`] must carry.
    pub fn next_counters(&self) -> bus::NextCounters {
        bus::FROM_HOST.map(|id| self.protection.expected(id))
    }

    /// Code of the mode, as in the HAPTIC frame.
    pub fn mode_code(&self) -> u8 {
        self.outputs.map_or(MODE_UNCONFIGURED, |outputs| outputs.mode.code())
    }

    /// The status report, with `load` as measured by the board, without the CRC of the image.
    pub fn report(&self, load: Load) -> Report {
        Report {
            mode: self.mode_code(),
            fault: self.outputs.and_then(|o| o.fault).map_or(0, |fault| fault.code()),
            lock_step: self.lock_step,
            tick: self.tick,
            digest: self.outputs.map_or(0, |outputs| outputs.digest),
            load,
            counters: self.counters,
            // The service fills it in.
            image_crc32: 0,
        }
    }
}

/// Ticks per slot of the rotating frame, and the slots that there are.
fn schedule(config: &Config<'_>) -> (u32, u32) {
    let description = config.model.description();
    let guidewire = description.guidewire.is_some();
    let laden = guidewire || !description.tendons.is_empty();
    let ticks = if laden { LADEN_TICKS_PER_SLOT } else { 1 };
    (ticks, if guidewire { SLOTS + 1 } else { SLOTS })
}

fn ticks_per_round(config: &Config<'_>) -> u32 {
    let (ticks, slots) = schedule(config);
    ticks * slots
}

fn sample(encoder: bus::Encoder) -> EncoderSample {
    EncoderSample { insertion_m: encoder.insertion.m(), rotation_rad: encoder.rotation.rad() }
}

fn position(reading: Reading) -> EncoderSample {
    EncoderSample { insertion_m: reading.insertion_m, rotation_rad: reading.rotation_rad }
}

/// Replaces a sample by a newer one, and counts it if one of this tick was replaced.
fn replace_sample<S>(newest: &mut Option<S>, sample: S, counters: &mut Counters) {
    if newest.replace(sample).is_some() {
        counters.count(Counter::Superseded);
    }
}
