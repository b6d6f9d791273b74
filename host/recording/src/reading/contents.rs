//! What a recording's records hold.

use std::collections::BTreeMap;

use cathforce_bus::Direction;
use cathforce_mechanics::MAX_TENDONS;
use mcap::records::{MessageHeader, Metadata, Record};

use crate::container::{Container, Damage};
use crate::format::dropout::{Dropout, DropoutCause};
use crate::format::frame::BusFrame;
use crate::format::info::{CHECKSUM, FORMAT, RunInfo, RunResult, checksum_of};
use crate::format::layout;
use crate::format::messages::{CanFrame, DropoutMessage, MeasuredRow, from_cdr};
use crate::format::trial::{Measured, MeasuredDrive};

/// The parts of a recording.
#[derive(Default)]
pub(super) struct Contents {
    pub(super) info: Option<RunInfo>,
    pub(super) result: Option<RunResult>,
    pub(super) image: Option<Vec<u8>>,
    pub(super) rig_toml: Option<String>,
    pub(super) dbc: String,
    pub(super) vessel: Vec<(String, Vec<u8>)>,
    pub(super) frames: Vec<BusFrame>,
    pub(super) arrived_ns: Vec<u64>,
    pub(super) logged_ns: Vec<u64>,
    pub(super) dropouts: Vec<Dropout>,
    pub(super) rows: Vec<Measured>,
    pub(super) shapes_m: Vec<Vec<[f64; 3]>>,
    pub(super) trial_start_ns: Option<u64>,
    pub(super) damage: Vec<Damage>,
    /// Frames with their places in the order of the bus.
    stamped: Vec<Stamped>,
    channels: BTreeMap<u16, Content>,
    /// Messages of each channel, by the file's own count.
    counts: BTreeMap<u16, u64>,
}

/// A frame and its place.
struct Stamped {
    sequence: u32,
    /// Where its section begins.
    byte: usize,
    frame: BusFrame,
    arrived_ns: u64,
    logged_ns: u64,
}

/// Kinds of channels that are read back.
#[derive(Clone, Copy, PartialEq)]
enum Content {
    Frames(Direction),
    Measured,
    Dropouts,
}

/// Why nothing is used, and the byte of the record.
pub(super) struct Wrong {
    pub(super) byte: usize,
    pub(super) cause: String,
}

impl Contents {
    pub(super) fn read(container: &Container<'_>) -> Result<Self, Wrong> {
        let mut found = Self { damage: container.damage.clone(), ..Self::default() };
        // Channels come first: a chunk that describes one may be damaged, and the index describes all.
        let mut unprotected = Vec::new();
        for section in &container.sections {
            let wrong = |cause: String| Wrong {
                byte: section.byte,
                cause: in_section(section.is_chunk, cause),
            };
            for record in section.records() {
                let record = record.map_err(wrong)?;
                if let Record::Metadata(metadata) = &record {
                    let is_own = [layout::INFO, layout::RESULT].contains(&metadata.name.as_str());
                    if !is_own || !metadata.metadata.contains_key(CHECKSUM) {
                        unprotected.push((section.byte, metadata.name.clone()));
                    }
                }
                found.take(section.byte, record).map_err(wrong)?;
            }
        }
        for section in &container.sections {
            let wrong = |cause: String| Wrong {
                byte: section.byte,
                cause: in_section(section.is_chunk, cause),
            };
            for record in section.records() {
                if let Record::Message { header, data } = record.map_err(wrong)? {
                    found.message(section.byte, &header, &data).map_err(wrong)?;
                }
            }
        }
        if container.data_differs && container.damage.is_empty() {
            found.note_differing_data(&unprotected)?;
        }
        found.put_in_order()?;
        Ok(found)
    }

    /// The checksum over all data does not match, while those of all chunks and attachments do.
    fn note_differing_data(&mut self, unprotected: &[(usize, String)]) -> Result<(), Wrong> {
        let all = "the checksum over the whole data does not match, while those of chunks and attachments do";
        if let Some((byte, name)) = unprotected.first() {
            let name = name.escape_debug();
            let cause = format!("{all}: the metadata `{name}` cannot be trusted");
            return Err(Wrong { byte: *byte, cause });
        }
        let what = format!(
            "{all}: a record without a checksum of its own (header or message index) is damaged"
        );
        self.damage.push(Damage { byte: mcap::MAGIC.len(), what });
        Ok(())
    }

    /// Takes a record that is no message.
    fn take(&mut self, byte: usize, record: Record<'_>) -> Result<(), String> {
        match record {
            Record::Metadata(metadata) if metadata.name == layout::INFO => {
                match metadata.metadata.get("format") {
                    Some(format) if format == FORMAT => {}
                    other => {
                        let other = other.map_or("no format", String::as_str);
                        return Err(format!(
                            "the recording has {other}, this version reads {FORMAT}; use the \
                             version of cathforce that recorded it"
                        ));
                    }
                }
                if !is_whole(&metadata) {
                    return Err("the metadata `cathforce` does not match its checksum".into());
                }
                self.info = Some(RunInfo::from_map(&metadata.metadata)?);
            }
            Record::Metadata(metadata) if metadata.name == layout::RESULT => {
                if is_whole(&metadata) {
                    self.result = Some(RunResult::from_map(&metadata.metadata)?);
                } else {
                    let what =
                        "the metadata `cathforce.result` does not match its checksum".to_owned();
                    self.damage.push(Damage { byte, what });
                }
            }
            Record::Attachment { header, data, .. } => match header.name.as_str() {
                layout::IMAGE => self.image = Some(data.into_owned()),
                layout::RIG => self.rig_toml = Some(text(layout::RIG, data.into_owned())?),
                layout::DBC => self.dbc = text(layout::DBC, data.into_owned())?,
                name if layout::VESSEL_FILES.contains(&name) => {
                    self.vessel.push((name.to_owned(), data.into_owned()));
                }
                _ => {}
            },
            Record::Channel(channel) => {
                let content = match channel.topic.as_str() {
                    layout::TO_DEVICE => Content::Frames(Direction::ToDevice),
                    layout::TO_HOST => Content::Frames(Direction::ToHost),
                    layout::MEASURED => Content::Measured,
                    layout::DROPOUTS => Content::Dropouts,
                    _ => return Ok(()),
                };
                self.channels.insert(channel.id, content);
            }
            Record::Statistics(statistics) => self.counts = statistics.channel_message_counts,
            _ => {}
        }
        Ok(())
    }

    fn message(&mut self, byte: usize, header: &MessageHeader, data: &[u8]) -> Result<(), String> {
        match self.channels.get(&header.channel_id) {
            Some(&Content::Frames(direction)) => self.frame(byte, header, direction, data),
            Some(Content::Measured) => self.measured(header, data),
            Some(Content::Dropouts) => self.dropout(data),
            None => Ok(()),
        }
    }

    fn frame(
        &mut self,
        byte: usize,
        header: &MessageHeader,
        direction: Direction,
        data: &[u8],
    ) -> Result<(), String> {
        let sequence = header.sequence;
        let message = from_cdr::<CanFrame>(data);
        let (frame, arrived_ns) = message
            .and_then(|message| {
                let at_ns = header.publish_time;
                Ok((BusFrame::from_message(at_ns, direction, &message)?, message.header.ns()))
            })
            .map_err(|e| format!("frame {sequence}: {e}"))?;
        let logged_ns = header.log_time;
        self.stamped.push(Stamped { sequence, byte, frame, arrived_ns, logged_ns });
        Ok(())
    }

    /// Puts the frames in the order of the bus, which other tools may have changed, and notes those that
    /// are missing: without a damaged chunk none may be.
    fn put_in_order(&mut self) -> Result<(), Wrong> {
        self.stamped.sort_by_key(|stamped| stamped.sequence);
        let mut expected = 0_u32;
        for stamped in std::mem::take(&mut self.stamped) {
            let Stamped { sequence, byte, frame, arrived_ns, logged_ns } = stamped;
            if sequence < expected {
                return Err(Wrong { byte, cause: format!("frame {sequence} is there twice") });
            }
            if sequence > expected && self.damage.is_empty() {
                let cause = format!("frame {expected} is missing, {sequence} follows");
                return Err(Wrong { byte, cause });
            }
            self.missing(sequence - expected, Some(frame.at_ns));
            expected = sequence.saturating_add(1);
            self.frames.push(frame);
            self.arrived_ns.push(arrived_ns);
            self.logged_ns.push(logged_ns);
        }
        if !self.damage.is_empty() {
            let frames = self.counted(|content| matches!(content, Content::Frames(_)));
            let at_end = frames.saturating_sub(u64::from(expected));
            self.missing(u32::try_from(at_end).unwrap_or(u32::MAX), None);
            let rows = self.counted(|content| content == Content::Measured);
            let lost = rows.saturating_sub(self.rows.len() as u64);
            if lost > 0 {
                let byte = self.damage.first().map_or(0, |damage| damage.byte);
                let what = format!("{lost} of {rows} measured rows were in it");
                self.damage.push(Damage { byte, what });
            }
        }
        Ok(())
    }

    /// Notes frames of a damaged chunk after the last one so far.
    fn missing(&mut self, frames: u32, next_ns: Option<u64>) {
        if frames == 0 {
            return;
        }
        let before_ns = self.frames.last().map(|frame| frame.at_ns);
        let from_ns = before_ns.or(next_ns).unwrap_or_default();
        let to_ns = next_ns.unwrap_or(from_ns);
        let cause = DropoutCause::DamagedFile;
        self.dropouts.push(Dropout { from_ns, to_ns, cause, id: None, frames });
    }

    /// Messages of a kind, by the file's own count.
    fn counted(&self, is_meant: impl Fn(Content) -> bool) -> u64 {
        let own = self.channels.iter().filter(|(_, content)| is_meant(**content));
        own.filter_map(|(id, _)| self.counts.get(id)).sum()
    }

    fn measured(&mut self, header: &MessageHeader, data: &[u8]) -> Result<(), String> {
        let (row, shape_m) = from_cdr::<MeasuredRow>(data)
            .and_then(|message| measured_row(&message))
            .map_err(|e| format!("measured row {}: {e}", self.rows.len()))?;
        let t_ns = (row.t_s * 1e9).round() as u64;
        self.trial_start_ns.get_or_insert(header.log_time.saturating_sub(t_ns));
        self.rows.push(row);
        self.shapes_m.push(shape_m);
        Ok(())
    }

    fn dropout(&mut self, data: &[u8]) -> Result<(), String> {
        let message = from_cdr::<DropoutMessage>(data)
            .map_err(|e| format!("dropout {}: {e}", self.dropouts.len()))?;
        let cause = DropoutCause::from_name(&message.cause)
            .ok_or_else(|| format!("a dropout has no known cause: {}", message.cause))?;
        let id = Some(message.id).filter(|&id| id != 0);
        let (from_ns, frames) = (message.from_ns, message.frames);
        self.dropouts.push(Dropout { from_ns, to_ns: message.header.ns(), cause, id, frames });
        Ok(())
    }
}

/// Whether metadata match their checksum; those of earlier versions have none.
fn is_whole(metadata: &Metadata) -> bool {
    let stated = metadata.metadata.get(CHECKSUM);
    stated.is_none_or(|stated| *stated == checksum_of(&metadata.metadata))
}

fn in_section(is_chunk: bool, cause: String) -> String {
    if is_chunk { format!("in this chunk: {cause}") } else { cause }
}

fn text(name: &str, bytes: Vec<u8>) -> Result<String, String> {
    String::from_utf8(bytes).map_err(|e| format!("{name}: {e}"))
}

fn measured_row(message: &MeasuredRow) -> Result<(Measured, Vec<[f64; 3]>), String> {
    let force_n = values("force_n", &message.force_n)?;
    let tip_m = values("tip_m", &message.tip_m)?;
    let [drive_force_n, wire_force_n] = [
        ("drive_force_n", &message.drive_force_n),
        ("guidewire_force_n", &message.guidewire_force_n),
    ]
    .map(|(name, column)| values(name, column));
    let wire_force_n = wire_force_n?.map(|[force_n]: [f64; 1]| force_n);
    let wire: Option<[f64; 2]> = values("guidewire", &message.guidewire)?;
    let (points, []) = message.shape_m.as_chunks() else {
        return Err("shape_m is not three numbers a point".into());
    };
    if message.tendons_m.len() > MAX_TENDONS {
        let found = message.tendons_m.len();
        return Err(format!("tendons_m has {found} numbers, and there are {MAX_TENDONS} at most"));
    }
    let row = Measured {
        t_s: message.t_s,
        insertion_m: message.insertion_m,
        rotation_rad: message.rotation_rad,
        force_n,
        drive_force_n: drive_force_n?.map(|[force_n]: [f64; 1]| force_n),
        tip_m,
        guidewire: wire.map(|[insertion_m, rotation_rad]| MeasuredDrive {
            insertion_m,
            rotation_rad,
            drive_force_n: wire_force_n,
        }),
        tendons_m: std::array::from_fn(|k| message.tendons_m.get(k).copied()),
    };
    check_numbers(message)?;
    Ok((row, points.to_vec()))
}

/// Refuses numbers that a trial of a bundle could not have either.
fn check_numbers(message: &MeasuredRow) -> Result<(), String> {
    const LATEST_S: f64 = 1e10;
    if !message.t_s.is_finite() || message.t_s.abs() > LATEST_S {
        return Err(format!("t_s is {}, beyond the time of any clock", message.t_s));
    }
    let encoders = [message.insertion_m, message.rotation_rad];
    let columns = [
        &encoders[..],
        &message.force_n,
        &message.drive_force_n,
        &message.tip_m,
        &message.shape_m,
        &message.guidewire,
        &message.guidewire_force_n,
        &message.tendons_m,
    ];
    match columns.into_iter().flatten().find(|x| !x.is_finite()) {
        Some(x) => Err(format!("it has the number {x}")),
        None => Ok(()),
    }
}

/// A channel of `N` numbers; `None` where it was not measured.
fn values<const N: usize>(name: &str, found: &[f64]) -> Result<Option<[f64; N]>, String> {
    match found {
        [] => Ok(None),
        found => found
            .try_into()
            .map(Some)
            .map_err(|_| format!("{name} has {} numbers, not {N} or none", found.len())),
    }
}
