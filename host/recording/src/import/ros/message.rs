//! The messages that a trial can be made of, decoded from CDR.

use byteorder::{BigEndian, LittleEndian};
use serde::Deserialize;

/// Bytes that CDR may add at the end of a message to fill a word.
const MOST_PADDING: usize = 3;

/// The type of a topic, as far as it is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    JointState,
    WrenchStamped,
    PointStamped,
    PoseStamped,
    Transform,
    Transforms,
    Float64,
}

/// The types that are read, by their names in ROS.
const KINDS: [(&str, Kind); 7] = [
    ("sensor_msgs/JointState", Kind::JointState),
    ("geometry_msgs/WrenchStamped", Kind::WrenchStamped),
    ("geometry_msgs/PointStamped", Kind::PointStamped),
    ("geometry_msgs/PoseStamped", Kind::PoseStamped),
    ("geometry_msgs/TransformStamped", Kind::Transform),
    ("tf2_msgs/TFMessage", Kind::Transforms),
    ("std_msgs/Float64", Kind::Float64),
];

/// The names of the types that are read.
pub(super) fn known() -> String {
    KINDS.map(|(name, _)| name).join(", ")
}

impl Kind {
    /// From `sensor_msgs/msg/JointState`.
    pub(super) fn of(name: &str) -> Option<Self> {
        let name = name.replace("/msg/", "/");
        KINDS.iter().find(|(known, _)| *known == name).map(|(_, kind)| *kind)
    }
}

#[derive(Clone, Copy, Debug, Default, Deserialize)]
struct Time {
    sec: i32,
    nanosec: u32,
}

#[derive(Clone, Debug, Default, Deserialize)]
struct Header {
    stamp: Time,
    frame_id: String,
}

#[derive(Debug, Deserialize)]
pub(super) struct Joints {
    header: Header,
    pub(super) name: Vec<String>,
    pub(super) position: Vec<f64>,
    pub(super) velocity: Vec<f64>,
    pub(super) effort: Vec<f64>,
}

#[derive(Debug, Deserialize)]
struct Wrench {
    header: Header,
    force_and_torque: [f64; 6],
}

#[derive(Debug, Deserialize)]
struct Point {
    header: Header,
    point: [f64; 3],
}

#[derive(Debug, Deserialize)]
struct Pose {
    header: Header,
    position: [f64; 3],
    _orientation: [f64; 4],
}

#[derive(Debug, Deserialize)]
struct Transform {
    header: Header,
    child_frame_id: String,
    translation: [f64; 3],
    _rotation: [f64; 4],
}

/// A frame of a transform: its place in its parent.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Placed {
    pub(super) parent: String,
    pub(super) child: String,
    pub(super) at_m: [f64; 3],
    pub(super) stamp_ns: Option<i64>,
}

/// What a message holds.
#[derive(Debug)]
pub(super) enum Message {
    Joints(Joints),
    /// Force \[N\] and torque \[N·m\].
    Wrench([f64; 6]),
    /// A place \[m\].
    Place([f64; 3]),
    Frames(Vec<Placed>),
    Number(f64),
}

/// A message and the time that it names itself \[ns since 1970\], and its frame.
pub(super) struct Decoded {
    pub(super) message: Message,
    pub(super) stamp_ns: Option<i64>,
    pub(super) frame: String,
}

/// Decodes a message; `Err` says what is wrong with its bytes.
pub(super) fn decode(kind: Kind, bytes: &[u8]) -> Result<Decoded, String> {
    let of = |header: Header, message| Decoded {
        message,
        stamp_ns: header.stamp.ns(),
        frame: header.frame_id,
    };
    Ok(match kind {
        Kind::JointState => {
            let mut joints = cdr::<Joints>(bytes)?;
            of(std::mem::take(&mut joints.header), Message::Joints(joints))
        }
        Kind::WrenchStamped => {
            let Wrench { header, force_and_torque } = cdr(bytes)?;
            of(header, Message::Wrench(force_and_torque))
        }
        Kind::PointStamped => {
            let Point { header, point } = cdr(bytes)?;
            of(header, Message::Place(point))
        }
        Kind::PoseStamped => {
            let Pose { header, position, .. } = cdr(bytes)?;
            of(header, Message::Place(position))
        }
        Kind::Transform => frames(vec![cdr(bytes)?]),
        Kind::Transforms => frames(cdr(bytes)?),
        Kind::Float64 => {
            Decoded { message: Message::Number(cdr(bytes)?), stamp_ns: None, frame: String::new() }
        }
    })
}

fn frames(transforms: Vec<Transform>) -> Decoded {
    let placed = transforms.into_iter().map(|one| Placed {
        stamp_ns: one.header.stamp.ns(),
        parent: one.header.frame_id,
        child: one.child_frame_id,
        at_m: one.translation,
    });
    // Each frame has a stamp of its own.
    Decoded { message: Message::Frames(placed.collect()), stamp_ns: None, frame: String::new() }
}

impl Time {
    /// `None` for a stamp that nobody has set.
    fn ns(self) -> Option<i64> {
        let ns = i64::from(self.sec) * 1_000_000_000 + i64::from(self.nanosec);
        (ns != 0).then_some(ns)
    }
}

/// Plain CDR, whose second byte says which byte of a number is first.
fn cdr<T: for<'de> Deserialize<'de>>(bytes: &[u8]) -> Result<T, String> {
    let Some((head, body)) = bytes.split_at_checked(4) else {
        return Err(format!("it has {} bytes, less than the head of CDR", bytes.len()));
    };
    let read = match head {
        [0, 0, ..] => cdr_encoding::from_bytes::<T, BigEndian>(body),
        [0, 1, ..] => cdr_encoding::from_bytes::<T, LittleEndian>(body),
        _ => return Err(format!("it begins with {head:02x?}, which is no plain CDR")),
    };
    let (value, used) = read.map_err(|error| error.to_string())?;
    match body.len().saturating_sub(used) {
        0..=MOST_PADDING => Ok(value),
        rest => Err(format!("{rest} bytes follow it, so that it is of another type")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand after the CDR of OMG's DDS-RTPS: numbers stand at multiples of their size.
    #[test]
    fn both_orders_of_bytes_are_read() {
        let text = |text: &str, little: bool| {
            let length = u32::try_from(text.len() + 1).unwrap();
            let mut bytes =
                if little { length.to_le_bytes() } else { length.to_be_bytes() }.to_vec();
            bytes.extend(text.bytes());
            bytes.push(0);
            bytes
        };
        for little in [true, false] {
            let u32s = |n: u32| if little { n.to_le_bytes() } else { n.to_be_bytes() };
            let f64s = |x: f64| if little { x.to_le_bytes() } else { x.to_be_bytes() };
            let mut body = [u32s(5), u32s(250)].concat();
            body.extend(text("tip", little));
            body.resize(body.len().next_multiple_of(8), 0);
            for x in [1.0, -2.0, 0.5] {
                body.extend(f64s(x));
            }
            let bytes = [&[0, u8::from(little), 0, 0][..], &body].concat();
            let point = decode(Kind::PointStamped, &bytes).unwrap();
            assert_eq!((point.stamp_ns, &point.frame[..]), (Some(5_000_000_250), "tip"));
            assert!(matches!(point.message, Message::Place([1.0, -2.0, 0.5])));
            let padded = [&bytes[..], &[0; 3]].concat();
            assert!(decode(Kind::PointStamped, &padded).is_ok());
            let longer = [&bytes[..], &[0; 8]].concat();
            let error = decode(Kind::PointStamped, &longer).err().unwrap();
            assert!(error.contains("8 bytes follow"), "{error}");
            assert!(decode(Kind::PointStamped, &bytes[..bytes.len() - 1]).is_err());
        }
        let other = decode(Kind::Float64, &[0, 7, 0, 0, 0, 0, 0, 0]).err().unwrap();
        assert!(other.contains("no plain CDR"), "{other}");
        assert_eq!(Kind::of("sensor_msgs/msg/JointState"), Some(Kind::JointState));
        assert_eq!(Kind::of("sensor_msgs/msg/Image"), None);
    }
}
