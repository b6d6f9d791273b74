//! Replays frames through the same tick on the host and compares bit by bit.
//!
//! The device image comes from the recording, frames to the device go into a
//! [`ControlLoop`] in their recorded order, SYNC frames grant its ticks, and every frame that it
//! sends is compared with the frame that the device sent in its place. TICK frames carry a digest over the
//! bits of every output of every tick, nodes included. Where digests agree, outputs agree that the bus is
//! too slow to carry.

use cathforce_bus::master::Collector;
use cathforce_bus::{Direction, Encoder, Frame, Id, IdDigits, Process};
use cathforce_config::image::{self, ImageError};
use cathforce_control::{Config, HapticSource, Outputs};
use cathforce_device::ControlLoop;
use serde::Serialize;

use crate::decoding::tick::{
    GuidewireEstimate, NodeEstimate, NodePass, TendonReadings, TickEstimate, coded, note_tendons,
};
use crate::format::dropout::DropoutCause;
use crate::format::frame::BusFrame;
use crate::reading::reader::Recording;

/// Ticks between two shapes of a [`Track`].
const SHAPE_EVERY: u64 = 40;

/// Why a recording cannot be replayed.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    #[error(
        "the device image in the recording is refused: {0}; replay with the version of \
         cathforce that recorded it"
    )]
    Image(ImageError),
    #[error(
        "recorded without lock step, so it is not known which tick took which frame; replay \
         needs a recording of a board in lock step"
    )]
    FreeRunning,
    #[error(
        "frames were in a part of the file that is damaged (byte {byte}), and a replay needs every \
         frame; copy the file again from where it was recorded"
    )]
    Damaged { byte: usize },
}

/// The first place where device and host differ.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// Counted from the device's configuration.
    pub tick: u64,
    /// Frame and byte that differ, for example `HAPTIC byte 0`.
    pub field: String,
    /// The recorded frame in candump's notation.
    pub recorded: String,
    /// The replayed frame in candump's notation.
    pub replayed: String,
}

/// Result of a bit-by-bit comparison.
#[derive(Clone, Debug, PartialEq, Eq, Default, Serialize)]
pub struct ReplayReport {
    /// Ticks replayed.
    pub ticks: u64,
    pub frames_compared: u64,
    /// Number of differing bits in identifiers, lengths and data of all frames.
    pub differing_bits: u64,
    pub first_difference: Option<Difference>,
    /// Frames that the host sent and the recording lacks.
    pub missing_frames: u64,
    /// Frames that the recording has and the host did not send.
    pub extra_frames: u64,
    /// Rolling hash over every output of every tick, on the host.
    pub digest: u32,
    /// The device's digest at the end of the run, if it ended normally.
    pub device_digest: Option<u32>,
    /// The recording or its run breaks off: frames may be missing at its end.
    pub cut: bool,
}

/// Tensions of the tendons at their drives \[N\].
fn tensions_n(model: &cathforce_mechanics::State<f32>, tendons: usize) -> TendonReadings {
    let at_drive = |i: usize| model.tendon_tensions_n(i).map(|[at_drive, _]| at_drive);
    std::array::from_fn(|i| at_drive(i).filter(|_| i < tendons))
}

impl ReplayReport {
    /// Whether no bit differs and no frame is missing, except at the end of a recording that breaks off.
    pub fn identical(&self) -> bool {
        self.differing_bits == 0
            && self.device_digest.is_none_or(|digest| digest == self.digest)
            && self.extra_frames == 0
            && (self.missing_frames == 0 || self.cut)
            && self.frames_compared > 0
    }
}

/// All quantities of every tick, also those that the bus carries only in turns.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Track {
    pub ticks: Vec<TickEstimate>,
    /// All nodes at once, 25 times a second.
    pub shapes: Vec<NodePass>,
}

/// Replays a recording.
pub fn replay(recording: &Recording) -> Result<(ReplayReport, Track), ReplayError> {
    if !recording.info.lock_step {
        return Err(ReplayError::FreeRunning);
    }
    let is_damaged = recording.dropouts.iter().any(|lost| lost.cause == DropoutCause::DamagedFile);
    if let Some(first) = recording.damage.first().filter(|_| is_damaged) {
        return Err(ReplayError::Damaged { byte: first.byte });
    }
    let config = image::decode(&recording.image).map_err(ReplayError::Image)?;
    let mut sent = recording.frames.iter().filter(|f| is_process(f, Direction::ToHost));
    // When a link is lost, the answers of ticks under way are lost too.
    let cut = recording.cut.is_some() || recording.result.is_none();
    let master = image::master(&recording.image).map_err(ReplayError::Image)?;
    let mut replay = Replay {
        report: ReplayReport { cut, ..ReplayReport::default() },
        track: Track::default(),
        ticker: ControlLoop::new(),
        master: Collector::new(master),
        encoder: None,
        guidewire: None,
        tendons_m: TendonReadings::default(),
    };
    // A new ticker is not armed, so this cannot fail.
    let _ = replay.ticker.set_lock_step(true);
    replay.ticker.restart(master);
    for frame in recording.frames.iter().filter(|f| is_process(f, Direction::ToDevice)) {
        replay.ticker.on_frame(&frame.frame);
        replay.note_encoders(&frame.frame);
        while replay.ticker.granted() > 0 {
            replay.tick(&config, &mut sent);
        }
    }
    replay.report.extra_frames = sent.count() as u64;
    let result = recording.result.filter(|r| u64::from(r.ticks) == replay.report.ticks);
    replay.report.device_digest = result.map(|r| r.digest);
    Ok((replay.report, replay.track))
}

fn is_process(frame: &BusFrame, direction: Direction) -> bool {
    let service = [Id::ServiceRequest.raw(), Id::ServiceResponse.raw()];
    frame.direction == direction && !service.contains(&frame.frame.id())
}

struct Replay {
    report: ReplayReport,
    track: Track,
    ticker: ControlLoop,
    master: Collector,
    encoder: Option<Encoder>,
    guidewire: Option<Encoder>,
    tendons_m: TendonReadings,
}

impl Replay {
    fn note_encoders(&mut self, frame: &Frame) {
        self.master.take(frame);
        self.encoder = self.master.catheter().map(coded).or(self.encoder);
        self.guidewire = self.master.guidewire().map(coded).or(self.guidewire);
        let (Some(id), Some(&payload)) = (Id::from_raw(frame.id()), frame.data().first_chunk())
        else {
            return;
        };
        match Process::decode(id, payload) {
            Some(Process::Encoder(at)) if self.master.master().catheter.is_none() => {
                self.encoder = Some(at);
            }
            Some(Process::Guidewire(at)) if self.master.master().guidewire.is_none() => {
                self.guidewire = Some(at);
            }
            Some(Process::Tendons(frame)) => note_tendons(&mut self.tendons_m, &frame),
            _ => {}
        }
    }

    fn tick<'r>(&mut self, config: &Config<'_>, sent: &mut impl Iterator<Item = &'r BusFrame>) {
        let frames = self.ticker.tick(Some(config), None);
        let tick = self.report.ticks;
        self.report.ticks += 1;
        let mut at_ns = None;
        for frame in frames.into_iter().flatten() {
            match sent.next() {
                Some(recorded) => {
                    at_ns.get_or_insert(recorded.at_ns);
                    self.report.compare(tick, &recorded.frame, &frame);
                }
                None => self.report.missing_frames += 1,
            }
        }
        if let (Some(at_ns), Some(outputs)) = (at_ns, self.ticker.outputs().copied()) {
            self.report.digest = outputs.digest;
            self.record(at_ns, tick, &outputs, config);
        }
    }

    fn record(&mut self, at_ns: u64, tick: u64, outputs: &Outputs, config: &Config<'_>) {
        let entry_m = config.model.description().entry.position_m;
        let model = self.ticker.state().mechanics();
        let from_entry = |x: [f32; 3]| std::array::from_fn(|k| x[k] - entry_m[k]);
        let contact = &outputs.contact;
        self.track.ticks.push(TickEstimate {
            at_ns,
            tick,
            insertion_m: self.encoder.map(|at| at.insertion.m()),
            rotation_rad: self.encoder.map(|at| at.rotation.rad()),
            mode: outputs.mode.code(),
            fault: outputs.fault.map_or(0, |fault| fault.code()),
            unresolved: contact.unresolved,
            limited: !outputs.limited.is_empty(),
            haptic_force_n: outputs.force_n,
            haptic_torque_n_m: outputs.torque_n_m,
            force_n: Some(contact.force_on_vessel_n),
            drive_force_n: Some(contact.drive_force_n),
            drive_torque_n_m: Some(contact.drive_torque_n_m),
            has_band: config.band.is_some(),
            force_half_width_n: outputs.band.force_n,
            drive_force_half_width_n: outputs.band.drive_force_n,
            encoder_age_ticks: Some(outputs.encoder_age_ticks),
            moment_n_m: Some(contact.moment_on_vessel_n_m),
            guidewire: self.guidewire.map(|at| GuidewireEstimate {
                drive_force_n: Some(contact.guidewire_force_n),
                drive_torque_n_m: Some(contact.guidewire_torque_n_m),
                encoder_age_ticks: Some(outputs.guidewire_age_ticks),
                felt: Some(outputs.haptic_source == HapticSource::Guidewire),
                ..GuidewireEstimate::at(at)
            }),
            tendons_m: self.tendons_m,
            tendon_tensions_n: tensions_n(model, config.model.description().tendons.len()),
            digest: Some(outputs.digest),
            peak_contact_force_n: Some(contact.peak_contact_force_n),
            peak_node: Some(contact.peak_node),
            tip_from_entry_m: model.node_position_m(0).map(from_entry),
        });
        if tick.is_multiple_of(SHAPE_EVERY) {
            let nodes = (0..model.nodes())
                .filter_map(|node| {
                    Some(NodeEstimate {
                        node: u8::try_from(node).ok()?,
                        position_m: from_entry(model.node_position_m(node)?),
                        force_n: model.node_force_n(node)?,
                    })
                })
                .collect();
            self.track.shapes.push(NodePass { at_ns, nodes });
        }
    }
}

impl ReplayReport {
    fn compare(&mut self, tick: u64, recorded: &Frame, replayed: &Frame) {
        self.frames_compared += 1;
        let bits = differing_bits(recorded, replayed);
        self.differing_bits += bits;
        if bits > 0 && self.first_difference.is_none() {
            self.first_difference = Some(Difference {
                tick,
                field: field(recorded, replayed),
                recorded: recorded.to_string(),
                replayed: replayed.to_string(),
            });
        }
    }
}

/// Identifier, length and data as one block of bits.
fn block(frame: &Frame) -> [u8; 13] {
    let mut block = [0; 13];
    let data = frame.data();
    block[..4].copy_from_slice(&frame.id().to_le_bytes());
    block[4] = data.len() as u8;
    block[5..5 + data.len()].copy_from_slice(data);
    block
}

fn differing_bits(a: &Frame, b: &Frame) -> u64 {
    let pairs = block(a).into_iter().zip(block(b));
    pairs.map(|(x, y)| u64::from((x ^ y).count_ones())).sum()
}

/// Name of the first byte that differs.
fn field(recorded: &Frame, replayed: &Frame) -> String {
    if recorded.id() != replayed.id() {
        let [was, is] = [recorded, replayed].map(|frame| IdDigits(frame.id()));
        return format!("identifier, {was} for {is}");
    }
    let name = Id::from_raw(recorded.id()).map_or("?".to_owned(), |id| format!("{id:?}"));
    let (a, b) = (block(recorded), block(replayed));
    match (4..13).find(|&i| a[i] != b[i]) {
        Some(4) | None => format!("{name} length"),
        Some(i) => format!("{name} byte {}", i - 5),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(id: u32, data: &[u8]) -> Frame {
        Frame::new(id, data).unwrap()
    }

    #[test]
    fn every_bit_of_a_frame_counts() {
        let a = frame(0x180, &[0; 8]);
        assert_eq!(differing_bits(&a, &a), 0);
        assert_eq!(differing_bits(&a, &frame(0x180, &[0, 0, 3, 0, 0, 0, 0, 1])), 3);
        assert_eq!(differing_bits(&a, &frame(0x190, &[0; 8])), 1);
        assert_eq!(differing_bits(&a, &frame(0x180, &[0; 7])), 4);
    }

    #[test]
    fn the_first_difference_is_kept_and_named() {
        let mut report = ReplayReport::default();
        let a = frame(0x180, &[0; 8]);
        report.compare(6, &a, &a);
        assert!(report.identical());
        report.compare(7, &a, &frame(0x180, &[0, 0, 1, 0, 0, 0, 0, 0]));
        report.compare(8, &a, &frame(0x190, &[0; 8]));
        assert!(!report.identical());
        let first = report.first_difference.unwrap();
        assert_eq!((first.tick, first.field.as_str()), (7, "Haptic byte 2"));
        assert_eq!(first.recorded, "180#0000000000000000");
        assert_eq!(report.frames_compared, 3);
        assert_eq!(report.differing_bits, 2);
    }

    #[test]
    fn nothing_compared_is_not_identical() {
        assert!(!ReplayReport::default().identical());
        let extra = ReplayReport { extra_frames: 1, frames_compared: 1, ..Default::default() };
        assert!(!extra.identical());
    }
}
