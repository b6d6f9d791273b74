//! A recording, played for Foxglove at the speed and from the time that it asks for.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use cathforce_recording::Recording;
use foxglove::WebSocketServerHandle;
use foxglove::websocket::{
    PlaybackCommand, PlaybackControlRequest, PlaybackState, PlaybackStatus, ServerListener,
};

use super::outlet::Outlet;
use crate::stamped::Outlet as _;

/// From one look at what is due to the next.
const LOOK: Duration = Duration::from_millis(5);
/// From one repetition of what a late client must know to the next, in time of the recording \[ns\].
const AGAIN_NS: u64 = 1_000_000_000;
/// Slowest and fastest.
const SPEEDS: (f32, f32) = (0.01, 100.0);

/// What the clients asked for, shared with the thread that plays.
pub struct Control {
    begin_ns: u64,
    end_ns: u64,
    now: Mutex<Now>,
}

#[derive(Clone, Copy)]
struct Now {
    status: PlaybackStatus,
    at_ns: u64,
    speed: f32,
    sought: bool,
}

impl Control {
    pub fn of(recording: &Recording) -> Arc<Self> {
        let times = || recording.frames.iter().map(|frame| frame.at_ns);
        let (begin_ns, end_ns) = (times().min().unwrap_or(0), times().max().unwrap_or(0));
        let status = PlaybackStatus::Ended;
        let now = Mutex::new(Now { status, at_ns: begin_ns, speed: 1.0, sought: false });
        Arc::new(Self { begin_ns, end_ns, now })
    }

    /// First and last time \[ns\].
    pub fn range_ns(&self) -> (u64, u64) {
        (self.begin_ns, self.end_ns)
    }

    fn now(&self) -> MutexGuard<'_, Now> {
        self.now.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn state(now: &Now, did_seek: bool, request_id: Option<String>) -> PlaybackState {
        let Now { status, at_ns, speed, .. } = *now;
        PlaybackState { status, current_time: at_ns, playback_speed: speed, did_seek, request_id }
    }
}

impl ServerListener for Control {
    /// Where nothing plays, it begins anew for whoever comes. Who has stopped it finds it stopped.
    fn on_client_connect(&self) {
        let mut now = self.now();
        if now.status == PlaybackStatus::Ended {
            (now.status, now.at_ns, now.sought) = (PlaybackStatus::Playing, self.begin_ns, true);
        }
    }

    fn on_playback_control_request(
        &self,
        request: PlaybackControlRequest,
    ) -> Option<PlaybackState> {
        let mut now = self.now();
        if request.playback_speed.is_finite() {
            now.speed = request.playback_speed.clamp(SPEEDS.0, SPEEDS.1);
        }
        let seek_ns = request.seek_time.map(|at_ns| at_ns.clamp(self.begin_ns, self.end_ns));
        if let Some(at_ns) = seek_ns {
            (now.at_ns, now.sought) = (at_ns, true);
        }
        now.status = match request.playback_command {
            PlaybackCommand::Pause => PlaybackStatus::Paused,
            PlaybackCommand::Play => PlaybackStatus::Playing,
        };
        Some(Self::state(&now, seek_ns.is_some(), Some(request.request_id)))
    }
}

/// The thread that plays.
pub struct Player {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Player {
    /// Plays until it is dropped, and ends the server then.
    pub fn start(
        outlet: Outlet,
        recording: Recording,
        control: Arc<Control>,
        handle: WebSocketServerHandle,
    ) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let ended = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            let mut playing = Playing::new(outlet, recording);
            let mut looked = Instant::now();
            while !ended.load(Ordering::Relaxed) {
                std::thread::sleep(LOOK);
                playing.go_on(&control, looked.elapsed(), &handle);
                looked = Instant::now();
            }
            // Clients are let go at once.
            drop(handle.stop());
        });
        Self { stop, thread: Some(thread) }
    }
}

impl Drop for Player {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // It has nothing to say, not even that it panicked.
            let _ = thread.join();
        }
    }
}

/// The recording and how far it was sent.
struct Playing {
    outlet: Outlet,
    recording: Recording,
    frame: usize,
    row: usize,
    again_ns: u64,
    /// In lock step the frames to the device are ahead of its answers, and some of these are of before the time
    /// that was sought: they are not sent.
    from_ns: u64,
}

impl Playing {
    fn new(outlet: Outlet, recording: Recording) -> Self {
        let mut playing = Self { outlet, recording, frame: 0, row: 0, again_ns: 0, from_ns: 0 };
        playing.seek(0);
        playing
    }

    /// Sends what came about since the last look.
    fn go_on(&mut self, control: &Control, passed: Duration, handle: &WebSocketServerHandle) {
        let (now, sought, has_ended) = {
            let mut now = control.now();
            if now.status != PlaybackStatus::Playing {
                return;
            }
            let sought = std::mem::take(&mut now.sought).then_some(now.at_ns);
            if sought.is_none() {
                let ns = passed.as_secs_f64() * 1e9 * f64::from(now.speed);
                now.at_ns = now.at_ns.saturating_add(ns as u64).min(control.end_ns);
            }
            let has_ended = now.at_ns == control.end_ns;
            if has_ended {
                now.status = PlaybackStatus::Ended;
            }
            (*now, sought, has_ended)
        };
        if let Some(at_ns) = sought {
            self.seek(at_ns);
        }
        self.send_until(now.at_ns);
        handle.broadcast_time(now.at_ns);
        if sought.is_some() || has_ended {
            handle.broadcast_playback_state(Control::state(&now, sought.is_some(), None));
        }
    }

    /// Goes to a time: what was before counts, and is not sent.
    fn seek(&mut self, at_ns: u64) {
        let Self { outlet, recording, .. } = self;
        outlet.topics.begin(&recording.image);
        let before = recording.frames.iter().take_while(|frame| frame.at_ns < at_ns);
        self.frame = before.map(|frame| outlet.topics.pass_over(frame)).count();
        let rows = &recording.trial.rows;
        self.row = rows.partition_point(|row| row_ns(recording, row.t_s) < at_ns);
        (self.again_ns, self.from_ns) = (at_ns, at_ns);
    }

    fn send_until(&mut self, at_ns: u64) {
        let Self { outlet, recording, .. } = self;
        if at_ns >= self.again_ns {
            self.again_ns = at_ns.saturating_add(AGAIN_NS);
            let messages = outlet.topics.again(at_ns);
            outlet.send(messages);
        }
        while let Some(frame) = recording.frames.get(self.frame).filter(|f| f.at_ns <= at_ns) {
            let arrived_ns = recording.arrived_ns.get(self.frame).copied().unwrap_or(frame.at_ns);
            let mut messages = outlet.topics.frame(frame, arrived_ns);
            if let Ok(messages) = &mut messages {
                messages.retain(|message| message.at_ns >= self.from_ns);
            }
            outlet.send(messages);
            self.frame += 1;
        }
        while let Some(row) = recording.trial.rows.get(self.row) {
            let row_ns = row_ns(recording, row.t_s);
            if row_ns > at_ns {
                break;
            }
            let shape_m = recording.trial.shapes_m.get(self.row).map_or(&[][..], Vec::as_slice);
            let messages = outlet.topics.measured(row_ns, row, shape_m);
            outlet.send(messages);
            self.row += 1;
        }
    }
}

/// Time on the bus of a time of the trial \[ns\].
fn row_ns(recording: &Recording, t_s: f64) -> u64 {
    recording.trial_start_ns.unwrap_or(0).saturating_add((t_s * 1e9).round() as u64)
}
