//! Counts, rates and gaps of a recording's frames.

use std::collections::BTreeMap;

use cathforce_bus::{Direction, Id, IdDigits, Process};
use cathforce_control::TICK_S;
use serde::Serialize;

use super::reader::Recording;
use crate::format::dropout::{Dropout, DropoutCause};
use crate::format::frame::BusFrame;

/// Figures of a recording that need no replay.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Survey {
    /// Time from the first frame to the last \[s\].
    pub seconds: f64,
    pub frames: usize,
    pub measured_rows: usize,
    /// Ticks with a HAPTIC frame.
    pub ticks: u64,
    /// Ticks that the device counted but that have no frame here.
    pub ticks_missing: u64,
    /// Load of a bus of 1 Mbit/s, see [`bus_load`].
    pub bus_load: Option<f64>,
    /// Counts by identifier.
    pub ids: Vec<IdCount>,
    /// Missing frames by cause.
    pub dropouts: Vec<DropoutCount>,
    /// Longest time between two ticks \[s\]; `None` in lock step.
    pub longest_tick_gap_s: Option<f64>,
}

/// Frames of one kind; SHAPE and FORCE of all nodes count as one kind each.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IdCount {
    pub name: String,
    pub frames: u64,
    pub rate_hz: Option<f64>,
}

/// Frames that are missing for one cause.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DropoutCount {
    pub cause: DropoutCause,
    pub frames: u64,
    pub times: u64,
    /// Time of the bus \[s\].
    pub first_s: f64,
    pub last_s: f64,
    pub meaning: &'static str,
}

/// Surveys a recording.
pub fn survey(recording: &Recording) -> Survey {
    let frames = &recording.frames;
    let ends = frames.first().zip(frames.last());
    let seconds = ends.map_or(0.0, |(a, b)| b.at_ns.saturating_sub(a.at_ns) as f64 * 1e-9);
    let mut ids = BTreeMap::new();
    for frame in frames {
        *ids.entry(name(frame)).or_insert(0_u64) += 1;
    }
    let rate = |frames: u64| (seconds > 0.0).then(|| frames as f64 / seconds);
    let ids = ids.into_iter();
    let ids = ids.map(|(name, frames)| IdCount { name, frames, rate_hz: rate(frames) }).collect();
    let (ticks, ticks_missing) = ticks(frames);
    Survey {
        seconds,
        frames: frames.len(),
        measured_rows: recording.trial.rows.len(),
        ticks,
        ticks_missing,
        bus_load: bus_load(frames),
        ids,
        dropouts: by_cause(&recording.dropouts),
        longest_tick_gap_s: (!recording.info.lock_step).then(|| longest_gap_s(frames)).flatten(),
    }
}

impl Survey {
    /// Frames that are missing or could not be used, whatever the cause.
    pub fn frames_missing(&self) -> u64 {
        self.dropouts.iter().map(|d| d.frames).sum()
    }
}

/// The name of a frame's kind, as in `cathforce.dbc` but for the nodes' numbers.
pub fn name(frame: &BusFrame) -> String {
    match Id::from_raw(frame.frame.id()) {
        Some(Id::Shape(_)) => "SHAPE".into(),
        Some(Id::Force(_)) => "FORCE".into(),
        Some(id) => format!("{id:?}").to_uppercase(),
        None => IdDigits(frame.frame.id()).to_string(),
    }
}

fn haptic(frame: &BusFrame) -> bool {
    frame.direction == Direction::ToHost && Id::from_raw(frame.frame.id()) == Some(Id::Haptic)
}

/// Number of ticks seen, and how many more the device counted between its first and last TICK frame.
fn ticks(frames: &[BusFrame]) -> (u64, u64) {
    let (mut seen, mut missing) = (0_u64, 0_u64);
    // Number of the last TICK frame, and the ticks seen up to it.
    let mut last: Option<(u16, u64)> = None;
    for frame in frames.iter().filter(|f| f.direction == Direction::ToHost) {
        seen += u64::from(haptic(frame));
        let id = Id::from_raw(frame.frame.id());
        let payload = frame.frame.data().first_chunk();
        let Some((id, &payload)) = id.zip(payload) else { continue };
        if let Some(Process::Tick(tick)) = Process::decode(id, payload) {
            if let Some((before, seen_before)) = last {
                let counted = u64::from(tick.tick.wrapping_sub(before));
                missing += counted.saturating_sub(seen - seen_before);
            }
            last = Some((tick.tick, seen));
        }
    }
    (seen, missing)
}

fn longest_gap_s(frames: &[BusFrame]) -> Option<f64> {
    let mut before = None;
    let mut longest = None;
    for at_ns in frames.iter().filter(|f| haptic(f)).map(|f| f.at_ns) {
        let gap = before.replace(at_ns).map(|before: u64| at_ns.saturating_sub(before));
        longest = longest.max(gap);
    }
    longest.map(|gap_ns: u64| gap_ns as f64 * 1e-9)
}

fn by_cause(dropouts: &[Dropout]) -> Vec<DropoutCount> {
    let mut counts: BTreeMap<DropoutCause, DropoutCount> = BTreeMap::new();
    for dropout in dropouts {
        let [first_s, last_s] = [dropout.from_ns, dropout.to_ns].map(|ns| ns as f64 * 1e-9);
        let cause = dropout.cause;
        let count = counts.entry(cause).or_insert(DropoutCount {
            cause,
            frames: 0,
            times: 0,
            first_s,
            last_s,
            meaning: cause.text(),
        });
        count.frames += u64::from(dropout.frames);
        count.times += 1;
        count.last_s = last_s;
    }
    counts.into_values().collect()
}

/// Share of a bus of 1 Mbit/s that the frames take, each at its greatest length; `None` without a tick.
///
/// Frames of the master and of others count too. SYNC, which a real device does not need, and service
/// frames do not.
pub fn bus_load(frames: &[BusFrame]) -> Option<f64> {
    const BITS_A_TICK: f64 = 1e6 * TICK_S as f64;
    let is_left_out = |frame: &&BusFrame| {
        let id = Id::from_raw(frame.frame.id());
        matches!(id, Some(Id::Sync | Id::ServiceRequest | Id::ServiceResponse))
    };
    let counted = frames.iter().filter(|frame| !is_left_out(frame));
    let bits: f64 = counted.map(|frame| f64::from(frame.frame.most_bits())).sum();
    let ticks = frames.iter().filter(|frame| haptic(frame)).count();
    (ticks > 0).then(|| bits / (ticks as f64 * BITS_A_TICK))
}

#[cfg(test)]
mod tests {
    use cathforce_bus::{Haptic, HapticForce, HapticTorque, Sealer, Status, Tick};

    use super::*;

    /// Ticks from `first` on, each with a TICK frame every fifth.
    fn stream(ticks: u16, first: u16) -> Vec<BusFrame> {
        let mut sealer = Sealer::default();
        let mut frames = Vec::new();
        for i in 0..ticks {
            let tick = first.wrapping_add(i);
            let mut push = |process| {
                let frame = sealer.seal(process, Status::default());
                let at_ns = u64::from(i) * 1_000_000;
                frames.push(BusFrame { at_ns, direction: Direction::ToHost, frame });
            };
            let (force, torque) = (HapticForce(0), HapticTorque(0));
            push(Process::Haptic(Haptic { force, torque, mode: 4, fault: 0 }));
            if i % 5 == 0 {
                push(Process::Tick(Tick { tick, digest: 0 }));
            }
        }
        frames
    }

    #[test]
    fn missing_ticks_are_counted_by_the_devices_own_numbers() {
        let whole = stream(41, 65_520);
        assert_eq!(ticks(&whole), (41, 0), "the number has 16 bits");
        let mut holes = whole.clone();
        holes.retain(|f| !(f.at_ns >= 11_000_000 && f.at_ns < 31_000_000));
        assert_eq!(ticks(&holes), (21, 20));
        assert_eq!(longest_gap_s(&whole), Some(1e-3));
        assert_eq!(longest_gap_s(&holes), Some(21e-3));
    }

    #[test]
    fn dropouts_are_gathered_by_cause() {
        let dropout = |at_s: u64, cause, frames| {
            let at_ns = at_s * 1_000_000_000;
            Dropout { from_ns: at_ns, to_ns: at_ns, cause, id: None, frames }
        };
        let counts = by_cause(&[
            dropout(1, DropoutCause::Corrupt, 1),
            dropout(2, DropoutCause::Lost, 3),
            dropout(4, DropoutCause::Lost, 2),
        ]);
        let lost = &counts[0];
        assert_eq!((lost.cause, lost.frames, lost.times), (DropoutCause::Lost, 5, 2));
        assert_eq!((lost.first_s, lost.last_s), (2.0, 4.0));
        assert_eq!(counts[1].cause, DropoutCause::Corrupt);
    }
}
