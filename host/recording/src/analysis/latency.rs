//! Latencies between encoder and record, stage by stage.

use cathforce_bus::master::{Collector, Master};
use cathforce_bus::{Direction, Id, Process};
use cathforce_control::TICK_S;
use serde::Serialize;

use crate::format::frame::BusFrame;

/// Times of one stage \[s\].
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize)]
pub struct Spread {
    pub count: usize,
    pub p50_s: f64,
    pub p99_s: f64,
    pub p999_s: f64,
    pub max_s: f64,
}

impl Spread {
    /// Statistics of these times \[s\]; `None` if there are none.
    pub fn of(mut times_s: Vec<f64>) -> Option<Self> {
        times_s.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let rank = (share * times_s.len() as f64).ceil() as usize;
            times_s.get(rank.saturating_sub(1)).copied()
        };
        Some(Self {
            count: times_s.len(),
            p50_s: at(0.5)?,
            p99_s: at(0.99)?,
            p999_s: at(0.999)?,
            max_s: at(1.0)?,
        })
    }
}

/// One stage.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stage {
    pub name: &'static str,
    /// Its beginning and end, in words.
    pub what: &'static str,
    pub times: Spread,
}

/// Name of the stage that spans the others.
pub const END_TO_END: &str = "end to end";

/// The stages in order, over the time in which ticks had an encoder.
///
/// In lock step time is virtual and a tick takes none, so only ages are stated. Running free, times are
/// those at which this host sent and received frames. `arrived_ns`, `logged_ns`: for each frame, see
/// [`crate::Recording::arrived_ns`] and [`crate::Recording::logged_ns`]; the latter is empty while
/// nothing is recorded. `master`: layout of positions in the master's own frames.
pub fn stages(
    frames: &[BusFrame],
    arrived_ns: &[u64],
    logged_ns: &[u64],
    lock_step: bool,
    master: Master,
) -> Vec<Stage> {
    let mut samples = Samples { master: Collector::new(master), ..Samples::default() };
    for frame in frames {
        samples.take(frame);
    }
    // A stamp of the carrier never equals the time at which the host saw the frame, to the nanosecond.
    let is_stamped = |(frame, arrived_ns): &(&BusFrame, &u64)| frame.at_ns != **arrived_ns;
    let stamped = frames.iter().zip(arrived_ns).filter(is_stamped);
    let received = stamped.map(|(frame, arrived_ns)| span_s(*arrived_ns, frame.at_ns)).collect();
    let whole = frames.iter().zip(arrived_ns).zip(logged_ns);
    let whole = whole.filter(|(stamped, _)| is_stamped(stamped));
    let whole = whole.map(|((_, arrived_ns), logged_ns)| span_s(*arrived_ns, *logged_ns)).collect();
    let recorded = frames.iter().zip(logged_ns);
    let recorded = recorded.map(|(frame, logged_ns)| span_s(frame.at_ns, *logged_ns)).collect();
    let free = |times: Vec<f64>| if lock_step { Vec::new() } else { times };
    let stages = [
        ("encoder period", "from one encoder frame to the next", free(samples.period_s)),
        (
            "answer",
            "from the newest encoder frame to the tick's first frame",
            free(samples.answer_s),
        ),
        ("age in the device", "of the encoder sample that a tick used", samples.age_s),
        (
            END_TO_END,
            "from the encoder frame that a tick used to its first frame",
            free(samples.whole_s),
        ),
        ("tick period", "from one tick's first frame to the next", free(samples.tick_s)),
        ("tick's frames", "from a tick's first frame to its last", free(samples.frames_s)),
        (
            "reception",
            "from the kernel's stamp of a frame to this host's sight of it",
            free(received),
        ),
        ("record", "from this host's sight of a frame to its record", free(recorded)),
        ("frame to record", "from the kernel's stamp of a frame to its record", free(whole)),
    ];
    let stage = |(name, what, times)| Some(Stage { name, what, times: Spread::of(times)? });
    stages.into_iter().filter_map(stage).collect()
}

fn span_s(from_ns: u64, to_ns: u64) -> f64 {
    to_ns.saturating_sub(from_ns) as f64 * 1e-9
}

/// Age of an encoder sample \[s\] from the device's count of ticks; `None` before the first sample and
/// beyond the count's range.
pub fn age_s(ticks: u8) -> Option<f64> {
    (ticks < u8::MAX).then(|| f64::from(ticks) * f64::from(TICK_S))
}

#[derive(Default)]
struct Samples {
    master: Collector,
    encoder_ns: Option<u64>,
    haptic_ns: Option<u64>,
    last_frame_ns: u64,
    answer_now_s: Option<f64>,
    period_s: Vec<f64>,
    answer_s: Vec<f64>,
    age_s: Vec<f64>,
    whole_s: Vec<f64>,
    tick_s: Vec<f64>,
    frames_s: Vec<f64>,
}

impl Samples {
    /// Takes a complete position of the catheter's drive.
    fn encoder(&mut self, at_ns: u64) {
        let before = self.encoder_ns.replace(at_ns);
        self.period_s.extend(before.map(|before| span_s(before, at_ns)));
    }

    fn take(&mut self, frame: &BusFrame) {
        let at_ns = frame.at_ns;
        let from_host = frame.direction == Direction::ToDevice;
        if from_host && self.master.master().catheter.is_some() {
            self.master.take(&frame.frame);
            if self.master.catheter().is_some() {
                self.encoder(at_ns);
            }
        }
        let payload = frame.frame.data().first_chunk();
        let Some((id, &payload)) = Id::from_raw(frame.frame.id()).zip(payload) else { return };
        match Process::decode(id, payload) {
            Some(Process::Encoder(_)) if from_host && self.master.master().catheter.is_none() => {
                self.encoder(at_ns);
            }
            Some(Process::Haptic(_)) if !from_host => {
                if let Some(before) = self.haptic_ns.replace(at_ns) {
                    self.tick_s.push(span_s(before, at_ns));
                    self.frames_s.push(span_s(before, self.last_frame_ns));
                }
                self.answer_now_s = self.encoder_ns.map(|encoder| span_s(encoder, at_ns));
                self.answer_s.extend(self.answer_now_s);
            }
            Some(Process::Drive(drive)) if !from_host => {
                if let Some(age_s) = age_s(drive.encoder_age_ticks) {
                    self.age_s.push(age_s);
                    self.whole_s.extend(self.answer_now_s.map(|answer| answer + age_s));
                }
            }
            _ => {}
        }
        if !from_host {
            self.last_frame_ns = at_ns;
        }
    }
}

#[cfg(test)]
mod tests {
    use cathforce_bus::{
        Drive, DriveTorque, Encoder, Force, Haptic, HapticForce, HapticTorque, Insertion, Rotation,
        Sealer, Status,
    };

    use super::*;

    #[test]
    fn a_spread_is_of_times_that_were_there() {
        assert_eq!(Spread::of(Vec::new()), None);
        let spread = Spread::of((1..=1000).rev().map(f64::from).collect()).unwrap();
        let found = [spread.p50_s, spread.p99_s, spread.p999_s, spread.max_s];
        assert_eq!(found, [500.0, 990.0, 999.0, 1000.0]);
        let one = Spread::of(vec![2.0]).unwrap();
        assert_eq!((one.p50_s, one.max_s), (2.0, 2.0));
    }

    #[test]
    fn each_stage_is_measured_where_it_begins_and_ends() {
        let (mut host, mut device) = (Sealer::default(), Sealer::default());
        let mut frames = Vec::new();
        for tick in 0..10 {
            // Before the first sample there is no age.
            let encoder_age_ticks = if tick == 0 { u8::MAX } else { 2 };
            let us = |us: u64| 1000 * (1000 * (tick + 1) + us);
            let encoder =
                Encoder { insertion: Insertion::from_m(0.1), rotation: Rotation::from_rad(0.0) };
            let frame = host.seal(Process::Encoder(encoder), Status::default());
            frames.push(BusFrame { at_ns: us(0), direction: Direction::ToDevice, frame });
            let haptic =
                Haptic { force: HapticForce(0), torque: HapticTorque(0), mode: 4, fault: 0 };
            let drive =
                Drive { force: Force(0), torque: DriveTorque(0), limits: 0, encoder_age_ticks };
            for (at, process) in [(600, Process::Haptic(haptic)), (850, Process::Drive(drive))] {
                let frame = device.seal(process, Status::default());
                frames.push(BusFrame { at_ns: us(at), direction: Direction::ToHost, frame });
            }
        }
        let arrived_ns = frames.iter().map(|f| f.at_ns - 20_000).collect::<Vec<_>>();
        let logged_ns = frames.iter().map(|f| f.at_ns + 40_000).collect::<Vec<_>>();
        let found = stages(&frames, &arrived_ns, &logged_ns, false, Master::default());
        let expected_us = [1000.0, 600.0, 2000.0, 2600.0, 1000.0, 250.0, 20.0, 40.0, 60.0];
        assert_eq!(found.len(), expected_us.len());
        for (stage, us) in found.iter().zip(expected_us) {
            let times = stage.times;
            assert!(times.count >= 9, "{}: of {}", stage.name, times.count);
            for s in [times.p50_s, times.max_s] {
                assert!((1e6 * s - us).abs() < 0.01, "{}: {s}", stage.name);
            }
        }
        let virtual_time = stages(&frames, &arrived_ns, &logged_ns, true, Master::default());
        assert_eq!(virtual_time.iter().map(|s| s.name).collect::<Vec<_>>(), ["age in the device"]);
    }
}
