//! The topics and messages of a bag: MCAP or SQLite, as rosbag2 writes them.

use std::collections::HashMap;
use std::io::Read as _;

use mcap::records::Record;

use super::error::RosError;
use super::sqlite::{self, Database, Value};
use crate::container::Container;

const ZSTD: [u8; 4] = [0x28, 0xB5, 0x2F, 0xFD];
const ROS_1: &[u8] = b"#ROSBAG V2.0";
/// Largest file or message that is unpacked \[bytes\].
const LARGEST: u64 = 4 << 30;

/// A file of a bag.
pub struct RosFile {
    pub name: String,
    pub bytes: Vec<u8>,
}

/// A topic and its type.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Topic {
    pub(super) name: String,
    pub(super) kind: String,
    /// How its messages are coded; only `cdr` is read.
    pub(super) encoding: String,
    /// Messages of it.
    pub(super) count: u64,
}

/// A message of a wanted topic.
pub(super) struct Stored {
    pub(super) topic: usize,
    /// When the recorder received it \[ns since 1970\].
    pub(super) logged_ns: i64,
    pub(super) data: Vec<u8>,
}

/// A bag with the messages of some of its topics.
#[derive(Default)]
pub(super) struct Bag {
    pub(super) formats: Vec<&'static str>,
    pub(super) topics: Vec<Topic>,
    pub(super) messages: Vec<Stored>,
    /// What is damaged and was left out.
    pub(super) remarks: Vec<String>,
}

impl Bag {
    /// Reads the files of one bag, with the messages of the topics that `is_wanted`.
    pub(super) fn read(
        files: &[RosFile],
        is_wanted: &dyn Fn(&Topic) -> bool,
    ) -> Result<Self, RosError> {
        let mut bag = Self::default();
        for file in files {
            let wrong = |problem: String| {
                let fix = "copy it again; `ros2 bag reindex` mends a bag whose recorder was killed";
                RosError::new(format!("{}: {problem}", file.name), fix)
            };
            let unpacked;
            let bytes = match file.bytes.starts_with(&ZSTD) {
                true => {
                    unpacked = unpacked_zstd(&file.bytes).map_err(wrong)?;
                    &unpacked[..]
                }
                false => &file.bytes[..],
            };
            let format = if bytes.starts_with(mcap::MAGIC) {
                bag.take_mcap(&file.name, bytes, is_wanted).map_err(wrong)?;
                "MCAP"
            } else if bytes.starts_with(sqlite::MAGIC) {
                bag.take_sqlite(bytes, is_wanted).map_err(wrong)?;
                "SQLite"
            } else if bytes.starts_with(ROS_1) {
                let problem = format!("{}: this is a bag of ROS 1", file.name);
                let fix = "convert it: `pip install rosbags`, then `rosbags-convert --src in.bag --dst out`";
                return Err(RosError::new(problem, fix));
            } else {
                let problem =
                    format!("{}: this is no bag of ROS 2: neither MCAP nor SQLite", file.name);
                return Err(RosError::new(
                    problem,
                    "give the .mcap or .db3 file, or the bag's folder",
                ));
            };
            if !bag.formats.contains(&format) {
                bag.formats.push(format);
            }
        }
        Ok(bag)
    }

    /// The number of a topic, which is new if no earlier file has it.
    fn topic(&mut self, name: &str, kind: &str, encoding: &str) -> usize {
        let is_same = |topic: &Topic| (topic.name.as_str(), topic.kind.as_str()) == (name, kind);
        self.topics.iter().position(is_same).unwrap_or_else(|| {
            let [name, kind, encoding] = [name, kind, encoding].map(str::to_owned);
            self.topics.push(Topic { name, kind, encoding, count: 0 });
            self.topics.len() - 1
        })
    }

    fn take(
        &mut self,
        topic: usize,
        logged_ns: i64,
        data: &[u8],
        is_wanted: &dyn Fn(&Topic) -> bool,
    ) -> Result<(), String> {
        self.topics[topic].count += 1;
        if is_wanted(&self.topics[topic]) {
            // A bag may pack each message.
            let data = match data.starts_with(&ZSTD) {
                true => unpacked_zstd(data)?,
                false => data.to_vec(),
            };
            self.messages.push(Stored { topic, logged_ns, data });
        }
        Ok(())
    }

    fn take_mcap(
        &mut self,
        name: &str,
        bytes: &[u8],
        is_wanted: &dyn Fn(&Topic) -> bool,
    ) -> Result<(), String> {
        let container =
            Container::read(bytes).map_err(|(byte, cause)| format!("byte {byte}: {cause}"))?;
        let (mut schemas, mut channels) = (HashMap::new(), HashMap::new());
        for section in &container.sections {
            for record in section.records() {
                match record? {
                    Record::Schema { header, .. } => {
                        schemas.insert(header.id, header.name);
                    }
                    Record::Channel(channel) => {
                        let kind = schemas.get(&channel.schema_id).map_or("", String::as_str);
                        let topic = self.topic(&channel.topic, kind, &channel.message_encoding);
                        channels.insert(channel.id, topic);
                    }
                    Record::Message { header, data } => {
                        let Some(&topic) = channels.get(&header.channel_id) else { continue };
                        let logged_ns = i64::try_from(header.log_time).unwrap_or(i64::MAX);
                        self.take(topic, logged_ns, &data, is_wanted)?;
                    }
                    _ => {}
                }
            }
        }
        if let Some(cut) = container.cut {
            self.remarks.push(format!(
                "{name}: the file breaks off at byte {}; what is before it is read",
                cut.byte
            ));
        }
        let left_out = |damage: &crate::container::Damage| {
            format!("{name}: byte {}: {}", damage.byte, damage.what)
        };
        self.remarks.extend(container.damage.iter().map(left_out));
        Ok(())
    }

    fn take_sqlite(
        &mut self,
        bytes: &[u8],
        is_wanted: &dyn Fn(&Topic) -> bool,
    ) -> Result<(), String> {
        let database = Database::open(bytes)?;
        let lacks = |what: &str| format!("this is no bag: it has no {what}");
        let of = |name: &str, wanted: [&str; 4]| {
            let table = database.table(name)?;
            let table = table.ok_or_else(|| lacks(&format!("table `{name}`")))?;
            let at = wanted.map(|column| table.column(column));
            let [Some(a), Some(b), Some(c), Some(d)] = at else {
                return Err(lacks(&format!("columns {} in `{name}`", wanted.join(", "))));
            };
            Ok::<_, String>((table, [a, b, c, d]))
        };
        let (topics, at) = of("topics", ["id", "name", "type", "serialization_format"])?;
        let mut numbers = HashMap::new();
        database.rows(&topics, |row| {
            let [id, name, kind, encoding] = at.map(|k| row.get(k));
            let id = id.and_then(Value::integer).ok_or("a topic has no number")?;
            let [name, kind, encoding] =
                [name, kind, encoding].map(|value| value.and_then(Value::text).unwrap_or_default());
            numbers.insert(id, self.topic(name, kind, encoding));
            Ok(())
        })?;
        let (messages, at) = of("messages", ["id", "topic_id", "timestamp", "data"])?;
        database.rows(&messages, |row| {
            let [_, topic, time, data] = at.map(|k| row.get(k));
            let topic = topic.and_then(Value::integer).and_then(|id| numbers.get(&id));
            match (topic, time.and_then(Value::integer), data) {
                (Some(&topic), Some(time), Some(Value::Blob(data))) => {
                    self.take(topic, time, data, is_wanted)
                }
                _ => Err("a message has no topic, time or data".into()),
            }
        })
    }
}

fn unpacked_zstd(bytes: &[u8]) -> Result<Vec<u8>, String> {
    let failed = |e: &dyn std::fmt::Display| format!("it cannot be unpacked (zstd): {e}");
    let decoder = ruzstd::decoding::StreamingDecoder::new(bytes).map_err(|e| failed(&e))?;
    let mut unpacked = Vec::new();
    decoder.take(LARGEST + 1).read_to_end(&mut unpacked).map_err(|e| failed(&e))?;
    match unpacked.len() as u64 > LARGEST {
        true => Err(format!("unpacked it has more than {LARGEST} bytes")),
        false => Ok(unpacked),
    }
}
