//! Writing a recording.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::time::{Duration, Instant};

use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, McapError, WriteOptions};
use serde::Serialize;

use crate::frame::BusFrame;
use crate::info::{RunInfo, RunResult};
use crate::layout;
use crate::tick::{Completed, Decoder};
use crate::trial::Measured;

/// What is kept beside the frames so that a recording stands alone.
#[derive(Clone, Copy, Debug)]
pub struct Attachments<'a> {
    /// The device image that was in use.
    pub image: &'a [u8],
    pub rig_toml: &'a str,
    /// Meaning of every frame.
    pub dbc: &'a str,
}

/// A recording cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write the recording {path}: {}; check the folder, free space and permissions", said(.cause))]
pub struct WriteError {
    path: String,
    #[source]
    cause: McapError,
}

/// The library names an error of the file system without its reason.
fn said(cause: &McapError) -> String {
    match cause {
        McapError::Io(reason) => reason.to_string(),
        other => other.to_string(),
    }
}

/// At most this much is lost when the process is killed.
const FLUSH_EVERY: Duration = Duration::from_millis(500);
/// A chunk ends with the flush; this only bounds memory.
const CHUNK_BYTES: u64 = 4 << 20;

type Sink = NoSeek<BufWriter<File>>;

/// Writes one recording.
///
/// Attachments and information come first. Frames go out in whole chunks at least every half
/// second: what a killed process leaves behind can be read up to its last chunk. Dropping
/// without [`Recorder::finish`] finishes too, but cannot report an error.
pub struct Recorder {
    path: String,
    writer: mcap::Writer<Sink>,
    channels: Channels,
    decoder: Decoder,
    frames: u32,
    flushed: Instant,
}

/// Numbers of the channels in the file.
struct Channels {
    frames: u16,
    measured: u16,
    estimate: u16,
    nodes: u16,
}

impl Recorder {
    /// Creates the file, replacing an old one, and writes everything that is known already.
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
            decoder: Decoder::default(),
            frames: 0,
            flushed: Instant::now(),
        })
    }

    /// Takes the next frame of the bus, either direction.
    pub fn frame(&mut self, frame: &BusFrame) -> Result<(), WriteError> {
        let header = MessageHeader {
            channel_id: self.channels.frames,
            sequence: self.frames,
            log_time: frame.at_ns,
            publish_time: frame.at_ns,
        };
        self.frames = self.frames.wrapping_add(1);
        let result = self.writer.write_to_known_channel(&header, &frame.to_bytes());
        self.check(result)?;
        let Completed { tick, nodes } = self.decoder.push(frame);
        if let Some(tick) = tick {
            self.json(self.channels.estimate, tick.at_ns, &tick)?;
        }
        if let Some(pass) = nodes {
            self.json(self.channels.nodes, pass.at_ns, &pass)?;
        }
        if self.flushed.elapsed() >= FLUSH_EVERY {
            self.flush()?;
        }
        Ok(())
    }

    /// Takes the row of the trial that holds at this time of the bus.
    pub fn measured(&mut self, at_ns: u64, row: &Measured) -> Result<(), WriteError> {
        self.json(self.channels.measured, at_ns, row)
    }

    /// Hands everything taken so far to the operating system.
    pub fn flush(&mut self) -> Result<(), WriteError> {
        self.flushed = Instant::now();
        let result = self.writer.flush();
        self.check(result)
    }

    /// Writes the last tick, the result if the run came to its end, and the index.
    pub fn finish(mut self, result: Option<&RunResult>) -> Result<(), WriteError> {
        if let Some(tick) = self.decoder.finish() {
            self.json(self.channels.estimate, tick.at_ns, &tick)?;
        }
        if let Some(result) = result {
            let metadata = Metadata { name: layout::RESULT.into(), metadata: result.to_map() };
            let result = self.writer.write_metadata(&metadata);
            self.check(result)?;
        }
        let result = self.writer.finish().map(drop);
        self.check(result)?;
        // The library's own flush is for files that go on.
        let flushed = self.writer.into_inner().flush();
        flushed.map_err(|cause| WriteError { path: self.path, cause: McapError::Io(cause) })
    }

    fn json(
        &mut self,
        channel_id: u16,
        at_ns: u64,
        value: &impl Serialize,
    ) -> Result<(), WriteError> {
        let header =
            MessageHeader { channel_id, sequence: 0, log_time: at_ns, publish_time: at_ns };
        let result = serde_json::to_vec(value)
            .map_err(|e| McapError::Io(io::Error::other(e)))
            .and_then(|bytes| self.writer.write_to_known_channel(&header, &bytes));
        self.check(result)
    }

    fn check<T>(&self, result: Result<T, McapError>) -> Result<T, WriteError> {
        result.map_err(|cause| WriteError { path: self.path.clone(), cause })
    }
}

fn open(
    path: &Path,
    info: &RunInfo,
    attachments: Attachments<'_>,
) -> Result<(mcap::Writer<Sink>, Channels), McapError> {
    // Chunks are built in memory: a killed process leaves whole ones behind.
    let mut writer = WriteOptions::new()
        .compression(None)
        .chunk_size(Some(CHUNK_BYTES))
        .disable_seeking(true)
        .library(concat!("cathforce ", env!("CARGO_PKG_VERSION")))
        .create(NoSeek::new(BufWriter::new(File::create(path)?)))?;
    writer.write_metadata(&Metadata { name: layout::INFO.into(), metadata: info.to_map() })?;
    let files = [
        (layout::IMAGE, "application/octet-stream", attachments.image),
        (layout::RIG, "application/toml", attachments.rig_toml.as_bytes()),
        (layout::DBC, "text/plain", attachments.dbc.as_bytes()),
    ];
    for (name, media_type, data) in files {
        writer.attach(&Attachment {
            log_time: 0,
            create_time: 0,
            name: name.into(),
            media_type: media_type.into(),
            data: data.into(),
        })?;
    }
    let meaning = [("layout".to_owned(), layout::FRAMES_LAYOUT.to_owned())].into();
    let frames = writer.add_channel(0, layout::FRAMES_TOPIC, layout::FRAMES_ENCODING, &meaning)?;
    let mut json = |topic, (name, schema): (&str, &str)| {
        let schema = writer.add_schema(name, "jsonschema", schema.as_bytes())?;
        writer.add_channel(schema, topic, "json", &Default::default())
    };
    let measured = json(layout::MEASURED_TOPIC, layout::MEASURED_SCHEMA)?;
    let estimate = json(layout::ESTIMATE_TOPIC, layout::ESTIMATE_SCHEMA)?;
    let nodes = json(layout::NODES_TOPIC, layout::NODES_SCHEMA)?;
    writer.flush()?;
    Ok((writer, Channels { frames, measured, estimate, nodes }))
}
