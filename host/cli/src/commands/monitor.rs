//! `cathforce monitor`: a bus, or a recording as it was, on a terminal.

use std::io::{IsTerminal, Write, stdout};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use cathforce_bus::Direction;
use cathforce_bus::master::Master;
use cathforce_link::Link;
use cathforce_recording::{BusClock, BusFrame, direction};
use crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers};

use crate::args::MonitorArguments;
use crate::failure::{Code, Failure};
use crate::monitor::{Monitor, Targets, draw};
use crate::session::interrupt_flag;
use crate::settings::master_of;
use crate::ui::Ui;

/// From one picture to the next; little enough for a slow SSH connection.
const PICTURE: Duration = Duration::from_millis(100);
/// How long a key press is waited for; with no time at all the library does not look.
const KEY: Duration = Duration::from_millis(1);
/// From one line to the next where there is no terminal.
const LINE: Duration = Duration::from_secs(1);

pub fn run(ui: &Ui, arguments: &MonitorArguments) -> Result<(), Failure> {
    let (name, mut source) = match (&arguments.source.link, &arguments.source.recording) {
        (Some(link), _) => {
            let master = master_of(arguments.source.settings.as_deref())?;
            (link.clone(), Source::of_link(link, master)?)
        }
        (None, Some(path)) => {
            let recording = crate::open::open_recording(ui, path)?;
            let master = recording.master();
            (path.display().to_string(), Source::of_frames(recording.frames, master))
        }
        // The argument parser asks for one of the two.
        (None, None) => return Ok(()),
    };
    source.targets = targets(arguments);
    // Until a link that waits is there, Ctrl-C ends this program as any other.
    let interrupted = interrupt_flag()?;
    match ui.json || !stdout().is_terminal() {
        true => print(&mut source, interrupted, arguments.duration),
        false => show(ui, &name, &mut source, interrupted, arguments.duration),
    }
}

/// Places that the tip has to reach.
fn targets(arguments: &MonitorArguments) -> Targets {
    let in_metres = |place: &[f64; 3]| place.map(|mm| 1e-3 * mm);
    Targets::new(arguments.targets.iter().map(in_metres).collect(), 1e-3 * arguments.within_mm)
}

/// Where frames come from.
struct Source {
    kind: Kind,
    targets: Targets,
    /// Where the drives' positions stand in the master's own frames.
    master: Master,
}

enum Kind {
    Link { link: Box<dyn Link>, clock: BusClock },
    Frames { frames: std::iter::Peekable<std::vec::IntoIter<BusFrame>>, started: Instant },
}

impl Source {
    fn of_link(address: &str, master: Master) -> Result<Self, Failure> {
        let link = cathforce_link::open(address)?;
        let kind = Kind::Link { link, clock: BusClock::new(false) };
        Ok(Self { kind, targets: Targets::default(), master })
    }

    fn of_frames(mut frames: Vec<BusFrame>, master: Master) -> Self {
        // In lock step frames to the device run ahead of the answers.
        frames.sort_by_key(|frame| frame.at_ns);
        let frames = frames.into_iter().peekable();
        let kind = Kind::Frames { frames, started: Instant::now() };
        Self { kind, targets: Targets::default(), master }
    }

    fn monitor(&self) -> Monitor {
        let monitor = match &self.kind {
            Kind::Link { link, .. } => Monitor::of_link(self.master, link.name()),
            Kind::Frames { .. } => Monitor::new(self.master),
        };
        monitor.with_targets(self.targets.clone())
    }

    /// Hands everything to `monitor` that comes within `time`; `false` when no more will.
    fn feed(&mut self, monitor: &mut Monitor, time: Duration) -> Result<bool, Failure> {
        let until = Instant::now() + time;
        match &mut self.kind {
            Kind::Link { link, clock } => {
                while let Some(left) = until.checked_duration_since(Instant::now()) {
                    let Some(frame) = link.receive(left)? else { continue };
                    let direction = direction(&frame, &self.master).unwrap_or(Direction::ToHost);
                    let at_ns = clock.stamp(direction, &frame);
                    monitor.frame(&BusFrame { at_ns, direction, frame });
                }
                monitor.advance(clock.now_ns());
                Ok(true)
            }
            Kind::Frames { frames, started } => {
                std::thread::sleep(time);
                let now_ns = u64::try_from(started.elapsed().as_nanos()).unwrap_or(u64::MAX);
                while let Some(frame) = frames.next_if(|frame| frame.at_ns <= now_ns) {
                    monitor.frame(&frame);
                }
                Ok(frames.peek().is_some())
            }
        }
    }
}

/// One line of JSON a second.
fn print(
    source: &mut Source,
    interrupted: &AtomicBool,
    duration_s: Option<f64>,
) -> Result<(), Failure> {
    let (mut monitor, started) = (source.monitor(), Instant::now());
    loop {
        let more = source.feed(&mut monitor, LINE)?;
        let failed = |e: &dyn std::fmt::Display| {
            Failure::new(Code::Failed, format!("cannot write to stdout: {e}"))
        };
        let line = serde_json::to_string(&monitor.shown()).map_err(|e| failed(&e))?;
        match writeln!(stdout(), "{line}") {
            // Whoever closed the pipe has seen enough.
            Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => return Ok(()),
            written => written.map_err(|e| failed(&e))?,
        }
        if !more || over(started, duration_s) || interrupted.load(Ordering::Relaxed) {
            return Ok(());
        }
    }
}

fn show(
    ui: &Ui,
    name: &str,
    source: &mut Source,
    interrupted: &AtomicBool,
    duration_s: Option<f64>,
) -> Result<(), Failure> {
    let failed = |e: std::io::Error| {
        Failure::new(Code::Failed, format!("cannot draw on this terminal: {e}"))
    };
    let (mut monitor, started) = (source.monitor(), Instant::now());
    // A remark would be written across the picture.
    cathforce_link::set_remarks(|_| {});
    let mut terminal = ratatui::try_init().map_err(failed)?;
    let shown = loop {
        let fed = source.feed(&mut monitor, PICTURE);
        let drawn = terminal.draw(|frame| draw(frame, name, &monitor, ui.colour)).map(drop);
        let end = fed.is_err() || over(started, duration_s) || interrupted.load(Ordering::Relaxed);
        match drawn.and_then(|()| asked_to_quit()).map_err(failed) {
            Ok(false) if !end => {}
            result => break fed.and(result),
        }
    };
    ratatui::restore();
    shown.map(drop)
}

fn over(started: Instant, duration_s: Option<f64>) -> bool {
    duration_s.is_some_and(|seconds| started.elapsed().as_secs_f64() >= seconds)
}

/// In raw mode Ctrl-C is a key like another.
fn asked_to_quit() -> std::io::Result<bool> {
    while event::poll(KEY)? {
        let Event::Key(key) = event::read()? else { continue };
        let control_c =
            key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL);
        let quit = matches!(key.code, KeyCode::Char('q') | KeyCode::Esc) || control_c;
        if key.kind == KeyEventKind::Press && quit {
            return Ok(true);
        }
    }
    Ok(false)
}
