//! One operation: the operator inserts, presses, and holds still.

use cathforce_bus::{
    Command, Encoder, Frame, Id, Insertion, Process, Protection, Rotation, Sealer, Status,
};
use cathforce_control::{Config, LimitFlags, Mode, Outputs};
use cathforce_device::ControlLoop;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use thiserror::Error;

use crate::carrier::{Carrier, Delay};
use crate::handle::{Axis, Hand, Handle, Held, TICK_S};

/// A budget that no operation spends \[J\].
const NO_BUDGET_J: f32 = 1e9;
/// Ticks that a device may take to be ready.
const PATIENCE_TICKS: usize = 60_000;
/// A handle that holds still moves by less than this in the last part of the hold \[m\], \[rad\]: a few counts of
/// an encoder, and far less than fingers tremble.
const STILL_M: f64 = 0.1e-3;
const STILL_RAD: f64 = 0.01;
/// Parts of the hold. An oscillation dies out if it is smaller in the last part than this share of the part before:
/// from its first part to its last it then falls to a third.
const PARTS: usize = 4;
const DYING_OUT: f64 = 0.7;

/// An operation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Operation {
    pub axis: Axis,
    pub handle: Handle,
    pub hand: Hand,
    /// Of the frames to the device and from it.
    pub delay: Delay,
    /// Where the insertion begins \[m\].
    pub from_m: f64,
    /// How far it goes \[m\], at this speed \[m/s\].
    pub to_m: f64,
    pub speed_m_per_s: f64,
    /// Of a rotary operation, how far the handle is turned there \[rad\], at this speed \[rad/s\].
    pub turn_rad: f64,
    pub turn_rad_per_s: f64,
    /// Ticks of the hold.
    pub hold_ticks: usize,
    /// Seed of the jitter.
    pub seed: u64,
}

/// What happened.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Passed {
    /// The handle came to rest, or its oscillation dies out.
    pub is_stable: bool,
    /// Range of the handle's motion in the last quarter of the hold \[m\], \[rad\].
    pub swing: f64,
    /// Largest output \[N\], \[N·m\].
    pub largest: f64,
    /// Largest change of the output from one tick to the next: the step that fingers can feel.
    pub largest_step: f64,
    /// Net energy that the motor gave to the handle while armed \[J\].
    pub energy_j: f64,
    /// Whether the passivity observer had to limit the output.
    pub was_limited: bool,
    /// Why the device ended the operation, if it did: an oscillation may be faster than its drives can be.
    pub stopped: Option<String>,
}

/// Why an operation did not run.
#[derive(Debug, Error)]
pub enum HapticsError {
    #[error("the device is not ready at an insertion of {insertion_m} m: {why}")]
    NotReady { insertion_m: f64, why: String },
}

/// The loop while it is closed.
struct Closed<'a> {
    config: &'a Config<'a>,
    device: ControlLoop,
    sealer: Sealer,
    protection: Protection,
    to_device: Carrier,
    from_device: Carrier,
    rng: ChaCha8Rng,
    /// The last output that reached the motor.
    motor: f64,
    axis: Axis,
}

impl Operation {
    /// Runs it with a device of this configuration.
    pub fn run(&self, config: &Config<'_>) -> Result<Passed, HapticsError> {
        self.run_armed(config, config)
    }

    /// The same without the passivity observer: its budget is one that no operation spends. No device can be
    /// configured so; this one is from arming on.
    pub fn run_without_observer(&self, config: &Config<'_>) -> Result<Passed, HapticsError> {
        let mut without = config.clone();
        without.settings.energy_limit_j = NO_BUDGET_J;
        self.run_armed(config, &without)
    }

    /// `armed`: the configuration from arming on.
    fn run_armed(&self, config: &Config<'_>, armed: &Config<'_>) -> Result<Passed, HapticsError> {
        let mut closed = Closed::new(self, config);
        closed.arm(self.from_m)?;
        closed.config = armed;
        let mut held = Held::new(self.handle, self.hand, self.start());
        let mut drive = [self.from_m, 0.0];
        let (mut positions, mut outputs) = (Vec::new(), Vec::new());
        let (mut energy_j, mut was_limited, mut stopped) = (0.0, false, None);
        let before_m = self.before();
        let ticks = before_m.ticks() + self.main().ticks() + self.hold_ticks;
        for tick in 0..ticks {
            let t_s = tick as f64 * TICK_S;
            // A rotary operation is inserted first, by hand and without the handle.
            let (position, velocity) = match before_m.ticks() {
                n if tick < n => {
                    drive[0] = before_m.at(t_s).0;
                    (self.start(), 0.0)
                }
                n => self.main().at((tick - n) as f64 * TICK_S),
            };
            let last = held.position;
            held.advance(position, velocity, closed.motor);
            energy_j -= closed.motor * (held.position - last);
            match self.axis {
                Axis::Linear => drive[0] = held.position,
                Axis::Rotary => drive[1] = held.position,
            }
            let seen = closed.tick(drive, None);
            if closed.mode() != Mode::Armed {
                stopped = Some(closed.why());
                break;
            }
            was_limited |= seen;
            positions.push(held.position);
            outputs.push(closed.motor);
        }
        let hold = &positions[positions.len().saturating_sub(self.hold_ticks)..];
        let quarters: Vec<f64> =
            hold.chunks(self.hold_ticks.div_ceil(PARTS).max(1)).map(range).collect();
        let last = quarters.len().saturating_sub(1);
        let swing = quarters.get(last).copied().unwrap_or(0.0);
        let before = last.checked_sub(1).map_or(0.0, |before| quarters[before]);
        let still = match self.axis {
            Axis::Linear => STILL_M,
            Axis::Rotary => STILL_RAD,
        };
        let is_still = swing < still || swing < DYING_OUT * before;
        let steps = outputs.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        Ok(Passed {
            is_stable: is_still && stopped.is_none(),
            swing,
            largest: outputs.iter().fold(0.0, |most: f64, own| most.max(own.abs())),
            largest_step: steps.fold(0.0, f64::max),
            energy_j,
            was_limited,
            stopped,
        })
    }

    /// Where the handle is in the beginning.
    fn start(&self) -> f64 {
        match self.axis {
            Axis::Linear => self.from_m,
            Axis::Rotary => 0.0,
        }
    }

    /// The insertion before a rotary operation.
    fn before(&self) -> Ramp {
        match self.axis {
            Axis::Linear => Ramp { from: self.from_m, to: self.from_m, speed: self.speed_m_per_s },
            Axis::Rotary => Ramp { from: self.from_m, to: self.to_m, speed: self.speed_m_per_s },
        }
    }

    /// What the operator means to do with the handle.
    fn main(&self) -> Ramp {
        match self.axis {
            Axis::Linear => Ramp { from: self.from_m, to: self.to_m, speed: self.speed_m_per_s },
            Axis::Rotary => Ramp { from: 0.0, to: self.turn_rad, speed: self.turn_rad_per_s },
        }
    }
}

/// From one place to another at one speed.
#[derive(Clone, Copy)]
struct Ramp {
    from: f64,
    to: f64,
    speed: f64,
}

impl Ramp {
    fn ticks(&self) -> usize {
        ((self.to - self.from).abs() / self.speed / TICK_S).ceil() as usize
    }

    /// Position and velocity at a time.
    fn at(&self, t_s: f64) -> (f64, f64) {
        let way = self.to - self.from;
        let gone = self.speed * t_s;
        if gone >= way.abs() {
            return (self.to, 0.0);
        }
        (self.from + way.signum() * gone, way.signum() * self.speed)
    }
}

impl<'a> Closed<'a> {
    fn new(operation: &Operation, config: &'a Config<'a>) -> Self {
        Self {
            config,
            device: ControlLoop::new(),
            sealer: Sealer::default(),
            protection: Protection::default(),
            to_device: Carrier::new(operation.delay),
            from_device: Carrier::new(operation.delay),
            rng: ChaCha8Rng::seed_from_u64(operation.seed),
            motor: 0.0,
            axis: operation.axis,
        }
    }

    fn mode(&self) -> Mode {
        self.device.outputs().map_or(Mode::Boot, |own| own.mode)
    }

    /// Starts the device where the drive stands, and arms it.
    fn arm(&mut self, from_m: f64) -> Result<(), HapticsError> {
        let mut command = Some(Command::SelfTest);
        for _ in 0..PATIENCE_TICKS {
            self.tick([from_m, 0.0], command.take());
            match self.mode() {
                Mode::Armed => return Ok(()),
                Mode::Ready => command = Some(Command::Arm),
                Mode::Fault { .. } => break,
                _ => {}
            }
        }
        Err(HapticsError::NotReady { insertion_m: from_m, why: self.why() })
    }

    /// The fault of the device, or its mode.
    fn why(&self) -> String {
        let fault = self.device.outputs().and_then(|own| own.fault);
        fault.map_or_else(|| format!("its mode is {}", self.mode().name()), |own| own.text().into())
    }

    /// One tick of the device, with where the drive is now. Returns whether the output was limited to stay
    /// passive.
    fn tick(&mut self, [insertion_m, rotation_rad]: [f64; 2], command: Option<Command>) -> bool {
        let encoder = Encoder {
            insertion: Insertion::from_m(insertion_m),
            rotation: Rotation::from_rad(rotation_rad),
        };
        self.send(Process::Encoder(encoder));
        if let Some(command) = command {
            self.send(Process::Command(command));
        }
        for frame in self.to_device.arrived() {
            self.device.on_frame(&frame);
        }
        let frames = self.device.tick(Some(self.config), None);
        for frame in frames.into_iter().flatten() {
            self.from_device.send(frame, &mut self.rng);
        }
        for frame in self.from_device.arrived() {
            self.receive(&frame);
        }
        let limited = |own: &Outputs| own.limited.contains(LimitFlags::ENERGY);
        self.device.outputs().is_some_and(limited)
    }

    fn send(&mut self, process: Process) {
        let frame = self.sealer.seal(process, Status::default());
        self.to_device.send(frame, &mut self.rng);
    }

    /// The master takes the newest force; frames of other kinds are not for its motors.
    fn receive(&mut self, frame: &Frame) {
        if Id::from_raw(frame.id()) != Some(Id::Haptic) {
            return;
        }
        let mut counters = cathforce_bus::Counters::default();
        let received = self.protection.receive(Id::Haptic, frame, &mut counters);
        if let Ok(Process::Haptic(haptic)) = received.map(|own| own.process) {
            self.motor = match self.axis {
                Axis::Linear => f64::from(haptic.force.n()),
                Axis::Rotary => f64::from(haptic.torque.n_m()),
            };
        }
    }
}

fn range(values: &[f64]) -> f64 {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    high - low
}
