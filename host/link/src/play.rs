//! Playing ticks: what is sent in each, and what comes back.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use cathforce_bus::master::{Master, Place, Selector};
use cathforce_bus::{Command, Encoder, Frame, Process, Status, Sync, Tendons};

use crate::{Client, ClientError, Link, LinkError, TickReport};

/// Ticks that are under way at most in lock step; with three frames each they fit into the
/// queue of [`cathforce_bus::service::BLOCK_SIZE`] frames that every device has.
const WINDOW: usize = 16;

/// How long a device may take for a tick in lock step: an emulated one runs on a busy computer.
const TICK_TIMEOUT: Duration = Duration::from_secs(5);

const TICK: Duration = Duration::from_millis(1);

/// How long to wait for the tick after the last step when running free.
const LAST_TICK: Duration = Duration::from_millis(20);

// The length of `Step::tendons` is a literal, because rustc 1.95 breaks off at closures that build a
// `Step` from another one whose array has a computed length.
const _: () = assert!(cathforce_bus::TENDON_PAIRS == 2);

/// What the host sends for one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Step {
    pub encoder: Option<Encoder>,
    /// Of the guidewire's drive, where there is one.
    pub guidewire: Option<Encoder>,
    /// The operator holds the guidewire's button: its load is felt, not the catheter's.
    pub guidewire_held: bool,
    /// Displacements of the tendons' drives, by pairs; `None` for pairs that there are not.
    pub tendons: [Option<Tendons>; 2],
    pub command: Option<Command>,
}

impl<L: Link> Client<L> {
    /// One tick in lock step; running free, one millisecond and the last tick in it.
    pub fn run_tick(&mut self, step: Step) -> Result<TickReport, ClientError> {
        let mut last = None;
        self.play([step], |report| {
            last = Some(*report);
            ControlFlow::Continue(())
        })?;
        last.ok_or_else(|| self.silent(LAST_TICK).into())
    }

    /// Sends one step a tick and hands every tick of the device to `on_tick`, in order.
    ///
    /// In lock step each step is one tick of the device, whatever this computer does, and
    /// several are under way at a time. Running free, a step is sent every millisecond by
    /// this computer's clock. `on_tick` can end it; ticks already under way are still
    /// handed over. Returns the steps sent.
    pub fn play(
        &mut self,
        steps: impl IntoIterator<Item = Step>,
        on_tick: impl FnMut(&TickReport) -> ControlFlow<()>,
    ) -> Result<usize, ClientError> {
        let steps = steps.into_iter();
        if self.lock_step {
            self.play_granted(steps, on_tick)
        } else {
            self.play_free(steps, on_tick)
        }
    }

    fn play_granted(
        &mut self,
        mut steps: impl Iterator<Item = Step>,
        mut on_tick: impl FnMut(&TickReport) -> ControlFlow<()>,
    ) -> Result<usize, ClientError> {
        let (mut sent, mut under_way, mut ended) = (0, 0, false);
        loop {
            // Refilled only when half empty, which makes fewer and longer writes.
            if under_way <= WINDOW / 2 {
                while !ended && under_way < WINDOW {
                    let Some(step) = steps.next() else {
                        ended = true;
                        break;
                    };
                    self.send_step(step)?;
                    let host_tick = self.host_tick;
                    self.host_tick = host_tick.wrapping_add(1);
                    self.send_process(Process::Sync(Sync { grant: 1, host_tick }))?;
                    sent += 1;
                    under_way += 1;
                }
            }
            if under_way == 0 {
                return Ok(sent);
            }
            let report =
                self.receive_tick(TICK_TIMEOUT)?.ok_or_else(|| self.silent(TICK_TIMEOUT))?;
            under_way -= 1;
            ended |= on_tick(&report).is_break();
        }
    }

    fn play_free(
        &mut self,
        steps: impl Iterator<Item = Step>,
        mut on_tick: impl FnMut(&TickReport) -> ControlFlow<()>,
    ) -> Result<usize, ClientError> {
        let (mut sent, mut answered) = (0, true);
        let (mut due, mut heard) = (Instant::now(), Instant::now());
        for step in steps {
            self.latest_step = self.latest_step.max(due.elapsed());
            self.send_step(step)?;
            self.link.flush()?;
            (sent, answered) = (sent + 1, false);
            due += TICK;
            while let Some(left) =
                due.checked_duration_since(Instant::now()).filter(|d| !d.is_zero())
            {
                let Some(report) = self.receive_tick(left)? else { continue };
                (heard, answered) = (Instant::now(), true);
                if on_tick(&report).is_break() {
                    // The next step may be late already, which may be why the caller stops here.
                    self.latest_step = self.latest_step.max(due.elapsed());
                    return Ok(sent);
                }
            }
            if heard.elapsed() > TICK_TIMEOUT {
                return Err(self.silent(TICK_TIMEOUT).into());
            }
        }
        // Waits for one tick only: the device goes on, and ramps down without encoder frames.
        if !answered && let Some(report) = self.receive_tick(LAST_TICK)? {
            let _ = on_tick(&report);
        }
        Ok(sent)
    }

    fn send_step(&mut self, step: Step) -> Result<(), LinkError> {
        for frame in foreign(&self.master, step) {
            self.send(&frame)?;
        }
        if let Some(encoder) = step.encoder.filter(|_| self.master.catheter.is_none()) {
            self.send_process(Process::Encoder(encoder))?;
        }
        if let Some(guidewire) = step.guidewire.filter(|_| self.master.guidewire.is_none()) {
            let status = Status { hand: step.guidewire_held, ..Status::default() };
            self.send_sealed(Process::Guidewire(guidewire), status)?;
        }
        for tendons in step.tendons.into_iter().flatten() {
            self.send_process(Process::Tendons(tendons))?;
        }
        if let Some(command) = step.command {
            self.send_process(Process::Command(command))?;
        }
        Ok(())
    }

    fn silent(&self, waited: Duration) -> LinkError {
        LinkError::Silent {
            link: self.link.name().into(),
            waited,
            awaited: "a tick of the device",
            check: "that the device still runs (`cathforce info`) and has not been reset",
        }
    }
}

/// The frames of a master of its own, whose operator grips the handle and holds one button.
fn foreign(master: &Master, step: Step) -> Vec<Frame> {
    let drives = [
        (master.catheter, step.encoder, !step.guidewire_held),
        (master.guidewire, step.guidewire, step.guidewire_held),
    ];
    let mut frames = Vec::<(u32, Option<Selector>, [u8; 8])>::new();
    let mut put = |place: Option<Place>, value: f64| {
        let Some(Place { id, signal, selector }) = place else { return };
        // What every frame of an identifier holds comes along with what some hold.
        let shares = |known: &(u32, Option<Selector>, _)| {
            known.0 == id && (known.1 == selector || known.1.is_none() || selector.is_none())
        };
        let at = frames.iter().position(shares).unwrap_or_else(|| {
            frames.push((id, None, [0; 8]));
            frames.len() - 1
        });
        let (_, own, data) = &mut frames[at];
        if let Some(selector) = selector {
            *own = Some(selector);
            selector.write(data);
        }
        signal.write(value, data);
    };
    let mut moves = false;
    for (drive, at, held) in drives {
        let Some((drive, at)) = drive.zip(at) else { continue };
        moves = true;
        put(Some(drive.insertion), at.insertion.m().into());
        put(Some(drive.rotation), at.rotation.rad().into());
        put(drive.held, f64::from(u8::from(held)));
    }
    put(master.grip.filter(|_| moves), 1.0);
    frames.into_iter().filter_map(|(id, _, data)| Frame::new(id, &data)).collect()
}
