//! One picture of the present, from the frames of a bus.

mod history;
mod picture;

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use cathforce_bus::master::Master;
use cathforce_bus::service::{Load, Status};
use cathforce_bus::{Direction, Frame, Id, Process};
use cathforce_control::{Fault, Mode};
use cathforce_recording::latency::age_s;
use cathforce_recording::{
    BusFrame, Decoder, DropoutCause, Measured, RunResult, TickEstimate, direction,
};
use serde::Serialize;
use serde_json::Value;
use tokio::sync::watch;

pub use history::History;
pub use picture::Snapshot;

use super::drive::{Measurement, Position};
use super::faults::Faults;
use super::listener::Listener;
use super::record::{NewRecording, Recording};
use super::timing::{Stage, Times};
use super::twin::Twin;
use history::Point;

/// From one picture to the next: a browser draws 60 a second.
const PICTURE: Duration = Duration::from_micros(16_667);
/// Over which rates and load are counted.
const WINDOW: Duration = Duration::from_secs(1);
/// Numbers of lost ticks that are kept.
const LOST: usize = 50;
/// A tick so long after the last grant was not granted.
const GRANTED_WITHIN: Duration = Duration::from_millis(200);

/// Forces as they were heard last \[N, N·m\].
#[derive(Clone, Copy, Debug, Default, Serialize)]
struct Forces {
    #[serde(rename = "fx_N")]
    fx: Option<f32>,
    #[serde(rename = "fy_N")]
    fy: Option<f32>,
    #[serde(rename = "fz_N")]
    fz: Option<f32>,
    #[serde(rename = "norm_N")]
    norm: Option<f32>,
    #[serde(rename = "drive_fx_N")]
    drive: Option<f32>,
    #[serde(rename = "drive_torque_N_m")]
    torque: Option<f32>,
}

/// Gathers frames into pictures.
pub struct Gather {
    started: Instant,
    master: Master,
    decoder: Decoder,
    faults: Faults,
    recent: VecDeque<(Instant, u32, Option<Id>)>,
    encoder_at: Option<Instant>,
    /// When the encoder samples of granted ticks were sent.
    granted: VecDeque<Option<Instant>>,
    granted_at: Option<Instant>,
    sample_at: Option<Instant>,
    heard_at: Option<Instant>,
    mode: Option<Mode>,
    has_mode: bool,
    forces: Forces,
    band_n: [Option<f32>; 4],
    position: Position,
    insertion_m: Option<f32>,
    rotation_rad: Option<f32>,
    haptic: [f32; 2],
    age_in_device_s: Option<f64>,
    unresolved_ticks: u64,
    limited: bool,
    ticks: u64,
    published_ticks: u64,
    next_tick: u32,
    /// The device has said a number since its configuration.
    is_numbered: bool,
    lost_ticks: VecDeque<u32>,
    dropouts: BTreeMap<DropoutCause, u64>,
    load: Option<Load>,
    rejected: u64,
    point: Option<Point>,
    points: u64,
    history: History,
    twin: Option<Twin>,
    bus_nodes: Vec<([f32; 3], [f32; 3])>,
    answer: Times,
    in_device: Times,
    publishing: Times,
    stages: Vec<Stage>,
    summed_up_at: Instant,
    published_at: Instant,
    scene: u64,
    said: Option<String>,
    lost: Option<String>,
    sequence: u64,
    listeners: Vec<Box<dyn Listener>>,
    recording: Option<Recording>,
    /// What the sensor said last.
    measured: Option<Measurement>,
    to: watch::Sender<Snapshot>,
}

impl Gather {
    pub fn new(
        started: Instant,
        master: Master,
        history: History,
        position: Position,
        to: watch::Sender<Snapshot>,
    ) -> Self {
        Self {
            started,
            master,
            decoder: Decoder::new(master),
            faults: Faults::default(),
            recent: VecDeque::new(),
            encoder_at: None,
            granted: VecDeque::new(),
            granted_at: None,
            sample_at: None,
            heard_at: None,
            mode: None,
            has_mode: false,
            forces: Forces::default(),
            band_n: [None; 4],
            position,
            insertion_m: None,
            rotation_rad: None,
            haptic: [0.0; 2],
            age_in_device_s: None,
            unresolved_ticks: 0,
            limited: false,
            ticks: 0,
            published_ticks: 0,
            next_tick: 0,
            is_numbered: false,
            lost_ticks: VecDeque::new(),
            dropouts: BTreeMap::new(),
            load: None,
            rejected: 0,
            point: None,
            points: 0,
            history,
            twin: None,
            bus_nodes: Vec::new(),
            answer: Times::default(),
            in_device: Times::default(),
            publishing: Times::default(),
            stages: Vec::new(),
            summed_up_at: started,
            published_at: started,
            scene: 0,
            said: None,
            lost: None,
            sequence: 0,
            listeners: Vec::new(),
            recording: None,
            measured: None,
            to,
        }
    }

    /// Lets somebody hear the bus.
    pub fn add_listener(&mut self, listener: Box<dyn Listener>) {
        self.listeners.push(listener);
    }

    /// Begins a recording of a device with this image; gives its file.
    pub fn begin_recording(&mut self, new: &NewRecording, image: &[u8]) -> Result<Value, String> {
        if self.recording.is_some() {
            return Err("a recording is under way; stop it first".to_owned());
        }
        let recording = Recording::begin(new, image)?;
        let state = recording.state();
        self.recording = Some(recording);
        Ok(state)
    }

    /// Ends the recording; gives its file and length. `result`: what the device said at the end.
    pub fn end_recording(&mut self, result: Option<RunResult>) -> Result<Value, String> {
        let recording = self.recording.take();
        recording.ok_or("there is no recording to stop")?.end(result)
    }

    /// Notices that nothing more is written.
    fn check_recording(&mut self) {
        if let Some(error) = self.recording.as_ref().and_then(Recording::take_error) {
            self.recording = None;
            self.said = Some(error.to_string());
        }
    }

    /// The device uses this image from now on; the host's copy of the tick begins anew with it.
    pub fn image(&mut self, image: &[u8], lock_step: bool) {
        self.scene += 1;
        if self.recording.is_some() {
            let ended = self.end_recording(None);
            self.said = Some(match ended {
                Ok(_) => "the device was configured anew, which ended the recording".to_owned(),
                Err(why) => why,
            });
        }
        for listener in &mut self.listeners {
            listener.begins(image);
        }
        self.bus_nodes.clear();
        self.twin = Twin::new(image.to_vec(), lock_step).ok();
        self.master = cathforce_config::image::master(image).unwrap_or_default();
        self.decoder = Decoder::new(self.master);
        (self.next_tick, self.is_numbered) = (0, false);
    }

    /// What the device said of itself.
    pub fn status(&mut self, status: &Status) {
        self.load = Some(status.load);
        let good = [cathforce_bus::Counter::Accepted, cathforce_bus::Counter::AfterLoss];
        let kinds = cathforce_bus::Counter::FRAME_KINDS.into_iter();
        let bad = kinds.filter(|kind| !good.contains(kind));
        self.rejected = bad.map(|kind| u64::from(status.counters.get(kind))).sum();
    }

    /// A remark for the viewers.
    pub fn say(&mut self, said: impl Into<String>) {
        self.said = Some(said.into());
    }

    /// Nothing more will come.
    pub fn lose(&mut self, why: String) {
        self.lost = Some(why);
        if self.recording.is_some()
            && let Err(why) = self.end_recording(None)
        {
            self.said = Some(why);
        }
        self.publish();
    }

    pub fn acknowledge(&mut self, fault: Fault) -> bool {
        self.faults.acknowledge(fault)
    }

    pub fn mode(&self) -> Option<Mode> {
        self.mode
    }

    /// Whether a tick came lately.
    pub fn is_ticking(&self) -> bool {
        self.heard_at.is_some_and(|at| at.elapsed() < WINDOW)
    }

    /// Whether ticks are granted one by one.
    pub fn is_granted(&self) -> bool {
        self.granted_at.is_some_and(|at| at.elapsed() < WINDOW)
    }

    /// Another program talks to the device's service.
    pub fn others_ask(&self, own: Instant) -> bool {
        let asked = self.recent.iter().rev().find(|(.., id)| *id == Some(Id::ServiceRequest));
        asked.is_some_and(|(at, ..)| *at > own)
    }

    /// Takes a frame that this program sent.
    pub fn sent(&mut self, frame: &Frame) {
        self.frame(Direction::ToDevice, frame);
    }

    /// Takes a frame of the bus.
    pub fn received(&mut self, frame: &Frame) {
        let direction = direction(frame, &self.master).unwrap_or(Direction::ToHost);
        self.frame(direction, frame);
    }

    /// Takes a frame whose sender is known.
    pub fn frame(&mut self, direction: Direction, frame: &Frame) {
        for listener in &mut self.listeners {
            listener.frame(direction, frame);
        }
        if let Some(recording) = &mut self.recording {
            recording.frame(direction, frame);
        }
        let (now, id) = (Instant::now(), Id::from_raw(frame.id()));
        let bits = if id == Some(Id::Sync) { 0 } else { frame.most_bits() };
        self.recent.push_back((now, bits, id));
        if matches!(id, Some(Id::ServiceRequest | Id::ServiceResponse)) {
            return;
        }
        if direction == Direction::ToDevice {
            let is_own = id == Some(Id::Encoder) && self.master.catheter.is_none();
            if is_own || (self.master.catheter.is_some() && self.master.has(frame.id())) {
                self.encoder_at = Some(now);
            }
            if id == Some(Id::Sync) {
                self.granted.push_back(self.encoder_at);
                self.granted_at = Some(now);
            }
            if let Some(twin) = &mut self.twin {
                twin.on_frame_to_device(frame);
            }
        } else if let (Some(id), Some(&payload)) = (id, frame.data().first_chunk()) {
            match Process::decode(id, payload) {
                Some(Process::Haptic(haptic)) => self.haptic(now, haptic),
                Some(Process::Tick(tick)) => self.number(tick),
                _ => {}
            }
        }
        let at_ns = u64::try_from(now.duration_since(self.started).as_nanos()).unwrap_or(u64::MAX);
        let completed = self.decoder.push(&BusFrame { at_ns, direction, frame: *frame });
        if let Some(tick) = completed.tick {
            self.tick(&tick);
        }
        if let Some(pass) = completed.nodes {
            self.bus_nodes = pass.nodes.iter().map(|n| (n.position_m, n.force_n)).collect();
        }
        if let Some(missed) = completed.missed {
            *self.dropouts.entry(missed.cause).or_default() += u64::from(missed.frames);
        }
    }

    /// A tick begins.
    fn haptic(&mut self, now: Instant, haptic: cathforce_bus::Haptic) {
        let mode = Mode::from_codes(haptic.mode, haptic.fault);
        if mode == Some(Mode::Boot) && self.mode != Some(Mode::Boot) {
            // A new configuration: the counters of the device's frames begin anew.
            self.decoder = Decoder::new(self.master);
        }
        (self.mode, self.has_mode) = (mode, true);
        self.faults.see(mode.and_then(Mode::fault), unix_ms());
        self.heard_at = Some(now);
        self.ticks += 1;
        self.next_tick = self.next_tick.wrapping_add(1);
        if self.granted_at.is_some_and(|at| now.duration_since(at) > GRANTED_WITHIN) {
            (self.granted_at, self.granted) = (None, VecDeque::new());
        }
        let sent_at = match self.granted.pop_front() {
            Some(sent_at) => sent_at,
            None => self.encoder_at,
        };
        let in_device_s = self.age_in_device_s.unwrap_or(0.0);
        self.sample_at =
            sent_at.and_then(|at| at.checked_sub(Duration::from_secs_f64(in_device_s)));
        if let Some(at) = sent_at {
            self.answer.push(now.duration_since(at).as_secs_f64());
            self.in_device.push(in_device_s);
        }
        if let Some(twin) = &mut self.twin {
            twin.device_ticked();
            // In lock step the copy is ahead of the answers, and stops for the same faults.
            let is_lost = twin.mode().is_some_and(|mode| mode.fault().is_some());
            if self.granted_at.is_none() && is_lost && mode.is_some_and(|m| m.fault().is_none()) {
                twin.restart(false);
            }
            let waits = matches!(twin.mode(), None | Some(Mode::Boot));
            if waits && !matches!(mode, None | Some(Mode::Boot | Mode::Fault { .. })) {
                twin.test_itself();
            }
        }
    }

    /// The device says which tick this is: ticks in between were lost on the way.
    fn number(&mut self, tick: cathforce_bus::Tick) {
        if let Some(twin) = &mut self.twin {
            twin.compare(tick);
        }
        let counted = self.next_tick.wrapping_sub(1);
        let ahead = tick.tick.wrapping_sub(counted as u16) as i16;
        // Before the first number it is not known how many there were.
        let lost = if self.is_numbered { ahead.max(0).unsigned_abs() } else { 0 };
        for number in 0..u32::from(lost).min(LOST as u32) {
            if self.lost_ticks.len() == LOST {
                self.lost_ticks.pop_front();
            }
            self.lost_ticks.push_back(counted.wrapping_add(number));
        }
        self.is_numbered = true;
        self.next_tick = self.next_tick.wrapping_add_signed(i32::from(ahead));
    }

    fn tick(&mut self, tick: &TickEstimate) {
        self.unresolved_ticks += u64::from(tick.unresolved);
        self.limited = tick.limited;
        self.haptic = [tick.haptic_force_n, tick.haptic_torque_n_m];
        // What comes in one tick of several stays until it comes again.
        self.insertion_m = tick.insertion_m.or(self.insertion_m);
        self.rotation_rad = tick.rotation_rad.or(self.rotation_rad);
        if let Some([x, y, z]) = tick.force_n {
            let norm = (x * x + y * y + z * z).sqrt();
            let (fx, fy, fz, norm) = (Some(x), Some(y), Some(z), Some(norm));
            self.forces = Forces { fx, fy, fz, norm, ..self.forces };
        }
        self.forces.drive = tick.drive_force_n.or(self.forces.drive);
        self.forces.torque = tick.drive_torque_n_m.or(self.forces.torque);
        if tick.has_band {
            let of = |k: usize| tick.force_half_width_n.map(|widths_n| widths_n[k]);
            self.band_n = [of(0), of(1), of(2), tick.drive_force_half_width_n];
        }
        if let Some(age_ticks) = tick.encoder_age_ticks {
            self.age_in_device_s = age_s(age_ticks);
        }
        self.tell_measured();
        let Forces { fx, fy, fz, drive, torque, .. } = self.forces;
        let [mx, my, mz, md] = self.measured().unwrap_or([None; 4]);
        let [bx, by, bz, bd] = self.band_n;
        let at_s = tick.at_ns as f64 * 1e-9;
        let point = [Some(at_s as f32), fx, fy, fz, drive, torque, mx, my, mz, md, bx, by, bz, bd];
        // Of the ticks between two pictures the one with the largest force is drawn.
        let size =
            |point: &Point| point[1..4].iter().map(|x| x.unwrap_or(0.0).powi(2)).sum::<f32>();
        if self.point.as_ref().is_none_or(|kept| size(kept) <= size(&point)) {
            self.point = Some(point);
        }
    }

    /// Tells the listeners what a sensor has measured anew.
    fn tell_measured(&mut self) {
        let Some((playing, Some(measured))) = self.position.get() else { return };
        if self.measured.replace(measured) == Some(measured) {
            return;
        }
        let Measurement([fx, fy, fz, drive]) = measured;
        let axes = [fx, fy, fz].map(|axis| axis.map(f64::from));
        let force_n = match axes {
            [Some(x), Some(y), Some(z)] => Some([x, y, z]),
            _ => None,
        };
        let Some((insertion_m, rotation_rad)) = self.insertion_m.zip(self.rotation_rad) else {
            return;
        };
        let row = Measured {
            t_s: playing.t_s,
            insertion_m: insertion_m.into(),
            rotation_rad: rotation_rad.into(),
            force_n,
            drive_force_n: drive.map(f64::from),
            tip_m: None,
            guidewire: None,
            tendons_m: Default::default(),
        };
        for listener in &mut self.listeners {
            listener.measured(&row);
        }
        if let Some(recording) = &mut self.recording {
            recording.measured(&row);
        }
    }

    fn measured(&self) -> Option<[Option<f32>; 4]> {
        self.position.get()?.1.map(|measured| measured.0)
    }

    /// Publishes a picture if it is time for one.
    pub fn due(&mut self) {
        if self.published_at.elapsed() >= PICTURE {
            self.publish();
        }
    }
}

/// Time since 1970 \[ms\].
fn unix_ms() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.ok().and_then(|since| u64::try_from(since.as_millis()).ok()).unwrap_or(0)
}
