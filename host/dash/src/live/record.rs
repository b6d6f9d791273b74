//! A recording that is started and stopped from the page.

use std::path::PathBuf;
use std::time::Instant;

use cathforce_bus::{Direction, Frame};
use cathforce_recording::{
    BackgroundRecorder, BusClock, BusFrame, Measured, Recorder, RunResult, WriteError,
};
use serde_json::{Value, json};

/// Makes the file of a new recording of a device with this image. `Err` says why there is none.
pub type NewRecording = Box<dyn Fn(&[u8]) -> Result<(PathBuf, Recorder), String> + Send>;

/// A recording that is being written, by the clock of this computer.
pub struct Recording {
    path: PathBuf,
    recorder: BackgroundRecorder,
    clock: BusClock,
    started: Instant,
    frames: u64,
}

impl Recording {
    pub fn begin(new: &NewRecording, image: &[u8]) -> Result<Self, String> {
        let (path, recorder) = new(image)?;
        // It may begin between any two ticks, so it never replays from the first one.
        let clock = BusClock::new(false);
        let recorder = BackgroundRecorder::spawn(recorder, clock.clone());
        Ok(Self { path, recorder, clock, started: Instant::now(), frames: 0 })
    }

    pub fn frame(&mut self, direction: Direction, frame: &Frame) {
        let at_ns = self.clock.stamp(direction, frame);
        self.recorder.frame(BusFrame { at_ns, direction, frame: *frame }, at_ns);
        self.frames += 1;
    }

    /// Takes what a sensor measured now; the time of the row is that since the recording began.
    pub fn measured(&mut self, row: &Measured) {
        let at_ns = self.clock.now_ns();
        self.recorder.measured(at_ns, &Measured { t_s: at_ns as f64 * 1e-9, ..*row }, &[]);
    }

    /// File, time so far \[s\] and frames so far.
    pub fn state(&self) -> Value {
        json!({
            "file": self.path.display().to_string(),
            "s": self.started.elapsed().as_secs_f64(),
            "frames": self.frames,
        })
    }

    /// Why nothing more is written, once.
    pub fn take_error(&self) -> Option<WriteError> {
        self.recorder.take_error()
    }

    /// Writes the rest. `result`: what the device said at the end, where it was asked.
    pub fn end(self, result: Option<RunResult>) -> Result<Value, String> {
        let state = self.state();
        let wall_ms = u32::try_from(self.started.elapsed().as_millis()).unwrap_or(u32::MAX);
        let result = result.map(|result| RunResult { wall_ms, ..result });
        self.recorder.finish(result.as_ref()).map_err(|error| error.to_string())?;
        Ok(state)
    }
}
