//! The state of a bus, gathered frame by frame.

use std::collections::{BTreeMap, VecDeque};

use cathforce_bus::master::{Collector, Master};
use cathforce_bus::{Direction, Id, Process};
use cathforce_control::{Fault, Mode};
use cathforce_recording::latency::age_s;
use cathforce_recording::{BusFrame, Decoder, DropoutCause, GuidewireEstimate, TickEstimate};
use serde::ser::SerializeMap as _;
use serde::{Serialize, Serializer};

use super::advice::{Heard, advice};
use super::targets::{ShownTargets, Targets};

/// Over which rates and load are counted \[ns\].
const WINDOW_NS: u64 = 1_000_000_000;
/// From one point of the force's history to the next \[ns\].
const HISTORY_EVERY_NS: u64 = 100_000_000;
/// A device's mode before it has a configuration.
const NOT_CONFIGURED: &str = "not configured";
/// Points of the history: a minute.
const HISTORY: usize = 600;
/// A tick so long after the last grant was not granted \[ns\].
const GRANTED_WITHIN_NS: u64 = 200_000_000;

/// The state of a bus.
#[derive(Default)]
pub struct Monitor {
    decoder: Decoder,
    master: Collector,
    /// Times of whole positions of the catheter's drive in the window.
    positions_ns: VecDeque<u64>,
    now_ns: u64,
    /// Time, bits and kind of each frame in the window.
    recent: VecDeque<(u64, u32, Option<Id>)>,
    encoder_ns: Option<u64>,
    shown: Shown,
    history: VecDeque<f32>,
    history_peak_n: f32,
    history_from_ns: u64,
    /// The address of a bus that is there; a recording needs no advice.
    link: Option<String>,
    /// When a tick was last granted, while ticks are.
    granted_ns: Option<u64>,
    fault: Option<Fault>,
    targets: Targets,
}

/// What is shown, and printed as JSON. What has not been heard is absent.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Shown {
    /// Since the first frame \[s\].
    pub seconds: f64,
    pub mode: Option<&'static str>,
    pub fault: Option<&'static str>,
    pub ticks: u64,
    pub unresolved_ticks: u64,
    pub limited: bool,
    pub encoder_hz: usize,
    pub tick_hz: usize,
    /// Of 1 Mbit/s, every frame at its longest, service frames included; without SYNC, which only
    /// a device in lock step needs.
    pub bus_load: f64,
    /// From the newest encoder frame to the tick, and what the device adds to it \[s\].
    pub answer_s: Option<f64>,
    pub age_in_device_s: Option<f64>,
    pub insertion_m: Option<f32>,
    pub rotation_rad: Option<f32>,
    #[serde(flatten, serialize_with = "force")]
    pub force_n: Option<[f32; 3]>,
    #[serde(rename = "drive_fx_N")]
    pub drive_force_n: Option<f32>,
    #[serde(rename = "drive_torque_N_m")]
    pub drive_torque_n_m: Option<f32>,
    /// Nine of ten true forces lie so near to these.
    #[serde(flatten, serialize_with = "half_width")]
    pub force_half_width_n: Option<[f32; 3]>,
    #[serde(rename = "drive_fx_half_width_N")]
    pub drive_force_half_width_n: Option<f32>,
    #[serde(rename = "haptic_force_N")]
    pub haptic_force_n: f32,
    #[serde(rename = "haptic_torque_N_m")]
    pub haptic_torque_n_m: f32,
    pub guidewire: Option<GuidewireEstimate>,
    /// Frames that are missing or could not be used.
    pub dropouts: BTreeMap<DropoutCause, u64>,
    /// Ticks are granted one by one, so that rates and loads are not those of real time.
    pub lock_step: bool,
    /// Where the operator has to go, if anything was said of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub targets: Option<ShownTargets>,
    /// What to do next, where something is to be done.
    pub advice: Option<String>,
}

/// A force under the names of a trial's columns.
fn force<S: Serializer>(of: &Option<[f32; 3]>, to: S) -> Result<S::Ok, S::Error> {
    axes(["fx_N", "fy_N", "fz_N"], *of, to)
}

/// Its half widths likewise.
fn half_width<S: Serializer>(of: &Option<[f32; 3]>, to: S) -> Result<S::Ok, S::Error> {
    axes(["fx_half_width_N", "fy_half_width_N", "fz_half_width_N"], *of, to)
}

fn axes<S: Serializer>(names: [&str; 3], of: Option<[f32; 3]>, to: S) -> Result<S::Ok, S::Error> {
    let mut map = to.serialize_map(Some(3))?;
    for (k, name) in names.into_iter().enumerate() {
        map.serialize_entry(name, &of.map(|values| values[k]))?;
    }
    map.end()
}

impl Shown {
    /// From the encoder frame to the first frame of the tick that used it \[s\].
    pub fn end_to_end_s(&self) -> Option<f64> {
        Some(self.answer_s? + self.age_in_device_s?)
    }
}

impl Monitor {
    /// Of a bus on which a master may have frames of its own.
    pub fn new(master: Master) -> Self {
        let (decoder, master) = (Decoder::new(master), Collector::new(master));
        Self { decoder, master, ..Self::default() }
    }

    /// The same of a bus that is there, under this address.
    pub fn of_link(master: Master, link: &str) -> Self {
        Self { link: Some(link.into()), ..Self::new(master) }
    }

    /// The same with places that the tip has to reach.
    pub fn with_targets(self, targets: Targets) -> Self {
        Self { targets, ..self }
    }

    /// Takes the next frame of the bus.
    pub fn frame(&mut self, frame: &BusFrame) {
        let id = Id::from_raw(frame.frame.id());
        self.advance(frame.at_ns);
        let bits = if id == Some(Id::Sync) { 0 } else { frame.frame.most_bits() };
        self.recent.push_back((frame.at_ns, bits, id));
        if frame.direction == Direction::ToDevice && self.is_position(frame, id) {
            self.encoder_ns = Some(frame.at_ns);
            self.positions_ns.push_back(frame.at_ns);
        }
        if id == Some(Id::Sync) {
            self.granted_ns = Some(frame.at_ns);
        }
        if id == Some(Id::Haptic) {
            self.haptic(frame);
        }
        let completed = self.decoder.push(frame);
        if let Some(tick) = completed.tick {
            self.tick(&tick);
        }
        if let Some(missed) = completed.missed {
            *self.shown.dropouts.entry(missed.cause).or_default() += u64::from(missed.frames);
        }
    }

    /// With this frame the position of the catheter's drive is whole.
    fn is_position(&mut self, frame: &BusFrame, id: Option<Id>) -> bool {
        match self.master.master().catheter {
            None => id == Some(Id::Encoder),
            Some(_) => {
                self.master.take(&frame.frame);
                self.master.catheter().is_some()
            }
        }
    }

    /// Time goes on whether frames come or not.
    pub fn advance(&mut self, now_ns: u64) {
        self.now_ns = self.now_ns.max(now_ns);
        while self.recent.front().is_some_and(|(at_ns, ..)| at_ns + WINDOW_NS <= self.now_ns) {
            self.recent.pop_front();
        }
        while self.positions_ns.front().is_some_and(|at_ns| at_ns + WINDOW_NS <= self.now_ns) {
            self.positions_ns.pop_front();
        }
    }

    /// How it is now.
    pub fn shown(&self) -> Shown {
        let count = |wanted: Id| self.recent.iter().filter(|(.., id)| *id == Some(wanted)).count();
        let bits: u64 = self.recent.iter().map(|(_, bits, _)| u64::from(*bits)).sum();
        let (ticks, lock_step) = (count(Id::Haptic), self.granted_ns.is_some());
        let heard = Heard {
            frames: self.recent.len(),
            ticks,
            lock_step,
            is_configured: self.shown.mode.map(|mode| mode != NOT_CONFIGURED),
            fault: self.fault,
        };
        // In its first second a bus may be silent.
        let link = self.link.as_deref().filter(|_| ticks > 0 || self.now_ns >= WINDOW_NS);
        Shown {
            seconds: self.now_ns as f64 * 1e-9,
            encoder_hz: self.positions_ns.len(),
            tick_hz: ticks,
            bus_load: bits as f64 / 1e6,
            lock_step,
            targets: self.targets.shown(),
            advice: link.and_then(|link| advice(link, heard)),
            ..self.shown.clone()
        }
    }

    /// The largest force in each tenth of a second, oldest first \[mN\].
    pub fn history_mn(&self) -> impl DoubleEndedIterator<Item = u64> {
        self.history.iter().map(|force_n| (1e3 * force_n) as u64)
    }

    /// The device's word on its state must not wait for the tick's last frame.
    fn haptic(&mut self, frame: &BusFrame) {
        let Some(&payload) = frame.frame.data().first_chunk() else { return };
        if let Some(Process::Haptic(haptic)) = Process::decode(Id::Haptic, payload) {
            let mode = Mode::from_codes(haptic.mode, haptic.fault);
            if mode == Some(Mode::Boot) && self.shown.mode != Some(Mode::Boot.name()) {
                // A new configuration: the counters of the device's frames begin anew.
                self.decoder = Decoder::new(*self.master.master());
            }
            self.shown.mode = Some(mode.map_or(NOT_CONFIGURED, Mode::name));
            self.fault = mode.and_then(Mode::fault);
            self.shown.fault = self.fault.map(|fault| fault.text());
        }
        let last = self.granted_ns.unwrap_or(0);
        if frame.at_ns.saturating_sub(last) > GRANTED_WITHIN_NS {
            self.granted_ns = None;
        }
        let answer = self.encoder_ns.map(|at_ns| frame.at_ns.saturating_sub(at_ns) as f64 * 1e-9);
        self.shown.answer_s = answer;
    }

    fn tick(&mut self, tick: &TickEstimate) {
        if let Some(tip_m) = tick.tip_from_entry_m {
            self.targets.tip(tip_m, tick.at_ns as f64 * 1e-9);
        }
        let shown = &mut self.shown;
        shown.ticks += 1;
        shown.unresolved_ticks += u64::from(tick.unresolved);
        shown.limited = tick.limited;
        shown.haptic_force_n = tick.haptic_force_n;
        shown.haptic_torque_n_m = tick.haptic_torque_n_m;
        // What comes in one tick of several stays until it comes again.
        shown.insertion_m = tick.insertion_m.or(shown.insertion_m);
        shown.rotation_rad = tick.rotation_rad.or(shown.rotation_rad);
        shown.force_n = tick.force_n.or(shown.force_n);
        shown.drive_force_n = tick.drive_force_n.or(shown.drive_force_n);
        shown.drive_torque_n_m = tick.drive_torque_n_m.or(shown.drive_torque_n_m);
        if tick.has_band {
            shown.force_half_width_n = tick.force_half_width_n;
            shown.drive_force_half_width_n = tick.drive_force_half_width_n;
        }
        if let Some(age_ticks) = tick.encoder_age_ticks {
            shown.age_in_device_s = age_s(age_ticks);
        }
        if let Some(wire) = tick.guidewire {
            let before = shown.guidewire.unwrap_or_default();
            shown.guidewire = Some(GuidewireEstimate {
                drive_force_n: wire.drive_force_n.or(before.drive_force_n),
                drive_torque_n_m: wire.drive_torque_n_m.or(before.drive_torque_n_m),
                encoder_age_ticks: wire.encoder_age_ticks.or(before.encoder_age_ticks),
                felt: wire.felt.or(before.felt),
                ..wire
            });
        }
        if let Some(force_n) = tick.force_n {
            self.history_peak_n = self.history_peak_n.max(size(force_n));
        }
        if tick.at_ns.saturating_sub(self.history_from_ns) >= HISTORY_EVERY_NS {
            self.history_from_ns = tick.at_ns;
            self.history.push_back(std::mem::take(&mut self.history_peak_n));
            if self.history.len() > HISTORY {
                self.history.pop_front();
            }
        }
    }
}

/// Euclidean norm.
pub(super) fn size(vector: [f32; 3]) -> f32 {
    vector.iter().map(|x| x * x).sum::<f32>().sqrt()
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use cathforce_bus::{Encoder, Insertion, Rotation, Sealer, Status};
    use cathforce_link::{Client, Sim, Step};
    use cathforce_recording::BusClock;
    use std::sync::{Arc, Mutex};

    use super::super::draw;
    use super::*;

    /// A device in this process, without a configuration, for two seconds of virtual time.
    fn of_sim() -> Monitor {
        let mut client = Client::connect(Sim::new()).unwrap();
        client.set_lock_step(true).unwrap();
        let frames = Arc::new(Mutex::new(Vec::new()));
        let (tapped, mut clock) = (Arc::clone(&frames), BusClock::new(true));
        client.set_tap(Some(Box::new(move |direction, frame, _| {
            let at_ns = clock.stamp(direction, frame);
            tapped.lock().unwrap().push(BusFrame { at_ns, direction, frame: *frame });
        })));
        let encoder =
            Encoder { insertion: Insertion::from_m(0.05), rotation: Rotation::from_rad(0.5) };
        let step = Step { encoder: Some(encoder), ..Step::default() };
        client.play((0..2000).map(|_| step), |_| ControlFlow::Continue(())).unwrap();
        client.set_tap(None);
        let mut frames = frames.lock().unwrap().clone();
        // Frames to the device run ahead of the answers.
        frames.sort_by_key(|frame| frame.at_ns);
        let mut monitor = Monitor::default();
        frames.iter().for_each(|frame| monitor.frame(frame));
        monitor
    }

    #[test]
    fn a_bus_is_summed_up() {
        let monitor = of_sim();
        let shown = monitor.shown();
        assert_eq!(shown.mode, Some("not configured"));
        assert!((1.99..=2.0).contains(&shown.seconds), "{}", shown.seconds);
        assert_eq!((shown.tick_hz, shown.encoder_hz), (1000, 1000));
        assert_eq!(shown.insertion_m, Some(0.05));
        // ENCODER and three frames a tick, as `check` counts them.
        assert!((shown.bus_load - 4.0 * 0.135).abs() < 0.01, "{}", shown.bus_load);
        assert!(shown.dropouts.is_empty());
        assert_eq!(monitor.history_mn().count(), 19);
    }

    #[test]
    fn silence_empties_the_window() {
        let mut monitor = of_sim();
        monitor.advance(4_000_000_000);
        let shown = monitor.shown();
        assert_eq!((shown.tick_hz, shown.bus_load), (0, 0.0));
        assert_eq!(shown.advice, None, "not of a recording");
    }

    #[test]
    fn whoever_watches_a_bus_is_told_what_to_do() {
        let link = Some("slcan:tcp:127.0.0.1:5555".to_owned());
        let mut monitor = Monitor { link: link.clone(), ..of_sim() };
        let advice = monitor.shown().advice.unwrap();
        assert!(advice.contains("cathforce run --link slcan:tcp:127.0.0.1:5555"), "{advice}");
        assert!(monitor.shown().lock_step);
        monitor.advance(4_000_000_000);
        let advice = monitor.shown().advice.unwrap();
        assert!(advice.contains("in lock step"), "{advice}");
        let mut silent = Monitor { link, ..Monitor::default() };
        assert_eq!(silent.shown().advice, None, "it has just begun");
        silent.advance(WINDOW_NS);
        let advice = silent.shown().advice.unwrap();
        assert!(advice.contains("Nothing is on the bus"), "{advice}");
    }

    #[test]
    fn a_lost_frame_is_shown() {
        let mut sealer = Sealer::default();
        let mut monitor = Monitor::default();
        for i in 0..4 {
            let contact = cathforce_bus::Contact { force: Default::default() };
            let frame = sealer.seal(Process::Contact(contact), Status::default());
            if i != 2 {
                monitor.frame(&BusFrame { at_ns: i, direction: Direction::ToHost, frame });
            }
        }
        assert_eq!(monitor.shown().dropouts, [(DropoutCause::Lost, 1)].into());
    }

    /// A device whose configuration is replaced has lost no frame.
    #[test]
    fn counters_that_begin_anew_are_no_loss() {
        let mut monitor = Monitor::default();
        let mut put = |sealer: &mut Sealer, mode: Mode| {
            let (force, torque) = (Default::default(), Default::default());
            let haptic = cathforce_bus::Haptic { force, torque, mode: mode.code(), fault: 0 };
            let frame = sealer.seal(Process::Haptic(haptic), Status::default());
            monitor.frame(&BusFrame { at_ns: 0, direction: Direction::ToHost, frame });
        };
        let mut before = Sealer::default();
        (0..7).for_each(|_| put(&mut before, Mode::Ready));
        let mut after = Sealer::default();
        (0..3).for_each(|_| put(&mut after, Mode::Boot));
        assert!(monitor.shown().dropouts.is_empty(), "{:?}", monitor.shown().dropouts);
    }

    #[test]
    fn everything_fits_into_a_terminal_of_80_by_24() {
        use ratatui::{Terminal, backend::TestBackend};
        let monitor = Monitor { link: Some("slcan:tcp:127.0.0.1:5555".into()), ..of_sim() };
        for (width, height) in [(80, 24), (30, 5), (1, 1)] {
            let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
            terminal.draw(|frame| draw(frame, "sim", &monitor, false)).unwrap();
            let text = terminal.backend().to_string();
            if width == 80 {
                for word in [
                    "sim",
                    "not configured",
                    "1000 Hz",
                    "50.00 mm",
                    "lock step",
                    "bus",
                    "cathforce run --link slcan:tcp:127.0.0.1:5555 BUNDLE",
                    "q quits",
                ] {
                    assert!(text.contains(word), "{word} in\n{text}");
                }
            }
        }
    }
}
