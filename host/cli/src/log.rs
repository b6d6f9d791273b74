//! The recording of a run, shared between the session and the client's tap.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use cathforce_bus::{Direction, Frame};
use cathforce_link::Client;
use cathforce_record::{BusClock, BusFrame, Measured, Recorder, RunResult, WriteError};

/// A recording that sees every frame of a client.
pub struct Log(Arc<Mutex<Logging>>);

struct Logging {
    recorder: Option<Recorder>,
    error: Option<WriteError>,
    clock: BusClock,
    trial_start_ns: u64,
}

impl Log {
    /// Records every frame that `client` sends and receives from now on.
    pub fn attach(client: &mut Client, recorder: Recorder) -> Self {
        let clock = BusClock::new(client.lock_step());
        let logging = Logging { recorder: Some(recorder), error: None, clock, trial_start_ns: 0 };
        let shared = Arc::new(Mutex::new(logging));
        let tapped = Arc::clone(&shared);
        client.set_tap(Some(Box::new(move |direction, frame| {
            lock(&tapped).frame(direction, frame);
        })));
        Self(shared)
    }

    /// The next frame to the device is the first of the trial.
    pub fn trial_begins(&self) {
        let mut logging = lock(&self.0);
        logging.trial_start_ns = logging.clock.now_ns();
    }

    /// Records a row of the trial, at its time on the bus.
    pub fn measured(&self, row: &Measured) {
        let mut logging = lock(&self.0);
        let at_ns = logging.trial_start_ns + (row.t_s * 1e9).round() as u64;
        logging.write(|recorder| recorder.measured(at_ns, row));
    }

    /// What went wrong first, once.
    pub fn take_error(&self) -> Option<WriteError> {
        lock(&self.0).error.take()
    }

    /// Finishes the recording, with `result` if the run came to its end.
    pub fn finish(&self, result: Option<&RunResult>) -> Result<(), WriteError> {
        let mut logging = lock(&self.0);
        let finished = logging.recorder.take().map_or(Ok(()), |r| r.finish(result));
        logging.error.take().map_or(finished, Err)
    }
}

/// A panic elsewhere is no reason to lose the recording.
fn lock(logging: &Mutex<Logging>) -> MutexGuard<'_, Logging> {
    logging.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Logging {
    fn frame(&mut self, direction: Direction, frame: &Frame) {
        let at_ns = self.clock.stamp(direction, frame);
        let frame = BusFrame { at_ns, direction, frame: *frame };
        self.write(|recorder| recorder.frame(&frame));
    }

    /// The first error is kept and ends the run.
    fn write(&mut self, write: impl FnOnce(&mut Recorder) -> Result<(), WriteError>) {
        if let (Some(recorder), None) = (&mut self.recorder, &self.error) {
            self.error = write(recorder).err();
        }
    }
}
