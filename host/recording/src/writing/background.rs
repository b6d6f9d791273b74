//! Records in the background, so that the thread on the bus never waits for the disk.
//!
//! Frames go through a queue to a thread that writes them. Running free, a full queue loses frames, and
//! the loss is recorded. In lock step the bus waits instead, since its time is virtual.

use std::sync::mpsc::{Receiver, SendError, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use super::writer::{Recorder, WriteError};
use crate::format::clock::BusClock;
use crate::format::dropout::{Dropout, DropoutCause};
use crate::format::frame::BusFrame;
use crate::format::info::RunResult;
use crate::format::trial::Measured;

/// Length of the queue: eight seconds of a full bus, which carries some 8 frames a millisecond.
const QUEUE: usize = 65_536;

enum Job {
    /// A frame, and when it arrived \[ns\].
    Frame(BusFrame, u64),
    /// Time on the bus \[ns\], row, shape.
    Measured(u64, Box<Measured>, Vec<[f64; 3]>),
    Dropout(Dropout),
    Finish(Option<RunResult>),
}

/// A [`Recorder`] in a thread of its own.
pub struct BackgroundRecorder {
    jobs: SyncSender<Job>,
    worker: Option<JoinHandle<()>>,
    error: Arc<Mutex<Option<WriteError>>>,
    waits: bool,
    lost: Option<Dropout>,
}

impl BackgroundRecorder {
    /// `clock`: the clock of the frames.
    pub fn spawn(recorder: Recorder, clock: BusClock) -> Self {
        let waits = clock.lock_step();
        Self::with_queue(QUEUE, waits, move |jobs| write(recorder, &clock, &jobs))
    }

    fn with_queue(
        capacity: usize,
        waits: bool,
        write: impl FnOnce(Receiver<Job>) -> Result<(), WriteError> + Send + 'static,
    ) -> Self {
        let (jobs, received) = sync_channel(capacity);
        let error = Arc::new(Mutex::new(None));
        let told = Arc::clone(&error);
        let worker = std::thread::spawn(move || {
            if let Err(error) = write(received) {
                *told.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
            }
        });
        Self { jobs, worker: Some(worker), error, waits, lost: None }
    }

    /// Takes the next frame of the bus, either direction.
    ///
    /// `arrived_ns`: see [`Recorder::frame_that_arrived`].
    pub fn frame(&mut self, frame: BusFrame, arrived_ns: u64) {
        if self.waits {
            let _ = self.jobs.send(Job::Frame(frame, arrived_ns));
            return;
        }
        if let Some(lost) = self.lost {
            match self.jobs.try_send(Job::Dropout(lost)) {
                Err(TrySendError::Full(_)) => return self.lose(&frame),
                _ => self.lost = None,
            }
        }
        if let Err(TrySendError::Full(_)) = self.jobs.try_send(Job::Frame(frame, arrived_ns)) {
            self.lose(&frame);
        }
        // A worker that has ended left its error behind.
    }

    /// Takes the row of the trial for this time of the bus, see [`Recorder::measured`].
    pub fn measured(&mut self, at_ns: u64, row: &Measured, shape_m: &[[f64; 3]]) {
        let _ = self.jobs.send(Job::Measured(at_ns, Box::new(*row), shape_m.to_vec()));
    }

    /// The error that ended writing; returned only once.
    pub fn take_error(&self) -> Option<WriteError> {
        self.error.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Writes the queue, the result if the run ended normally, and the index.
    pub fn finish(mut self, result: Option<&RunResult>) -> Result<(), WriteError> {
        if let Some(lost) = self.lost.take() {
            let _ = self.jobs.send(Job::Dropout(lost));
        }
        let sent: Result<(), SendError<Job>> = self.jobs.send(Job::Finish(result.copied()));
        // A send fails if the worker has ended with an error, which is taken below.
        drop(sent);
        if let Some(worker) = self.worker.take() {
            // The thread panics only if the recorder does.
            let _ = worker.join();
        }
        self.take_error().map_or(Ok(()), Err)
    }

    fn lose(&mut self, frame: &BusFrame) {
        let lost = self.lost.get_or_insert(Dropout {
            from_ns: frame.at_ns,
            to_ns: frame.at_ns,
            cause: DropoutCause::HostOverload,
            id: None,
            frames: 0,
        });
        lost.to_ns = frame.at_ns;
        lost.frames = lost.frames.saturating_add(1);
    }
}

fn write(mut recorder: Recorder, clock: &BusClock, jobs: &Receiver<Job>) -> Result<(), WriteError> {
    for job in jobs {
        match job {
            Job::Frame(frame, arrived_ns) => {
                recorder.frame_that_arrived(&frame, arrived_ns, clock.logged_ns(&frame))?;
            }
            Job::Measured(at_ns, row, shape_m) => recorder.measured(at_ns, &row, &shape_m)?,
            Job::Dropout(dropout) => recorder.dropout(&dropout)?,
            Job::Finish(result) => return recorder.finish(result.as_ref()),
        }
    }
    recorder.finish(None)
}

#[cfg(test)]
mod tests {
    use cathforce_bus::{Direction, Frame};

    use super::*;
    use crate::format::info::RunInfo;
    use crate::reading::reader::Recording;
    use crate::writing::writer::Attachments;

    const SENT: u64 = 200;

    /// Records frames through a queue of 16 whose worker waits until all but the last have been sent;
    /// returns the recording.
    fn overloaded(waits: bool) -> Recording {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        let attachments = Attachments { image: b"", rig_toml: "", dbc: "", vessel: &[] };
        let recorder = Recorder::create(&path, &RunInfo::default(), attachments).unwrap();
        let (go, wait) = sync_channel::<()>(1);
        let mut background = BackgroundRecorder::with_queue(16, waits, move |jobs| {
            if !waits {
                wait.recv().unwrap();
            }
            write(recorder, &BusClock::new(true), &jobs)
        });
        let frame = |at_ns| {
            let frame = Frame::new(0x7F0, &[at_ns as u8]).unwrap();
            BusFrame { at_ns, direction: Direction::ToHost, frame }
        };
        for at_ns in 0..SENT {
            background.frame(frame(at_ns), at_ns);
        }
        go.send(()).unwrap();
        background.finish(None).unwrap();
        Recording::open(&path).unwrap()
    }

    /// P24: frames that an overloaded host loses are counted and reported.
    #[test]
    fn p24_an_overloaded_host_records_what_it_lost() {
        let recording = overloaded(false);
        assert_eq!(recording.frames.len(), 16);
        let lost = Dropout {
            from_ns: 16,
            to_ns: SENT - 1,
            cause: DropoutCause::HostOverload,
            id: None,
            frames: SENT as u32 - 16,
        };
        assert_eq!(recording.dropouts, [lost]);
    }

    #[test]
    fn p24_in_lock_step_the_bus_waits_and_nothing_is_lost() {
        let recording = overloaded(true);
        assert_eq!(recording.frames.len() as u64, SENT);
        assert_eq!(recording.dropouts, []);
    }
}
