//! The messages of a bag, decoded, and the names that are in them.

use std::collections::{BTreeMap, BTreeSet};

use super::bag::{Bag, Topic};
use super::error::RosError;
use super::message::{Decoded, Kind, Message, decode};

/// A message, and when the recorder received it.
pub(super) struct Received {
    pub(super) topic: usize,
    pub(super) logged_ns: i64,
    pub(super) decoded: Decoded,
}

/// The type of a topic whose messages are read.
pub(super) fn kind_of(topic: &Topic) -> Option<Kind> {
    Kind::of(&topic.kind).filter(|_| topic.encoding == "cdr")
}

/// Decodes the messages of types that are read, and drops the others.
pub(super) fn received(bag: &mut Bag) -> Result<Vec<Received>, RosError> {
    let stored = std::mem::take(&mut bag.messages);
    let decoded = stored.into_iter().filter_map(|stored| {
        let topic = &bag.topics[stored.topic];
        Some(match decode(kind_of(topic)?, &stored.data) {
            Ok(decoded) => {
                Ok(Received { topic: stored.topic, logged_ns: stored.logged_ns, decoded })
            }
            Err(problem) => {
                let problem = format!("{}: a message is no {}: {problem}", topic.name, topic.kind);
                Err(RosError::new(problem, "record it again, or leave the topic out"))
            }
        })
    });
    decoded.collect()
}

/// Joints and frames of each topic, and the frames that its messages are in.
pub(super) struct Known {
    pub(super) names: Vec<BTreeSet<String>>,
    pub(super) frames: Vec<BTreeSet<String>>,
}

impl Known {
    /// Refuses a frame whose place is given in two other frames.
    pub(super) fn of(bag: &Bag, messages: &[Received]) -> Result<Self, RosError> {
        let empty = vec![BTreeSet::new(); bag.topics.len()];
        let mut known = Self { names: empty.clone(), frames: empty };
        let mut parents: BTreeMap<(usize, &str), &str> = BTreeMap::new();
        for Received { topic, decoded, .. } in messages {
            let (names, frames) = (&mut known.names[*topic], &mut known.frames[*topic]);
            match &decoded.message {
                Message::Joints(joints) => joints.name.iter().for_each(|name| note(names, name)),
                Message::Frames(placed) => {
                    for one in placed {
                        note(names, &one.child);
                        note(frames, &one.parent);
                        let parent = parents.entry((*topic, &one.child)).or_insert(&one.parent);
                        if *parent != one.parent {
                            let problem = format!(
                                "{}: the frame {} is given in {parent} and in {}",
                                bag.topics[*topic].name, one.child, one.parent
                            );
                            let fix =
                                "record the place in one frame, for example as a PointStamped";
                            return Err(RosError::new(problem, fix));
                        }
                    }
                }
                Message::Wrench(_) | Message::Place(_) | Message::Number(_) => {
                    if !decoded.frame.is_empty() {
                        note(frames, &decoded.frame);
                    }
                }
            }
        }
        Ok(known)
    }
}

fn note(names: &mut BTreeSet<String>, name: &str) {
    if !names.contains(name) {
        names.insert(name.to_owned());
    }
}
