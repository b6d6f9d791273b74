//! Writes a recording.

use std::fs::{File, TryLockError};
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::time::{Duration, Instant};

use cathforce_bus::Direction;
use cathforce_config::image;
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, McapError, WriteOptions};

use crate::decoding::tick::{Completed, Decoder};
use crate::decoding::topics::{Channels, Published, Publisher};
use crate::format::dropout::Dropout;
use crate::format::frame::BusFrame;
use crate::format::info::{RunInfo, RunResult};
use crate::format::layout;
use crate::format::messages::{DropoutMessage, Message, TfMessage, to_cdr};
use crate::format::trial::Measured;

/// Attachments that make a recording stand alone.
#[derive(Clone, Copy, Debug)]
pub struct Attachments<'a> {
    /// The device image in use; its lumen is also attached separately.
    pub image: &'a [u8],
    pub rig_toml: &'a str,
    /// The bus description.
    pub dbc: &'a str,
    /// Files of the vessel by their names in a trial bundle ([`crate::VESSEL_FILES`]).
    pub vessel: &'a [(&'a str, &'a [u8])],
}

/// Why a recording cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write the recording {path}: {}; check the folder, free space and permissions", said(.cause))]
pub struct WriteError {
    path: String,
    #[source]
    cause: McapError,
}

/// The reason alone, for callers that name the file themselves.
impl From<WriteError> for io::Error {
    fn from(error: WriteError) -> Self {
        Self::other(said(&error.cause))
    }
}

/// The reason of an error; the library's own text leaves it out for file system errors.
fn said(cause: &McapError) -> String {
    match cause {
        McapError::Io(reason) => reason.to_string(),
        other => other.to_string(),
    }
}

/// Interval between flushes. A killed recorder may lose one second (P23); a process on a busy computer may
/// also have been paused before it was killed.
const FLUSH_EVERY: Duration = Duration::from_millis(200);
/// Chunks end with a flush; this only bounds memory.
const CHUNK_BYTES: u64 = 4 << 20;

type Sink = NoSeek<BufWriter<File>>;

/// Writes one recording.
///
/// Attachments and information come first. Frames are written in whole chunks every [`FLUSH_EVERY`], so the
/// file of a killed process can be read up to its last chunk. Dropping without [`Recorder::finish`] also
/// finishes, but cannot report an error.
pub struct Recorder {
    path: String,
    writer: mcap::Writer<Sink>,
    channels: Channels,
    publisher: Publisher,
    decoder: Decoder,
    frames: u32,
    flushed: Instant,
}

impl Recorder {
    /// Creates the file and writes everything that is known already. An existing file is an error and
    /// stays, because a recording cannot be repeated.
    pub fn create(
        path: &Path,
        info: &RunInfo,
        attachments: Attachments<'_>,
    ) -> Result<Self, WriteError> {
        let fail = |cause| WriteError { path: path.display().to_string(), cause };
        let (writer, channels) = open(path, info, attachments).map_err(fail)?;
        Ok(Self {
            path: path.display().to_string(),
            writer,
            channels,
            publisher: Publisher::default(),
            decoder: Decoder::new(image::master(attachments.image).unwrap_or_default()),
            frames: 0,
            flushed: Instant::now(),
        })
    }

    /// Takes the next frame of either direction whose arrival time is not known.
    ///
    /// `logged_ns`: when the recorder got it, on the clock of `frame.at_ns`.
    pub fn frame(&mut self, frame: &BusFrame, logged_ns: u64) -> Result<(), WriteError> {
        self.frame_that_arrived(frame, frame.at_ns, logged_ns)
    }

    /// The same for a frame that reached this computer at `arrived_ns`, on the same clock.
    pub fn frame_that_arrived(
        &mut self,
        frame: &BusFrame,
        arrived_ns: u64,
        logged_ns: u64,
    ) -> Result<(), WriteError> {
        let channel_id = match frame.direction {
            Direction::ToDevice => self.channels.to_device,
            Direction::ToHost => self.channels.to_host,
        };
        let header = MessageHeader {
            channel_id,
            sequence: self.frames,
            log_time: logged_ns,
            publish_time: frame.at_ns,
        };
        self.frames = self.frames.wrapping_add(1);
        self.put(&header, &frame.to_message(arrived_ns))?;
        let Completed { tick, nodes, missed } = self.decoder.push(frame);
        if let Some(tick) = tick {
            let published = self.publisher.tick(&tick, &self.channels);
            self.publish(published)?;
        }
        if let Some(pass) = nodes {
            let published = self.publisher.shape(&pass, &self.channels);
            self.publish(published)?;
        }
        if let Some(dropout) = missed {
            self.dropout(&dropout)?;
        }
        if self.flushed.elapsed() >= FLUSH_EVERY {
            self.flush()?;
        }
        Ok(())
    }

    /// Takes the row of the trial for this time of the bus.
    ///
    /// `shape_m`: the points of the shape, tip first; empty where it was not measured.
    pub fn measured(
        &mut self,
        at_ns: u64,
        row: &Measured,
        shape_m: &[[f64; 3]],
    ) -> Result<(), WriteError> {
        let published = self.publisher.measured(at_ns, row, shape_m, &self.channels);
        self.publish(published)
    }

    /// Records frames that the recorder never got.
    pub fn dropout(&mut self, dropout: &Dropout) -> Result<(), WriteError> {
        let message = DropoutMessage::of(dropout);
        self.put(&header(self.channels.dropouts, dropout.to_ns), &message)
    }

    /// Hands everything taken so far to the operating system.
    pub fn flush(&mut self) -> Result<(), WriteError> {
        self.flushed = Instant::now();
        let result = self.writer.flush();
        self.check(result)
    }

    /// Writes the last tick, the result if the run ended normally, and the index.
    pub fn finish(mut self, result: Option<&RunResult>) -> Result<(), WriteError> {
        if let Some(tick) = self.decoder.finish() {
            let published = self.publisher.tick(&tick, &self.channels);
            self.publish(published)?;
        }
        if let Some(result) = result {
            let metadata = Metadata { name: layout::RESULT.into(), metadata: result.to_map() };
            let result = self.writer.write_metadata(&metadata);
            self.check(result)?;
        }
        let result = self.writer.finish().map(drop);
        self.check(result)?;
        // The file is finished, so it is flushed directly and not through the library.
        let flushed = self.writer.into_inner().flush();
        flushed.map_err(|cause| WriteError { path: self.path, cause: McapError::Io(cause) })
    }

    fn publish(&mut self, published: Published) -> Result<(), WriteError> {
        let result = published.map_err(encoding).and_then(|messages| {
            messages.into_iter().try_for_each(|(channel_id, at_ns, bytes)| {
                self.writer.write_to_known_channel(&header(channel_id, at_ns), &bytes)
            })
        });
        self.check(result)
    }

    fn put(&mut self, header: &MessageHeader, message: &impl Message) -> Result<(), WriteError> {
        let result = to_cdr(message)
            .map_err(encoding)
            .and_then(|bytes| self.writer.write_to_known_channel(header, &bytes));
        self.check(result)
    }

    fn check<T>(&self, result: Result<T, McapError>) -> Result<T, WriteError> {
        result.map_err(|cause| WriteError { path: self.path.clone(), cause })
    }
}

fn encoding(error: cdr_encoding::Error) -> McapError {
    McapError::Io(io::Error::other(error))
}

fn header(channel_id: u16, at_ns: u64) -> MessageHeader {
    MessageHeader { channel_id, sequence: 0, log_time: at_ns, publish_time: at_ns }
}

/// Whether another command is recording into this file.
pub fn is_being_recorded(path: &Path) -> bool {
    let lock = File::open(path).map(|file| file.try_lock());
    matches!(lock, Ok(Err(TryLockError::WouldBlock)))
}

fn open(
    path: &Path,
    info: &RunInfo,
    attachments: Attachments<'_>,
) -> Result<(mcap::Writer<Sink>, Channels), McapError> {
    let file = File::create_new(path)?;
    // Another command can tell by it that this file is being written. Elsewhere a lock would keep readers
    // out, and a file system without locks is no reason not to record.
    #[cfg(unix)]
    let _ = file.try_lock();
    // Chunks are built in memory, so a killed process leaves only whole ones.
    let mut writer = WriteOptions::new()
        .compression(None)
        .chunk_size(Some(CHUNK_BYTES))
        .disable_seeking(true)
        .profile(layout::PROFILE)
        .library(concat!("cathforce ", env!("CARGO_PKG_VERSION")))
        .create(NoSeek::new(BufWriter::new(file)))?;
    writer.write_metadata(&Metadata { name: layout::INFO.into(), metadata: info.to_map() })?;
    // A device has accepted the image. If it cannot be read here, lumen and entry are left out.
    let config = image::decode(attachments.image).ok();
    let lumen_bytes = config.as_ref().map_or(0, |config| config.lumen.header().byte_len());
    let lumen_at = attachments.image.len().saturating_sub(lumen_bytes);
    let files = [
        (layout::IMAGE, attachments.image),
        (layout::RIG, attachments.rig_toml.as_bytes()),
        (layout::DBC, attachments.dbc.as_bytes()),
        (layout::LUMEN, attachments.image.get(lumen_at..).unwrap_or_default()),
    ];
    for &(name, data) in files.iter().chain(attachments.vessel) {
        writer.attach(&Attachment {
            log_time: 0,
            create_time: 0,
            name: name.into(),
            media_type: media_type(name).into(),
            data: data.into(),
        })?;
    }
    let channels = Channels::add_to(&mut writer)?;
    if let Some(config) = config {
        let entry_m = config.model.description().entry.position_m.map(f64::from);
        let bytes = to_cdr(&TfMessage::entry(entry_m)).map_err(encoding)?;
        writer.write_to_known_channel(&header(channels.transforms, 0), &bytes)?;
    }
    writer.flush()?;
    Ok((writer, channels))
}

fn media_type(name: &str) -> &'static str {
    match name.rsplit_once('.').map(|(_, ending)| ending) {
        Some("toml") => "application/toml",
        Some("csv") => "text/csv",
        Some("dbc") => "text/plain",
        Some("stl") => "model/stl",
        _ => "application/octet-stream",
    }
}
