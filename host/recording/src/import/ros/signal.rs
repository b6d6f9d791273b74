//! What of a message a column of a trial is made of, by its name: `TOPIC:NAME` or `TOPIC:NAME.FIELD`.

use std::collections::BTreeSet;

use cathforce_bundle::nearest;

use super::message::{Kind, Message};

const AXES: [&str; 3] = ["x", "y", "z"];
const WRENCH: [&str; 6] = ["force.x", "force.y", "force.z", "torque.x", "torque.y", "torque.z"];
const JOINT_FIELDS: [&str; 3] = ["position", "velocity", "effort"];

/// A number of a message.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Pick {
    /// A joint and which of its numbers.
    Joint(String, usize),
    Wrench(usize),
    Place(usize),
    Frame(String, usize),
    Number,
}

/// `TOPIC:NAME`; a topic has no colon.
pub(super) fn split(signal: &str) -> (&str, &str) {
    signal.split_once(':').unwrap_or((signal, ""))
}

impl Pick {
    /// The number that a name means; `known`: joints or frames of the topic. `Err` says what is there.
    pub(super) fn of(kind: Kind, name: &str, known: &BTreeSet<String>) -> Result<Self, String> {
        let among = |names: &[&str], name: &str| names.iter().position(|one| *one == name);
        let found = match kind {
            Kind::JointState => {
                let joint = |name: &str, field| Some(Self::Joint(name.to_owned(), field));
                // The name of a joint may have a point itself.
                match name.rsplit_once('.').filter(|_| !known.contains(name)) {
                    Some((of, field)) if known.contains(of) => {
                        among(&JOINT_FIELDS, field).and_then(|field| joint(of, field))
                    }
                    _ if known.contains(name) => joint(name, 0),
                    _ => None,
                }
            }
            Kind::WrenchStamped => among(&WRENCH, name).map(Self::Wrench),
            Kind::PointStamped | Kind::PoseStamped => among(&AXES, name).map(Self::Place),
            Kind::Transform | Kind::Transforms => {
                name.rsplit_once('.').and_then(|(frame, axis)| {
                    let axis = among(&AXES, axis)?;
                    known.contains(frame).then(|| Self::Frame(frame.to_owned(), axis))
                })
            }
            Kind::Float64 => matches!(name, "" | "data").then_some(Self::Number),
        };
        found.ok_or_else(|| {
            let there = names(kind, known);
            let there = there.iter().map(String::as_str).collect::<Vec<_>>();
            match nearest(name, &there) {
                Some(meant) => format!("did you mean `{meant}`? It has {}", there.join(", ")),
                None => format!("it has {}", there.join(", ")),
            }
        })
    }

    /// The number in a message; `None` if the message does not have it.
    pub(super) fn value(&self, message: &Message) -> Option<f64> {
        match (self, message) {
            (Self::Joint(name, field), Message::Joints(joints)) => {
                let at = joints.name.iter().position(|joint| joint == name)?;
                [&joints.position, &joints.velocity, &joints.effort][*field].get(at).copied()
            }
            (Self::Wrench(at), Message::Wrench(wrench)) => wrench.get(*at).copied(),
            (Self::Place(axis), Message::Place(place)) => place.get(*axis).copied(),
            (Self::Frame(child, axis), Message::Frames(frames)) => {
                let frame = frames.iter().find(|frame| frame.child == *child)?;
                frame.at_m.get(*axis).copied()
            }
            (Self::Number, Message::Number(number)) => Some(*number),
            _ => None,
        }
    }

    /// The frame whose own stamp counts, if there is one.
    pub(super) fn frame(&self) -> Option<&str> {
        if let Self::Frame(child, _) = self { Some(child) } else { None }
    }
}

/// The names that a topic has.
pub(super) fn names(kind: Kind, known: &BTreeSet<String>) -> Vec<String> {
    let own = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    match kind {
        Kind::JointState => known.iter().cloned().collect(),
        Kind::WrenchStamped => own(&WRENCH),
        Kind::PointStamped | Kind::PoseStamped => own(&AXES),
        Kind::Transform | Kind::Transforms => {
            known.iter().flat_map(|frame| AXES.map(|axis| format!("{frame}.{axis}"))).collect()
        }
        Kind::Float64 => own(&["data"]),
    }
}
