//! Reads a recording.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Read as _};
use std::ops::Range;
use std::path::{Path, PathBuf};

use cathforce_bus::Direction;
use cathforce_bus::master::Master;
use cathforce_config::image;
use cathforce_mechanics::MAX_TENDONS;
use mcap::records::{MessageHeader, Record};

use crate::format::dropout::{Dropout, DropoutCause};
use crate::format::frame::BusFrame;
use crate::format::info::{FORMAT, RunInfo, RunResult};
use crate::format::layout;
use crate::format::messages::{CanFrame, DropoutMessage, MeasuredRow, from_cdr};
use crate::format::trial::{Measured, MeasuredDrive, Trial};
use crate::import::is_trial;

/// Whether a file begins like a recording, complete or not; `false` if it cannot be read.
pub fn is_recording(path: &Path) -> bool {
    let mut head = [0; mcap::MAGIC.len()];
    let read = fs::File::open(path).and_then(|mut file| file.read_exact(&mut head));
    read.is_ok() && head == mcap::MAGIC
}

/// The content of a recording, without anything derived.
#[derive(Clone, Debug)]
pub struct Recording {
    pub info: RunInfo,
    /// The device image that was in use.
    pub image: Vec<u8>,
    pub rig_toml: String,
    /// The bus description.
    pub dbc: String,
    /// Files of the vessel by their names in a trial bundle.
    pub vessel: Vec<(String, Vec<u8>)>,
    /// Every frame, in the order in which it crossed the bus.
    pub frames: Vec<BusFrame>,
    /// When each frame reached the host's computer, on the same clock \[ns\]; without a stamp of the
    /// carrier, the time of the frame.
    pub arrived_ns: Vec<u64>,
    /// When the recorder got each frame, on the same clock \[ns\].
    pub logged_ns: Vec<u64>,
    /// Missing frames, in the order in which they were noticed.
    pub dropouts: Vec<Dropout>,
    /// The trial that was played, with its measurements.
    pub trial: Trial,
    /// Time on the bus at which the trial's time is zero \[ns\].
    pub trial_start_ns: Option<u64>,
    /// What the device reported at the end, if the run ended normally.
    pub result: Option<RunResult>,
    /// Where the file breaks off, if it was not finished.
    pub cut: Option<Cut>,
}

/// Where a recorder was killed; everything before is complete.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cut {
    /// First byte that does not belong to a complete record.
    pub byte: usize,
}

/// Why a file is no usable recording.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    #[error("cannot read {}: {source}; give a recording made by `cathforce run`", path.display())]
    Io { path: PathBuf, source: io::Error },
    #[error(
        "{}: byte 0: not an MCAP file, it begins with {found}; {fix}",
        path.display()
    )]
    NotMcap { path: PathBuf, found: String, fix: &'static str },
    #[error(
        "{}: byte {byte}: {cause}; the file is damaged, copy it again or record anew",
        path.display()
    )]
    Damaged { path: PathBuf, byte: usize, cause: String },
    #[error(
        "{}: an MCAP file, but {missing}; give a recording made by `cathforce run`",
        path.display()
    )]
    NotOurs { path: PathBuf, missing: String },
    #[error(
        "{}: breaks off at byte {byte}, before the {missing}: nothing of the run is in it; copy it \
         again or record anew",
        path.display()
    )]
    CutTooEarly { path: PathBuf, byte: usize, missing: String },
}

impl Recording {
    /// Layout of the drives' positions in the frames to the device.
    pub fn master(&self) -> Master {
        // An unreadable image is refused where it is needed; here it means the default layout.
        image::master(&self.image).unwrap_or_default()
    }

    /// Whether the recording is complete, in words.
    pub fn completeness(&self) -> String {
        match self.cut {
            Some(cut) => format!("no: it breaks off at byte {}", cut.byte),
            None if self.result.is_none() => "no: the run broke off".into(),
            None => "yes".into(),
        }
    }

    /// Reads the file whole.
    ///
    /// A file that breaks off because its recorder was killed is read up to there, see
    /// [`Recording::cut`]. A file with any other fault is refused.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let bytes = fs::read(path).map_err(|source| ReadError::Io { path: path.into(), source })?;
        let mut parts = Parts::default();
        let cut = scan(path, &bytes, &mut parts)?;
        let missing = |what: &str| match cut {
            Some(Cut { byte }) => {
                ReadError::CutTooEarly { path: path.into(), byte, missing: what.into() }
            }
            None => ReadError::NotOurs { path: path.into(), missing: format!("it has no {what}") },
        };
        let info = parts.info.ok_or_else(|| missing("`cathforce` metadata"))?;
        Ok(Self {
            image: parts.image.ok_or_else(|| missing("attached device image"))?,
            rig_toml: parts.rig_toml.ok_or_else(|| missing("attached rig.toml"))?,
            dbc: parts.dbc,
            vessel: parts.vessel,
            frames: parts.frames,
            arrived_ns: parts.arrived_ns,
            logged_ns: parts.logged_ns,
            dropouts: parts.dropouts,
            trial: Trial { rows: parts.rows, shapes_m: parts.shapes_m, noise: info.noise },
            trial_start_ns: parts.trial_start_ns,
            result: parts.result,
            cut,
            info,
        })
    }
}

/// The parts found so far.
#[derive(Default)]
struct Parts {
    info: Option<RunInfo>,
    result: Option<RunResult>,
    image: Option<Vec<u8>>,
    rig_toml: Option<String>,
    dbc: String,
    vessel: Vec<(String, Vec<u8>)>,
    frames: Vec<BusFrame>,
    arrived_ns: Vec<u64>,
    logged_ns: Vec<u64>,
    dropouts: Vec<Dropout>,
    rows: Vec<Measured>,
    shapes_m: Vec<Vec<[f64; 3]>>,
    trial_start_ns: Option<u64>,
    channels: BTreeMap<u16, Content>,
}

/// Kinds of channels that are read back.
#[derive(Clone, Copy)]
enum Content {
    Frames(Direction),
    Measured,
    Dropouts,
}

const OPCODE_ATTACHMENT: u8 = 0x09;
/// Opcode and length of a record.
const HEAD_BYTES: usize = 9;

/// Advice for a file that is no recording.
fn instead_of(bytes: &[u8]) -> &'static str {
    let text = std::str::from_utf8(bytes).unwrap_or_default();
    let heading = text.lines().find(|line| !line.trim().is_empty()).unwrap_or_default();
    if is_trial(text) {
        "this is a trial: give the folder of its bundle, which holds rig.toml, or a recording made by \
         `cathforce run`"
    } else if text.contains("trial-bundle/") {
        "this is the rig.toml of a bundle: give its folder, or a recording made by `cathforce run`"
    } else if heading.contains([',', ';', '\t']) {
        "this is a table: `cathforce import csv` makes a trial of it, for the folder trials of a \
         bundle; or give a recording made by `cathforce run`"
    } else {
        "give a recording made by `cathforce run`"
    }
}

/// Walks over the records of a file; returns where it breaks off, if it does.
///
/// The envelope of a record (opcode, length, body) is parsed here and not by the library, so that every
/// fault can be reported with its byte.
fn scan(path: &Path, bytes: &[u8], parts: &mut Parts) -> Result<Option<Cut>, ReadError> {
    let Some(mut rest) = bytes.strip_prefix(mcap::MAGIC) else {
        let found = bytes.iter().take(8).map(|b| format!("{b:02x}")).collect::<Vec<_>>().join(" ");
        let found = if found.is_empty() { "nothing".to_owned() } else { found };
        return Err(ReadError::NotMcap { path: path.into(), found, fix: instead_of(bytes) });
    };
    let position = |rest: &[u8]| bytes.len() - rest.len();
    loop {
        let byte = position(rest);
        let damaged = |cause: String| ReadError::Damaged { path: path.into(), byte, cause };
        if rest == mcap::MAGIC {
            return Ok(None);
        }
        let Some((opcode, body)) = split_record(rest) else {
            return Ok(Some(Cut { byte }));
        };
        rest = &rest[HEAD_BYTES + body.len()..];
        if opcode == OPCODE_ATTACHMENT && !attachment_fits(body) {
            return Err(damaged("an attachment is shorter than its own header".to_owned()));
        }
        let record = mcap::parse_record(opcode, body).map_err(|e| damaged(e.to_string()))?;
        match record {
            Record::Chunk { header, data } => {
                let records = mcap::read::ChunkReader::new(header, &data)
                    .map_err(|e| damaged(e.to_string()))?;
                for record in records {
                    let record = record.map_err(|e| damaged(format!("in this chunk: {e}")))?;
                    parts.take(record).map_err(|e| damaged(format!("in this chunk: {e}")))?;
                }
            }
            record => parts.take(record).map_err(damaged)?,
        }
    }
}

/// Opcode and body of the first record, if it is complete.
fn split_record(bytes: &[u8]) -> Option<(u8, &[u8])> {
    let (&opcode, rest) = bytes.split_first()?;
    let (length, rest) = rest.split_first_chunk()?;
    let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
    Some((opcode, rest.get(..length)?))
}

/// Whether an attachment's lengths fit; the library's parser does not check it.
fn attachment_fits(body: &[u8]) -> bool {
    const TIMES: usize = 16;
    const DATA_LENGTH_AND_CRC: usize = 12;
    let after_string = |at: usize| {
        let length = body.get(at..)?.first_chunk()?;
        at.checked_add(4)?.checked_add(usize::try_from(u32::from_le_bytes(*length)).ok()?)
    };
    let strings: Option<Range<usize>> =
        after_string(TIMES).and_then(after_string).map(|end| TIMES..end);
    strings.is_some_and(|s| body.len() >= s.end.saturating_add(DATA_LENGTH_AND_CRC))
}

impl Parts {
    fn take(&mut self, record: Record<'_>) -> Result<(), String> {
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
                self.info = Some(RunInfo::from_map(&metadata.metadata)?);
            }
            Record::Metadata(metadata) if metadata.name == layout::RESULT => {
                self.result = Some(RunResult::from_map(&metadata.metadata)?);
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
            Record::Message { header, data } => self.message(&header, &data)?,
            _ => {}
        }
        Ok(())
    }

    fn message(&mut self, header: &MessageHeader, data: &[u8]) -> Result<(), String> {
        match self.channels.get(&header.channel_id) {
            Some(&Content::Frames(direction)) => self.frame(header, direction, data),
            Some(Content::Measured) => self.measured(header, data),
            Some(Content::Dropouts) => self.dropout(data),
            None => Ok(()),
        }
    }

    fn frame(
        &mut self,
        header: &MessageHeader,
        direction: Direction,
        data: &[u8],
    ) -> Result<(), String> {
        let expected = self.frames.len() as u32;
        if header.sequence != expected {
            return Err(format!("frame {expected} is missing, {} follows", header.sequence));
        }
        let message = from_cdr::<CanFrame>(data);
        let (frame, arrived_ns) = message
            .and_then(|message| {
                let at_ns = header.publish_time;
                Ok((BusFrame::from_message(at_ns, direction, &message)?, message.header.ns()))
            })
            .map_err(|e| format!("frame {expected}: {e}"))?;
        self.frames.push(frame);
        self.arrived_ns.push(arrived_ns);
        self.logged_ns.push(header.log_time);
        Ok(())
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
        let id = u16::try_from(message.id).ok().filter(|&id| id != 0);
        let (from_ns, frames) = (message.from_ns, message.frames);
        self.dropouts.push(Dropout { from_ns, to_ns: message.header.ns(), cause, id, frames });
        Ok(())
    }
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
    Ok((row, points.to_vec()))
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
