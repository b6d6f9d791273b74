//! The thread that talks to the device.

mod apply;
mod in_use;
mod pace;
mod playing;
mod recording;
mod watching;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use cathforce_bus::master::Master;
use cathforce_link::Link;
use tokio::sync::watch;

pub use self::in_use::InUse;
use self::watching::Flight;
use super::action::Action;
use super::bus::Bus;
use super::drive::{Drive, Position};
use super::follow::{FollowSource, Heard};
use super::gather::{Gather, History, Snapshot};
use super::listener::Listener;

/// Longest wait for a frame of a run, after which a picture may be due.
const HEARD: Duration = Duration::from_millis(8);

/// A device that runs.
pub struct LinkSource {
    pub link: Box<dyn Link>,
    /// Where the drives' positions stand in a master's own frames.
    pub master: Master,
    /// A trial that this program plays; `None` where another program runs the device.
    pub drive: Option<Drive>,
    /// Send nothing at all.
    pub watch_only: bool,
    /// Who hears the bus besides.
    pub listeners: Vec<Box<dyn Listener>>,
}

/// The thread, and the ways to it.
pub struct Pilot {
    pub pictures: watch::Receiver<Snapshot>,
    pub history: History,
    pub image: InUse,
    pub started: Instant,
    /// `None` where nothing can be changed.
    pub actions: Option<Sender<Action>>,
    /// Whether recordings can be made.
    pub can_record: bool,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Pilot {
    pub fn start(source: LinkSource, listener: Option<Box<dyn Listener>>) -> Self {
        let LinkSource { link, master, drive, watch_only, listeners } = source;
        let can_record = drive.as_ref().is_some_and(|drive| drive.new_recording.is_some());
        let (actions, inbox) = channel();
        let mut pilot =
            Self::begin(master, (!watch_only).then_some(actions), |mut gather, shared| {
                listeners.into_iter().chain(listener).for_each(|own| gather.add_listener(own));
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
                    // Where none was under way there is nothing to end, and nobody is left to be told.
                    let _ = flight.bus.gather.end_recording(None);
                }
            });
        pilot.can_record = can_record;
        pilot
    }

    /// Shows a device that another part of the program runs, until that lets go of its end of the channel.
    pub fn follow(source: FollowSource, listener: Option<Box<dyn Listener>>) -> Self {
        Self::begin(Master::default(), None, |mut gather, shared| {
            listener.into_iter().for_each(|listener| gather.add_listener(listener));
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
        Self {
            pictures,
            history,
            image,
            started,
            actions,
            can_record: false,
            stop,
            thread: Some(thread),
        }
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
