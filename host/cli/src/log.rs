//! The recording of a run, which the session and the client's tap share.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use cathforce_bus::{Direction, Frame};
use cathforce_link::Client;
use cathforce_recording::{
    BackgroundRecorder, BusClock, BusFrame, Measured, Recorder, RunResult, WriteError,
};

/// Whoever watches a run while it lasts.
pub trait Watcher: Send + Sync {
    /// The device uses this image from now on.
    fn begins(&self, image: &[u8], lock_step: bool);
    /// A frame was sent or received.
    fn frame(&self, direction: Direction, frame: &Frame);
}

pub type Watch = Arc<dyn Watcher>;

/// A recording of every frame of a client.
pub struct Log(Arc<Mutex<Logging>>);

struct Logging {
    recorder: Option<BackgroundRecorder>,
    clock: BusClock,
    trial_start_ns: u64,
}

impl Log {
    /// Records every frame that `client` sends and receives from now on.
    ///
    /// `clock`: started together with the recording.
    /// `watch` sees them too.
    pub fn attach(
        client: &mut Client,
        recorder: Recorder,
        clock: BusClock,
        watch: Option<Watch>,
    ) -> Self {
        let recorder = Some(BackgroundRecorder::spawn(recorder, clock.clone()));
        let shared = Arc::new(Mutex::new(Logging { recorder, clock, trial_start_ns: 0 }));
        let tapped = Arc::clone(&shared);
        client.set_tap(Some(Box::new(move |direction, frame, waited| {
            lock(&tapped).frame(direction, frame, waited);
            if let Some(watch) = &watch {
                watch.frame(direction, frame);
            }
        })));
        Self(shared)
    }

    /// Marks the next frame to the device as the first of the trial.
    pub fn trial_begins(&self) {
        let mut logging = lock(&self.0);
        logging.trial_start_ns = logging.clock.now_ns();
    }

    /// Records a row of the trial at its time on the bus, and the points of its shape \[m\].
    pub fn measured(&self, row: &Measured, shape_m: &[[f64; 3]]) {
        let mut logging = lock(&self.0);
        let at_ns = logging.trial_start_ns.saturating_add((row.t_s * 1e9).round() as u64);
        if let Some(recorder) = &mut logging.recorder {
            recorder.measured(at_ns, row, shape_m);
        }
    }

    /// The error that ended the recording; `None` from the second call on.
    pub fn take_error(&self) -> Option<WriteError> {
        lock(&self.0).recorder.as_ref()?.take_error()
    }

    /// Finishes the recording. A run that came to its end has a `result`.
    pub fn finish(&self, result: Option<&RunResult>) -> Result<(), WriteError> {
        let recorder = lock(&self.0).recorder.take();
        recorder.map_or(Ok(()), |recorder| recorder.finish(result))
    }
}

/// Ignores poisoning: a panic elsewhere must not lose the recording.
fn lock(logging: &Mutex<Logging>) -> MutexGuard<'_, Logging> {
    logging.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Logging {
    fn frame(&mut self, direction: Direction, frame: &Frame, waited: Option<Duration>) {
        let at_ns = self.clock.stamp(direction, frame);
        if let Some(recorder) = &mut self.recorder {
            let arrived_ns = self.clock.arrived_ns(at_ns, waited);
            recorder.frame(BusFrame { at_ns, direction, frame: *frame }, arrived_ns);
        }
    }
}
