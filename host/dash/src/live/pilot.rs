//! The thread that talks to the device.

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use cathforce_bus::Command;
use cathforce_bus::master::Master;
use cathforce_bus::service::crc32;
use cathforce_config::image::{HEADER_BYTES, decode_head, head_end};
use cathforce_control::{Fault, Mode};
use cathforce_link::{Client, ClientError, Link, LinkError, Step};
use serde_json::{Value, json};
use tokio::sync::watch;

use super::action::{Action, Reply, Wanted};
use super::bus::Bus;
use super::drive::{Drive, Goal, Motion, Position};
use super::follow::{FollowSource, Heard};
use super::gather::{Gather, History, Snapshot};
use crate::settings;

/// From one question for the device's status to the next.
const STATUS: Duration = Duration::from_secs(1);
/// The same after a device did not answer.
const SILENT: Duration = Duration::from_secs(5);
/// How long a bus is listened to before anything is asked.
const LISTEN: Duration = Duration::from_secs(1);
/// Longest wait for a frame of a run, after which a picture may be due.
const HEARD: Duration = Duration::from_millis(8);
const TICK: Duration = Duration::from_millis(1);
/// A computer that is so late gives up the ticks that it missed, instead of hurrying after them.
const LATE: Duration = Duration::from_millis(100);
/// Ticks within which a device must leave a fault, or disarm at the end.
const PATIENCE_TICKS: usize = 1000;
/// Time within which a device that others drive must reach a mode.
const PATIENCE: Duration = Duration::from_secs(3);
const COMMAND_EVERY: Duration = Duration::from_millis(50);

/// A device that runs.
pub struct LinkSource {
    pub link: Box<dyn Link>,
    /// Where the drives' positions stand in a master's own frames.
    pub master: Master,
    /// A trial that this program plays; `None` where another program runs the device.
    pub drive: Option<Drive>,
    /// Send nothing at all.
    pub watch_only: bool,
}

/// The image that the device uses.
#[derive(Clone, Default)]
pub struct InUse(Arc<Mutex<Option<Arc<Vec<u8>>>>>);

impl InUse {
    fn set(&self, image: Vec<u8>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::new(image));
    }

    /// `None` while it is not known.
    pub fn get(&self) -> Option<Arc<Vec<u8>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// The thread, and the ways to it.
pub struct Pilot {
    pub pictures: watch::Receiver<Snapshot>,
    pub history: History,
    pub image: InUse,
    pub started: Instant,
    /// `None` where nothing can be changed.
    pub actions: Option<Sender<Action>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Pilot {
    pub fn start(source: LinkSource) -> Self {
        let LinkSource { link, master, drive, watch_only } = source;
        let (actions, inbox) = channel();
        Self::begin(master, (!watch_only).then_some(actions), |gather, shared| {
            let Shared { image, position, stop } = shared;
            let mut flight = Flight { bus: Bus { link, gather }, inbox, image, position, stop };
            move || {
                let flown = match drive {
                    Some(drive) => flight.drive(&drive),
                    None => flight.watch(watch_only),
                };
                if let Err(error) = flown {
                    flight.bus.gather.lose(error.to_string());
                }
            }
        })
    }

    /// Shows a device that another part of the program runs, until that lets go of its end of the channel.
    pub fn follow(source: FollowSource) -> Self {
        Self::begin(Master::default(), None, |mut gather, shared| {
            move || follow(&mut gather, &source, &shared)
        })
    }

    fn begin<Work: FnOnce() + Send + 'static>(
        master: Master,
        actions: Option<Sender<Action>>,
        work: impl FnOnce(Gather, Shared) -> Work,
    ) -> Self {
        let (to, pictures) = watch::channel(Snapshot::default());
        let (history, image) = (History::default(), InUse::default());
        let (started, stop) = (Instant::now(), Arc::new(AtomicBool::new(false)));
        let position = Position::default();
        let gather = Gather::new(started, master, history.clone(), position.clone(), to);
        let shared = Shared { image: image.clone(), position, stop: Arc::clone(&stop) };
        let thread = std::thread::spawn(work(gather, shared));
        Self { pictures, history, image, started, actions, stop, thread: Some(thread) }
    }
}

/// What the thread shares with the server.
struct Shared {
    image: InUse,
    position: Position,
    stop: Arc<AtomicBool>,
}

/// Gathers what is heard.
fn follow(gather: &mut Gather, source: &FollowSource, shared: &Shared) {
    while !shared.stop.load(Ordering::Relaxed) {
        match source.heard.recv_timeout(HEARD) {
            Ok(Heard::Begins { image, lock_step }) => {
                gather.image(&image, lock_step);
                shared.image.set(image);
            }
            Ok(Heard::Frame(direction, frame)) => gather.frame(direction, &frame),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                return gather.lose("the run has ended".to_owned());
            }
        }
        match source.take_lost() {
            0 => {}
            lost => gather.say(format!(
                "{lost} frames came faster than this computer draws; the recording has them"
            )),
        }
        gather.due();
    }
}

impl Drop for Pilot {
    /// Waits until the device is disarmed.
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // It has nothing to say, not even that it panicked.
            let _ = thread.join();
        }
    }
}

struct Flight {
    bus: Bus,
    inbox: Receiver<Action>,
    image: InUse,
    position: Position,
    stop: Arc<AtomicBool>,
}

impl Flight {
    /// Watches a device that another program runs.
    fn watch(&mut self, watch_only: bool) -> Result<(), ClientError> {
        let (mut asked, mut next) = (Instant::now(), Instant::now() + LISTEN);
        while !self.stop.load(Ordering::Relaxed) {
            (&mut self.bus).receive(Duration::from_millis(20))?;
            if let Ok(Action { wanted, reply }) = self.inbox.try_recv() {
                let answer = self.do_for_others(wanted);
                asked = Instant::now();
                // Whoever asked may have gone.
                let _ = reply.send(answer);
            }
            if watch_only || Instant::now() < next {
                continue;
            }
            // Two programs that ask at once would mix up their transfers.
            let answered = match self.bus.gather.others_ask(asked) {
                true => Ok(()),
                false => self.ask(),
            };
            asked = Instant::now();
            next = asked + STATUS;
            match answered {
                Err(ClientError::Link(LinkError::Silent { .. })) => next = asked + SILENT,
                Err(ClientError::Link(error)) => return Err(error.into()),
                Err(error) => {
                    self.bus.gather.say(error.to_string());
                    next = asked + SILENT;
                }
                Ok(()) => {}
            }
        }
        Ok(())
    }

    /// Asks the device for its status, and for its image where that is new.
    fn ask(&mut self) -> Result<(), ClientError> {
        let known = self.image.get().map_or(0, |image| crc32(&image));
        let mut client = Client::connect(&mut self.bus)?;
        let status = client.status()?;
        client.link_mut().gather.status(&status);
        if status.image_crc32 != 0 && status.image_crc32 != known {
            let image = client.read_image(|_| usize::MAX)?;
            if crc32(&image) == status.image_crc32 {
                client.link_mut().gather.image(&image, status.lock_step);
                self.image.set(image);
            }
        }
        Ok(())
    }

    /// Does something with a device that another program runs.
    fn do_for_others(&mut self, wanted: Wanted) -> Result<Value, String> {
        let said = |error: ClientError| error.to_string();
        match wanted {
            Wanted::Play(_) => Err(
                "another program moves the drives; start `cathforce dash` with --bundle to play \
                     a trial from here"
                    .into(),
            ),
            Wanted::Apply(changes) => {
                self.ask().map_err(said)?;
                let mut client = Client::connect(&mut self.bus).map_err(said)?;
                let lock_step = client.lock_step();
                apply(&mut client, &self.image, &changes, lock_step)
            }
            Wanted::Acknowledge(fault) => {
                if self.bus.gather.mode().and_then(Mode::fault) == Some(fault) {
                    let command = Command::ClearFault { token: fault.clear_token() };
                    self.command_until(command, |mode| mode.fault() != Some(fault))?;
                }
                self.bus.gather.acknowledge(fault);
                Ok(json!({ "acknowledged": fault.name() }))
            }
            Wanted::Arm | Wanted::Disarm | Wanted::SelfTest => {
                let (command, goal) = wanted.command().ok_or("there is no such command")?;
                self.command_until(command, |mode| {
                    let is_tested = wanted == Wanted::SelfTest && mode != Mode::Boot;
                    mode == goal || (is_tested && mode.fault().is_none())
                })?;
                let mode = self.bus.gather.mode().map_or("not configured", Mode::name);
                Ok(json!({ "mode": mode }))
            }
        }
    }

    /// Repeats a command until the device is as wanted.
    fn command_until(
        &mut self,
        command: Command,
        is_done: impl Fn(Mode) -> bool,
    ) -> Result<(), String> {
        if !self.bus.gather.is_ticking() {
            return Err(
                "the device sends no ticks, so no command can act; `cathforce doctor` looks \
                        for the cause"
                    .into(),
            );
        }
        // The counters of the frames go on where the device expects them.
        let mut client = Client::connect(&mut self.bus).map_err(|error| error.to_string())?;
        let (until, mut next) = (Instant::now() + PATIENCE, Instant::now());
        while Instant::now() < until {
            if Instant::now() >= next {
                client.command(command).map_err(|error| error.to_string())?;
                next = Instant::now() + COMMAND_EVERY;
            }
            client.link_mut().receive(TICK).map_err(|error| error.to_string())?;
            if client.link().gather.mode().is_some_and(&is_done) {
                return Ok(());
            }
        }
        let mode = client.link().gather.mode().map_or("not configured", Mode::name);
        Err(format!("the device stayed {mode} for {} s after the command", PATIENCE.as_secs()))
    }

    /// Configures the device and plays a trial on it.
    fn drive(&mut self, drive: &Drive) -> Result<(), ClientError> {
        let mut client = Client::connect(&mut self.bus)?;
        let lock_step = drive.lock_step && client.device().can_lock_step;
        if client.device().can_lock_step {
            client.set_lock_step(lock_step)?;
        }
        client.upload_image(&drive.image, |_| ControlFlow::Continue(()))?;
        client.link_mut().gather.image(&drive.image, lock_step);
        self.image.set(drive.image.clone());
        client.reset_counters()?;
        let motion = RefCell::new(Motion::new(drive.duration_s));
        if drive.play {
            let goal =
                Goal { command: Command::Arm, mode: Mode::Armed, reply: None, then_play: true };
            motion.borrow_mut().go_for(goal);
        }
        while !self.stop.load(Ordering::Relaxed) {
            let waiting =
                play(&mut client, drive, &motion, &self.position, &self.inbox, &self.stop)?;
            if let Some(action) = waiting {
                act(&mut client, drive, &motion, &self.image, action)?;
            }
            let status = client.status()?;
            client.link_mut().gather.status(&status);
        }
        // A device is never left armed.
        let held = (drive.step_at)(motion.borrow().t_s());
        for _ in 0..PATIENCE_TICKS {
            let report = client.run_tick(Step { command: Some(Command::Disarm), ..held })?;
            let mode = Mode::from_codes(report.haptic.mode, report.haptic.fault);
            if !matches!(mode, Some(Mode::Armed | Mode::Ramp { .. })) {
                break;
            }
        }
        Ok(())
    }
}

/// Plays until something is asked for, or the status is due.
fn play(
    client: &mut Client<&mut Bus>,
    drive: &Drive,
    motion: &RefCell<Motion>,
    position: &Position,
    inbox: &Receiver<Action>,
    stop: &AtomicBool,
) -> Result<Option<Action>, ClientError> {
    let mut waiting = None;
    let (until, mut due) = (Instant::now() + STATUS, Instant::now());
    let is_granted = client.lock_step();
    let steps = std::iter::from_fn(|| {
        if stop.load(Ordering::Relaxed) || Instant::now() >= until {
            return None;
        }
        if let Ok(action) = inbox.try_recv() {
            waiting = Some(action);
            return None;
        }
        if is_granted {
            due += TICK;
            match due.checked_duration_since(Instant::now()) {
                Some(early) => std::thread::sleep(early),
                None if due.elapsed() > LATE => due = Instant::now(),
                None => {}
            }
        }
        let mut motion = motion.borrow_mut();
        let (t_s, command) = motion.step();
        position.set(motion.position(), (drive.measured_at)(t_s));
        Some(Step { command, ..(drive.step_at)(t_s) })
    });
    client.play(steps, |tick| {
        motion.borrow_mut().heard(Mode::from_codes(tick.haptic.mode, tick.haptic.fault));
        ControlFlow::Continue(())
    })?;
    Ok(waiting)
}

/// Does what was asked for, between two ticks.
fn act(
    client: &mut Client<&mut Bus>,
    drive: &Drive,
    motion: &RefCell<Motion>,
    image: &InUse,
    action: Action,
) -> Result<(), ClientError> {
    let Action { wanted, reply } = action;
    let mode = motion.borrow().mode;
    if let Some(fault) = mode.and_then(Mode::fault)
        && matches!(wanted, Wanted::Arm | Wanted::SelfTest | Wanted::Play(true))
    {
        let name = fault.name();
        answer(reply, Err(format!("the device has the fault {name}; acknowledge it first")));
        return Ok(());
    }
    match wanted {
        Wanted::Arm | Wanted::Disarm => {
            let Some((command, goal)) = wanted.command() else { return Ok(()) };
            if mode == Some(goal) {
                answer(reply, Ok(json!({ "mode": goal.name() })));
                return Ok(());
            }
            let goal = Goal { command, mode: goal, reply: Some(reply), then_play: false };
            motion.borrow_mut().go_for(goal);
        }
        Wanted::SelfTest => {
            // A device that waits for its test is told so in any case.
            let mode = mode.map_or("not configured", Mode::name);
            answer(reply, Ok(json!({ "mode": mode })));
        }
        Wanted::Play(true) if mode != Some(Mode::Armed) => {
            let (command, mode) = (Command::Arm, Mode::Armed);
            motion.borrow_mut().go_for(Goal { command, mode, reply: Some(reply), then_play: true });
        }
        Wanted::Play(on) => {
            motion.borrow_mut().playing = on;
            answer(reply, Ok(json!({ "playing": on })));
        }
        Wanted::Acknowledge(fault) => {
            let cleared = match mode.and_then(Mode::fault) == Some(fault) {
                true => clear(client, drive, motion, fault)?,
                false => true,
            };
            if !cleared {
                let next = fault.next_step();
                answer(reply, Err(format!("the device keeps the fault {}: {next}", fault.name())));
                return Ok(());
            }
            client.link_mut().gather.acknowledge(fault);
            answer(reply, Ok(json!({ "acknowledged": fault.name() })));
        }
        Wanted::Apply(changes) => {
            if matches!(mode, Some(Mode::Armed | Mode::Ramp { .. })) {
                let why =
                    "the device is armed, and no setting changes in that state; disarm it first";
                answer(reply, Err(why.into()));
                return Ok(());
            }
            let lock_step = client.lock_step();
            let applied = apply(client, image, &changes, lock_step);
            answer(reply, applied);
        }
    }
    Ok(())
}

fn answer(reply: Reply, answer: Result<Value, String>) {
    // Whoever asked may have gone.
    let _ = reply.send(answer);
}

/// Clears a fault while the drives stand still; `false` if the device keeps it.
fn clear(
    client: &mut Client<&mut Bus>,
    drive: &Drive,
    motion: &RefCell<Motion>,
    fault: Fault,
) -> Result<bool, ClientError> {
    let held = (drive.step_at)(motion.borrow().t_s());
    let command = Some(Command::ClearFault { token: fault.clear_token() });
    for _ in 0..PATIENCE_TICKS {
        let report = client.run_tick(Step { command, ..held })?;
        let mode = Mode::from_codes(report.haptic.mode, report.haptic.fault);
        motion.borrow_mut().heard(mode);
        if mode.and_then(Mode::fault) != Some(fault) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Sends an image with other settings, and reads back what the device uses then.
fn apply(
    client: &mut Client<&mut Bus>,
    in_use: &InUse,
    changes: &settings::Changes,
    lock_step: bool,
) -> Result<Value, String> {
    let image = in_use.get().ok_or("the device has no configuration, so nothing can be changed")?;
    let changed = settings::change(&image, changes)?;
    let said = |error: ClientError| error.to_string();
    client.upload_image(&changed.image, |_| ControlFlow::Continue(())).map_err(said)?;
    let front = client.read_image(|read| head_end(read).unwrap_or(HEADER_BYTES)).map_err(said)?;
    let [sent, used] = [decode_head(&changed.image), decode_head(&front)];
    let used = used.map_err(|error| format!("what the device uses cannot be read: {error}"))?;
    let crc = client.status().map_err(said)?.image_crc32;
    if sent.as_ref() != Ok(&used) || crc != crc32(&changed.image) {
        return Err("the device does not read back what it was sent; apply it again".into());
    }
    client.link_mut().gather.image(&changed.image, lock_step);
    in_use.set(changed.image);
    Ok(json!({
        "applied": changes.len(),
        "verified": true,
        "band_dropped": changed.band_dropped,
        "settings": settings::list(&used),
    }))
}
