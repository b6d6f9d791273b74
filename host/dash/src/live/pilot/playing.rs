//! A device that this program configures, and a trial that it plays on it.

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use cathforce_bus::Command;
use cathforce_control::{Fault, Mode};
use cathforce_link::{Client, ClientError, Step};
use serde_json::{Value, json};

use super::apply::apply;
use super::in_use::InUse;
use super::pace::{STATUS, TICK};
use super::recording::record;
use super::watching::Flight;
use crate::live::action::{Action, Reply, Wanted};
use crate::live::bus::Bus;
use crate::live::drive::{Drive, Goal, Motion, Position};

/// A computer that is so late gives up the ticks that it missed, instead of hurrying after them.
const LATE: Duration = Duration::from_millis(100);
/// Ticks within which a device must leave a fault, or disarm at the end.
const PATIENCE_TICKS: usize = 1000;

impl Flight {
    /// Configures the device and plays a trial on it.
    pub(super) fn drive(&mut self, drive: &Drive) -> Result<(), ClientError> {
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
        // Where no recording is under way there is none to end.
        let _ = record(&mut client, &self.image, None, false);
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
        Wanted::Record(on) => {
            let recorded = record(client, image, drive.new_recording.as_ref(), on);
            answer(reply, recorded);
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
