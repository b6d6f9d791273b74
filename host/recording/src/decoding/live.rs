//! The topics of a recording as a stream: the messages that a recorder would write, as they come about.

use cathforce_bus::Direction;
use cathforce_bus::master::Master;
use cathforce_config::image;

use super::tick::{Completed, Decoder};
use super::topics::{Channels, Published, Publisher};
use crate::format::frame::BusFrame;
use crate::format::layout;
use crate::format::messages::{DropoutMessage, TfMessage, to_cdr};
use crate::format::trial::Measured;

/// Encoding of every message.
pub const MESSAGE_ENCODING: &str = layout::MESSAGE_ENCODING;
/// Encoding of every schema.
pub const SCHEMA_ENCODING: &str = layout::SCHEMA_ENCODING;

/// A topic and the type of its messages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    pub name: &'static str,
    pub message_type: &'static str,
    pub schema: String,
}

/// A message of [`Topics::all`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TopicMessage {
    /// Place of its topic in [`Topics::all`].
    pub topic: usize,
    /// Time of the frame that completed it \[ns\].
    pub at_ns: u64,
    pub bytes: Vec<u8>,
}

/// A quantity has no representation in the encoding of messages.
#[derive(Debug, thiserror::Error)]
#[error("cannot encode a message: {0}")]
pub struct TopicError(#[from] cdr_encoding::Error);

/// Makes the messages of a recording from the frames of a bus.
pub struct Topics {
    all: Vec<Topic>,
    channels: Channels,
    publisher: Publisher,
    decoder: Decoder,
    entry_m: Option<[f64; 3]>,
}

impl Default for Topics {
    fn default() -> Self {
        let mut all = Vec::new();
        let added: Result<_, std::convert::Infallible> =
            Channels::add(|name, message_type, schema| {
                all.push(Topic { name, message_type, schema });
                // There are fewer topics than numbers.
                Ok((all.len() - 1) as u16)
            });
        let Ok(channels) = added;
        let (publisher, decoder) = Default::default();
        Self { all, channels, publisher, decoder, entry_m: None }
    }
}

impl Topics {
    /// Every topic of a recording.
    pub fn all(&self) -> &[Topic] {
        &self.all
    }

    /// The device uses this image from now on; ticks are counted anew.
    pub fn begin(&mut self, image: &[u8]) {
        self.begin_with(image::master(image).unwrap_or_default());
        // An image that this program cannot read has no entry that it knows.
        let config = image::decode(image).ok();
        self.entry_m =
            config.map(|config| config.model.description().entry.position_m.map(f64::from));
    }

    /// The same where only the layout of a master's own frames is known.
    pub fn begin_with(&mut self, master: Master) {
        self.decoder = Decoder::new(master);
        self.publisher = Publisher::default();
        self.entry_m = None;
    }

    /// Takes the next frame; gives the messages that it completed.
    ///
    /// `arrived_ns`: when it reached this computer, on the clock of `frame.at_ns`.
    pub fn frame(
        &mut self,
        frame: &BusFrame,
        arrived_ns: u64,
    ) -> Result<Vec<TopicMessage>, TopicError> {
        let channel = match frame.direction {
            Direction::ToDevice => self.channels.to_device,
            Direction::ToHost => self.channels.to_host,
        };
        let mut out = vec![(channel, frame.at_ns, to_cdr(&frame.to_message(arrived_ns))?)];
        let Completed { tick, nodes, missed } = self.decoder.push(frame);
        if let Some(tick) = tick {
            out.extend(self.publisher.tick(&tick, &self.channels)?);
        }
        if let Some(pass) = nodes {
            out.extend(self.publisher.shape(&pass, &self.channels)?);
        }
        if let Some(dropout) = missed {
            let bytes = to_cdr(&DropoutMessage::of(&dropout))?;
            out.push((self.channels.dropouts, dropout.to_ns, bytes));
        }
        numbered(Ok(out))
    }

    /// Takes a frame and gives nothing: what comes later counts it.
    pub fn pass_over(&mut self, frame: &BusFrame) {
        if let Some(tick) = self.decoder.push(frame).tick {
            self.publisher.pass_over(&tick);
        }
    }

    /// The row of the trial for this time, see [`crate::Recorder::measured`].
    pub fn measured(
        &self,
        at_ns: u64,
        row: &Measured,
        shape_m: &[[f64; 3]],
    ) -> Result<Vec<TopicMessage>, TopicError> {
        numbered(self.publisher.measured(at_ns, row, shape_m, &self.channels))
    }

    /// What somebody who joins late must be told again: where the entry is, and with the next tick the
    /// state of the device. A file says both once.
    pub fn again(&mut self, at_ns: u64) -> Result<Vec<TopicMessage>, TopicError> {
        self.publisher.say_mode_again();
        let Some(entry_m) = self.entry_m else { return Ok(Vec::new()) };
        let bytes = to_cdr(&TfMessage::entry(entry_m))?;
        numbered(Ok(vec![(self.channels.transforms, at_ns, bytes)]))
    }
}

fn numbered(published: Published) -> Result<Vec<TopicMessage>, TopicError> {
    let message =
        |(channel, at_ns, bytes)| TopicMessage { topic: usize::from(channel), at_ns, bytes };
    Ok(published?.into_iter().map(message).collect())
}
