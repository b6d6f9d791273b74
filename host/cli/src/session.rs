//! One trial on one device: configure, settle, arm, play and disarm it, and record everything.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use cathforce_bus::Command;
use cathforce_bus::service::crc32;
use cathforce_config::image::schema_hash;
use cathforce_control::{ENCODER_TIMEOUT_HARD_TICKS, Mode, TICK_S};
use cathforce_link::{Client, ClientError, Link as _, Step, TickReport, update};
use cathforce_recording::import::join;
use cathforce_recording::sensor::ForceSensor;
use cathforce_recording::{Attachments, BusClock, Measured, Recorder, RunInfo, RunResult, Trial};

use crate::failure::{Code, Failure};
use crate::log::{Log, Watch};
use crate::output::make_room;
use crate::ui::Ui;

/// The definition of every frame, kept in each recording for other tools.
pub const DBC: &str = include_str!("../../../docs/cathforce.dbc");
/// Ticks per second of the device.
const TICKS_PER_S: f64 = 1000.0;
/// Ticks within which a device must arm or ramp down.
const PATIENCE_TICKS: usize = 1000;
/// Ticks after which a command is sent again.
const COMMAND_EVERY_TICKS: usize = 50;
/// Ticks within which a device must settle. No setting allows that many, so that it is the device
/// that gives up.
const SETTLE_TICKS: usize = 70_000;

/// The clock that runs the ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// The host grants each tick, if the device supports it.
    LockStep,
    /// The device's own clock.
    Free,
}

/// Everything that a session needs to know.
pub struct Plan<'a> {
    pub image: &'a [u8],
    pub pace: Pace,
    pub rig_toml: &'a str,
    /// The files that describe the vessel, by their names in the bundle.
    pub vessel: &'a [(&'a str, Vec<u8>)],
    /// Information that does not come from the device.
    pub info: RunInfo,
    pub trial: &'a Trial,
    /// The positions of the drives at a time of the trial \[s\].
    pub step_at: &'a dyn Fn(f64) -> Step,
    /// How much of the trial to play \[s\].
    pub duration_s: f64,
    pub out: &'a Path,
    /// Whether an existing recording is replaced, once this one begins.
    pub overwrite: bool,
    /// Measures the force while the trial is played, in place of the trial's own.
    pub sensor: Option<&'a ForceSensor>,
    /// Sees every frame.
    pub watch: Option<Watch>,
}

/// Runs the plan on the device behind `client`.
///
/// The recording is always finished before an error is returned.
pub fn run(ui: &Ui, client: &mut Client, plan: Plan<'_>) -> Result<(), Failure> {
    let started = Instant::now();
    configure(ui, client, plan.image, plan.pace)?;
    let device = client.device();
    // Both at the same moment, so that the recording can be compared with other logs.
    let (clock, started_unix_ns) = (BusClock::new(client.lock_step()), unix_ns());
    let info = RunInfo {
        started_unix_ns,
        board: device.board.clone(),
        firmware_version: device.firmware.clone(),
        protocol: format!("{:016x}", device.protocol_hash),
        lock_step: client.lock_step(),
        tick_s: f64::from(TICK_S),
        ..plan.info.clone()
    };
    let vessel = plan.vessel.iter().map(|(name, bytes)| (*name, &bytes[..])).collect::<Vec<_>>();
    let attachments =
        Attachments { image: plan.image, rig_toml: plan.rig_toml, dbc: DBC, vessel: &vessel };
    if plan.overwrite {
        make_room(plan.out)?;
    }
    let recorder = Recorder::create(plan.out, &info, attachments)?;
    if let Some(watch) = &plan.watch {
        watch.begins(plan.image, client.lock_step());
    }
    let log = Log::attach(client, recorder, clock, plan.watch.clone());
    let session = Session { ui, log: &log, interrupted: interrupt_flag()?, plan: &plan };
    let played = session.play(client).map_err(|failure| not_in_time(failure, client));
    let ended = played.and_then(|()| session.result(client, started.elapsed()));
    client.set_tap(None);
    let (result, cause) = match ended {
        Ok(result) => (Some(result), None),
        Err(failure) => (None, Some(failure)),
    };
    log.finish(result.as_ref())?;
    cause.map_or(Ok(()), Err)
}

/// How to let this program run in time on a computer with other load.
pub const REAL_TIME: &str = "`chrt -r 10 cathforce run …` gives it a real-time priority; this needs \
                             root, or a line `USER - rtprio 10` in /etc/security/limits.conf";

/// Names this computer as the cause where a device stopped because frames came too late.
fn not_in_time(failure: Failure, client: &Client) -> Failure {
    let latest_ms = 1e3 * client.latest_step().as_secs_f64();
    // A sample that is L ticks late is missing in as many as L + 1 ticks.
    let late_ticks = ENCODER_TIMEOUT_HARD_TICKS - 1;
    let enough_ms = f64::from(late_ticks) * 1e3 * f64::from(TICK_S);
    if failure.code != Code::Device || latest_ms < enough_ms {
        return failure;
    }
    let message = format!(
        "{}\n  this computer sent a frame {latest_ms:.1} ms after its time, because other programs \
         used its processors\n  fix: {REAL_TIME}",
        failure.message
    );
    Failure { message, ..failure }
}

/// Time since 1970 \[ns\].
pub fn unix_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.ok().and_then(|since| u64::try_from(since.as_nanos()).ok()).unwrap_or(0)
}

/// Sends the image to the device and checks that the device uses it. The device runs in lock step
/// if it supports it and `pace` asks for it.
pub fn configure(ui: &Ui, client: &mut Client, image: &[u8], pace: Pace) -> Result<(), Failure> {
    let interrupted = interrupt_flag()?;
    let device = client.device().clone();
    ui.say(format_args!("device: {device}"));
    if device.image_schema_hash != schema_hash() {
        let message = format!(
            "the device ({device}) reads images of schema {:08x} and this program writes {:08x}, so it \
             was not armed\n  fix: {}; or use the program of the device's version (this one is {})",
            device.image_schema_hash,
            schema_hash(),
            update(&device.board),
            env!("CARGO_PKG_VERSION"),
        );
        return Err(Failure::new(Code::Device, message));
    }
    if let Some(mode) = output_is_on(client) {
        return Err(Failure::new(Code::Device, still_on(mode, client.link().name())));
    }
    if device.can_lock_step {
        client.set_lock_step(pace == Pace::LockStep)?;
    }
    let mut progress = ui.progress("upload", image.len() as u64, "bytes");
    client.upload_image(image, |sent| {
        progress.set(sent as u64);
        match interrupted.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    })?;
    drop(progress);
    let (sent, used) = (crc32(image), client.status()?.image_crc32);
    if used != sent {
        let message = format!(
            "the device ({device}) uses an image of CRC {used:08x} instead of {sent:08x}, which it \
             was sent\n  fix: stop other programs that configure the device, and send it again"
        );
        return Err(Failure::new(Code::Device, message));
    }
    Ok(client.reset_counters()?)
}

/// The mode of a device whose output is on, and which therefore takes no configuration (P17). It is
/// the mode at the time of connecting.
pub fn output_is_on(client: &Client) -> Option<Mode> {
    // The fault behind a ramp does not matter here.
    let mode = Mode::from_codes(client.device().mode, 0);
    mode.filter(|mode| matches!(mode, Mode::Armed | Mode::Ramp { .. }))
}

/// Why nothing was sent to a device whose output is on, and what to do.
pub fn still_on(mode: Mode, link: &str) -> String {
    let state = if mode == Mode::Armed { "armed" } else { "ramping to zero" };
    format!(
        "the output of the device on {link} is {state}, and no setting changes in that state. Nothing \
         was sent\n  fix: disarm it with the program that armed it, or end that program; without its \
         frames the output goes to zero, which `cathforce monitor --link {link}` shows"
    )
}

/// A flag that Ctrl-C, SIGTERM and SIGHUP set. A second signal ends the program at once.
pub fn interrupt_flag() -> Result<&'static AtomicBool, Failure> {
    static FLAG: AtomicBool = AtomicBool::new(false);
    // Only one handler can be installed, so all sessions share it.
    static LISTENING: OnceLock<Result<(), String>> = OnceLock::new();
    let listening = LISTENING.get_or_init(|| {
        ctrlc::set_handler(|| {
            if FLAG.swap(true, Ordering::Relaxed) {
                std::process::exit(Code::Failed as i32);
            }
        })
        .map_err(|e| format!("cannot listen for Ctrl-C: {e}"))
    });
    listening.clone().map_err(|message| Failure::new(Code::Failed, message))?;
    Ok(&FLAG)
}

struct Session<'a> {
    ui: &'a Ui,
    log: &'a Log,
    interrupted: &'a AtomicBool,
    plan: &'a Plan<'a>,
}

impl Session<'_> {
    fn play(&self, client: &mut Client) -> Result<(), Failure> {
        let start = (self.plan.step_at)(0.0);
        self.ui.say("settling to the measured insertion");
        self.hold(client, start, Command::SelfTest, Mode::Ready, SETTLE_TICKS)?;
        self.hold(client, start, Command::Arm, Mode::Armed, PATIENCE_TICKS)?;
        let mut last = start;
        let played = self.trial(client, &mut last);
        if played.as_ref().is_err_and(|failure| failure.code == Code::Link) {
            return played;
        }
        // Also after an interruption, so that the device is never left armed.
        let disarmed = self.hold(client, last, Command::Disarm, Mode::Ready, PATIENCE_TICKS);
        played.and(disarmed)
    }

    /// Holds the drives still and repeats a command until the device is in the mode `wanted`.
    fn hold(
        &self,
        client: &mut Client,
        still: Step,
        command: Command,
        wanted: Mode,
        ticks: usize,
    ) -> Result<(), Failure> {
        // Repeated, because a device does not arm in a tick whose forces were not resolved.
        let steps = (0..ticks).map(|tick| {
            let command = tick.is_multiple_of(COMMAND_EVERY_TICKS).then_some(command);
            Step { command, ..still }
        });
        let (mut mode, mut reached, mut broken) = (None, false, None);
        client.play(steps, |tick| {
            mode = Mode::from_codes(tick.haptic.mode, tick.haptic.fault);
            reached |= mode == Some(wanted);
            // Ticks that are under way still arrive after the end, so the first cause is kept.
            broken = broken.take().or_else(|| self.broken(tick, command == Command::Disarm));
            if broken.is_some() || reached {
                return ControlFlow::Break(());
            }
            ControlFlow::Continue(())
        })?;
        if let Some(failure) = broken {
            return Err(failure);
        }
        if reached {
            return Ok(());
        }
        let mode = mode.map_or("in no known mode", Mode::name);
        let message = format!(
            "the device is {mode} {ticks} ticks after {command:?} and should be {}\n  fix: look at its \
             counters with `cathforce info --link …`",
            wanted.name()
        );
        Err(Failure::new(Code::Device, message))
    }

    /// Plays the trial. `last` becomes the position to be held afterwards.
    fn trial(&self, client: &mut Client, last: &mut Step) -> Result<(), Failure> {
        let ticks = (self.plan.duration_s * TICKS_PER_S).floor() as u64 + 1;
        let mut progress = self.ui.progress("playing", ticks, "ticks");
        let (mut done, mut broken) = (0, None);
        self.log.trial_begins();
        let began = Instant::now();
        // With a sensor, the rows are those of its forces, which are known at the end.
        let own = if self.plan.sensor.is_some() { &[][..] } else { &self.plan.trial.rows };
        let mut rows = own.iter().enumerate().peekable();
        let played = client.play(
            (0..ticks).map(|tick| {
                let t_s = tick as f64 / TICKS_PER_S;
                // A row is recorded with the first step at or after its time.
                while let Some((i, row)) = rows.next_if(|(_, row)| row.t_s <= t_s + 1e-9) {
                    let shape_m = self.plan.trial.shapes_m.get(i);
                    self.log.measured(row, shape_m.map_or(&[], Vec::as_slice));
                }
                *last = (self.plan.step_at)(t_s);
                *last
            }),
            |tick| {
                done += 1;
                progress.set(done);
                broken = broken.take().or_else(|| self.broken(tick, false));
                if broken.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            },
        );
        // Also of a trial that broke off: what was measured is kept.
        let sensed = self.plan.sensor.map_or(Ok(()), |sensor| self.sensed(sensor, began));
        played?;
        broken.map_or(Ok(()), Err)?;
        sensed
    }

    /// Records the forces of the sensor, each with the drives' position of its time.
    fn sensed(&self, sensor: &ForceSensor, began: Instant) -> Result<(), Failure> {
        let sensed = sensor.forces(began).map_err(|e| Failure::new(Code::Link, e.to_string()))?;
        for understood in &sensed.understood {
            self.ui.say(format_args!("sensor: {understood}"));
        }
        for remark in &sensed.remarks {
            self.ui.warn(format_args!("sensor: {remark}"));
        }
        // What the trial has behind the part that was played did not happen.
        let played_s = began.elapsed().as_secs_f64().min(self.plan.duration_s);
        let is_played = |row: &Measured| row.t_s <= played_s;
        let played = self.plan.trial.rows.partition_point(is_played);
        let mut trial = self.plan.trial.clone();
        // The row behind the end is that to which the last positions are interpolated.
        trial.rows.truncate(played + 1);
        let mut joined = join(&trial, &sensed.samples, 0.0);
        joined.trial.rows.truncate(joined.trial.rows.partition_point(is_played));
        if joined.forces == 0 {
            let message = "sensor: no force was measured where the trial has positions of the drives\n  fix: \
                           play a trial whose rows are at most 0.25 s apart";
            return Err(Failure::new(Code::Failed, message));
        }
        for (row, shape_m) in joined.trial.rows.iter().zip(&joined.trial.shapes_m) {
            self.log.measured(row, shape_m);
        }
        Ok(())
    }

    /// The reason to end a run early, if there is one. Ctrl-C does not interrupt disarming.
    fn broken(&self, tick: &TickReport, disarming: bool) -> Option<Failure> {
        if let Some(error) = self.log.take_error() {
            return Some(error.into());
        }
        let mode = Mode::from_codes(tick.haptic.mode, tick.haptic.fault);
        if let Some(fault) = mode.and_then(Mode::fault) {
            let message = format!("the device stopped in tick {}: {}", tick.tick, fault.text());
            return Some(Failure::new(Code::Device, message));
        }
        let interrupted = self.interrupted.load(Ordering::Relaxed) && !disarming;
        interrupted.then(|| {
            Failure::new(Code::Failed, "interrupted; the recording up to here is complete")
        })
    }

    fn result(&self, client: &mut Client, wall: Duration) -> Result<RunResult, Failure> {
        let status = client.status()?;
        Ok(RunResult::of(&status, u32::try_from(wall.as_millis()).unwrap_or(u32::MAX)))
    }
}

impl From<ClientError> for Failure {
    fn from(error: ClientError) -> Self {
        let code = match error {
            ClientError::Link(_) => Code::Link,
            ClientError::ImageTooLong { .. } => Code::Input,
            ClientError::Stopped => Code::Failed,
            _ => Code::Device,
        };
        Self::new(code, error.to_string())
    }
}
