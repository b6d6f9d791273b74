//! The recording of a run, shared between the session and the client's tap.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use cathforce_bus::{Direction, Frame};
use cathforce_link::Client;
use cathforce_recording::{
    BackgroundRecorder, BusClock, BusFrame, Measured, Recorder, RunResult, WriteError,
};

/// A recording that sees every frame of a client.
pub struct Log(Arc<Mutex<Logging>>);

struct Logging {
    recorder: Option<BackgroundRecorder>,
    clock: BusClock,
    trial_start_ns: u64,
}

impl Log {
    /// Records every frame that `client` sends and receives from now on.
    ///
    /// `clock`: began when the recording says that it did.
    pub fn attach(client: &mut Client, recorder: Recorder, clock: BusClock) -> Self {
        let recorder = Some(BackgroundRecorder::spawn(recorder, clock.clone()));
        let shared = Arc::new(Mutex::new(Logging { recorder, clock, trial_start_ns: 0 }));
        let tapped = Arc::clone(&shared);
        client.set_tap(Some(Box::new(move |direction, frame, waited| {
            lock(&tapped).frame(direction, frame, waited);
        })));
        Self(shared)
    }

    /// The next frame to the device is the first of the trial.
    pub fn trial_begins(&self) {
        let mut logging = lock(&self.0);
        logging.trial_start_ns = logging.clock.now_ns();
    }

    /// Records a row of the trial, at its time on the bus, and the points of its shape.
    pub fn measured(&self, row: &Measured, shape_m: &[[f64; 3]]) {
        let mut logging = lock(&self.0);
        let at_ns = logging.trial_start_ns + (row.t_s * 1e9).round() as u64;
        if let Some(recorder) = &mut logging.recorder {
            recorder.measured(at_ns, row, shape_m);
        }
    }

    /// Why recording ended, once.
    pub fn take_error(&self) -> Option<WriteError> {
        lock(&self.0).recorder.as_ref()?.take_error()
    }

    /// Finishes the recording, with `result` if the run came to its end.
    pub fn finish(&self, result: Option<&RunResult>) -> Result<(), WriteError> {
        let recorder = lock(&self.0).recorder.take();
        recorder.map_or(Ok(()), |recorder| recorder.finish(result))
    }
}

/// A panic elsewhere is no reason to lose the recording.
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
