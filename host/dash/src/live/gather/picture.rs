//! The picture of the present as JSON.

use std::time::{Duration, Instant};

use axum::extract::ws::Utf8Bytes;
use cathforce_bus::Id;
use cathforce_control::{Fault, Mode};
use serde_json::{Value, json};

use super::{Gather, WINDOW};
use crate::live::record::Recording;
use crate::live::twin::Twin;

/// From one summary of the times to the next.
const SUMMARY: Duration = Duration::from_millis(500);

/// What every viewer gets.
#[derive(Clone, Debug, Default)]
pub struct Snapshot {
    /// The picture as JSON, written once for all viewers.
    pub text: Utf8Bytes,
    /// The same in short, for programs.
    pub state: Value,
}

impl Gather {
    /// Publishes a picture.
    pub(super) fn publish(&mut self) {
        let now = Instant::now();
        self.published_at = now;
        while self.recent.front().is_some_and(|(at, ..)| now.duration_since(*at) > WINDOW) {
            self.recent.pop_front();
        }
        if let Some(point) = self.point.take() {
            self.points += 1;
            self.history.push(self.points, point);
        }
        if let Some(at) = self.heard_at.filter(|_| self.ticks > self.published_ticks) {
            self.published_ticks = self.ticks;
            self.publishing.push(now.duration_since(at).as_secs_f64());
        }
        if now.duration_since(self.summed_up_at) >= SUMMARY {
            self.summed_up_at = now;
            let stages = [
                self.answer.stage(
                    "bus and tick",
                    "from the encoder's frame to the first frame of the tick that used it",
                ),
                self.in_device.stage("waiting in the device", "from the sample to its tick"),
                self.publishing.stage("gathering", "from the tick's frame to the picture of it"),
            ];
            self.stages = stages.into_iter().flatten().collect();
        }
        self.check_recording();
        self.sequence += 1;
        let picture = self.picture(now);
        let state = json!({
            "source": "link",
            "mode": picture["mode"],
            "armed": picture["armed"],
            "fault": picture["fault"],
            "tick": picture["tick"],
            "server_ms": picture["server_ms"],
            "sample_ms": picture["sample_ms"],
            "heard_ms": picture["heard_ms"],
            "forces": picture["forces"],
            "insertion_m": picture["insertion_m"],
            "rotation_rad": picture["rotation_rad"],
            "faults": picture["faults"],
            "bus_load": picture["bus_load"],
            "recording": picture["recording"],
            "lost": picture["lost"],
        });
        self.to.send_replace(Snapshot { text: picture.to_string().into(), state });
    }

    fn picture(&self, now: Instant) -> Value {
        let ms = |at: Instant| 1e3 * at.duration_since(self.started).as_secs_f64();
        let count = |wanted: Id| self.recent.iter().filter(|(.., id)| *id == Some(wanted)).count();
        let bits: u64 = self.recent.iter().map(|(_, bits, _)| u64::from(*bits)).sum();
        let mode = self.mode.map_or("not configured", Mode::name);
        let twin = self.twin.as_ref();
        let followed = twin.filter(|twin| {
            matches!(twin.mode(), Some(Mode::Ready | Mode::Armed | Mode::Ramp { .. }))
        });
        let nodes = followed.map(Twin::nodes).filter(|nodes| !nodes.is_empty());
        let from = if nodes.is_some() { "host" } else { "bus" };
        let nodes = nodes.unwrap_or_else(|| self.bus_nodes.clone());
        let rounded = |x: f32, unit: f32| (x / unit).round() as i32;
        json!({
            "sequence": self.sequence,
            "server_ms": ms(now),
            "sample_ms": self.sample_at.map(ms),
            "heard_ms": self.heard_at.map(ms),
            "mode": self.has_mode.then_some(mode),
            "armed": matches!(self.mode, Some(Mode::Armed)),
            "fault": self.mode.and_then(Mode::fault).map(Fault::name),
            "tick": self.heard_at.map(|_| self.next_tick.wrapping_sub(1)),
            "ticks": self.ticks,
            "tick_hz": count(Id::Haptic),
            "encoder_hz": count(Id::Encoder),
            "bus_load": bits as f64 / 1e6,
            "lock_step": self.granted_at.is_some(),
            "unresolved_ticks": self.unresolved_ticks,
            "limited": self.limited,
            "forces": self.forces,
            "band_N": self.band_n,
            "measured_N": self.measured(),
            "insertion_m": self.insertion_m,
            "rotation_rad": self.rotation_rad,
            "haptic_force_N": self.haptic[0],
            "haptic_torque_N_m": self.haptic[1],
            "points": self.history.latest(),
            "shape": {
                "from": from,
                // In 10 µm and 0.1 mN.
                "at": nodes.iter().flat_map(|(at, _)| at.map(|x| rounded(x, 1e-5))).collect::<Vec<_>>(),
                "force": nodes.iter().flat_map(|(_, f)| f.map(|x| rounded(x, 1e-4))).collect::<Vec<_>>(),
            },
            "twin": twin.map(|twin| json!({ "agreed": twin.agreed, "differed": twin.differed })),
            "faults": self.faults,
            "timing": {
                "stages": self.stages,
                "lost_ticks": self.lost_ticks,
                "load": self.load,
                "rejected_frames": self.rejected,
                "dropouts": self.dropouts,
            },
            "scene": self.scene,
            "recording": self.recording.as_ref().map(Recording::state),
            "playing": self.position.get().map(|(playing, _)| playing),
            "said": self.said,
            "lost": self.lost,
        })
    }
}
