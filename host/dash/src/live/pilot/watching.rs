//! A device that another program runs: watched, and asked for its status.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use cathforce_bus::Command;
use cathforce_bus::service::crc32;
use cathforce_control::Mode;
use cathforce_link::{Client, ClientError, Link, LinkError};
use serde_json::{Value, json};

use super::apply::apply;
use super::in_use::InUse;
use super::pace::{STATUS, TICK};
use crate::live::action::{Action, Wanted};
use crate::live::bus::Bus;
use crate::live::drive::Position;

/// The same after a device did not answer.
const SILENT: Duration = Duration::from_secs(5);
/// How long a bus is listened to before anything is asked.
const LISTEN: Duration = Duration::from_secs(1);
/// Time within which a device that others drive must reach a mode.
const PATIENCE: Duration = Duration::from_secs(3);
const COMMAND_EVERY: Duration = Duration::from_millis(50);

/// The link to a device, and who else knows of it.
pub(super) struct Flight {
    pub(super) bus: Bus,
    pub(super) inbox: Receiver<Action>,
    pub(super) image: InUse,
    pub(super) position: Position,
    pub(super) stop: Arc<AtomicBool>,
}

impl Flight {
    /// Watches a device that another program runs.
    pub(super) fn watch(&mut self, watch_only: bool) -> Result<(), ClientError> {
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
            Wanted::Record(_) => {
                Err("another program runs the device; `cathforce run` records what it does, and \
                     `cathforce dash` with --bundle what is done from here"
                    .into())
            }
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
}
