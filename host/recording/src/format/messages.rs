//! The messages of a recording: ROS 2 types in CDR, each with its definition.
//!
//! Standard types are used where one fits; `cathforce_msgs` has three types for the rest.

use std::borrow::Cow;

use byteorder::LittleEndian;
use serde::{Deserialize, Serialize};

use super::dropout::Dropout;

/// Plain CDR, little endian, as ROS 2 writes it.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// A message that has a type of ROS 2.
pub(crate) trait Message: Serialize {
    const NAME: &'static str;
    /// Its fields, one a line.
    const DEFINITION: &'static str;
    /// Names and definitions of the types that its fields have.
    const PARTS: &'static [(&'static str, &'static str)];

    /// Schema in the encoding `ros2msg`: the definition, then those of its parts.
    fn schema() -> String {
        let rule = "=".repeat(80);
        let part = |(name, text): &(&str, &str)| format!("{rule}\nMSG: {name}\n{text}");
        let parts = Self::PARTS.iter().map(part);
        std::iter::once(Self::DEFINITION.to_owned()).chain(parts).collect()
    }
}

/// Encodes a message.
pub(crate) fn to_cdr(message: &impl Message) -> Result<Vec<u8>, cdr_encoding::Error> {
    let mut bytes = ENCAPSULATION.to_vec();
    cdr_encoding::to_writer::<_, LittleEndian, _>(&mut bytes, message)?;
    Ok(bytes)
}

/// Decodes a message; `Err` says what is wrong with the bytes.
pub(crate) fn from_cdr<M: Message + for<'de> Deserialize<'de>>(bytes: &[u8]) -> Result<M, String> {
    let Some(body) = bytes.strip_prefix(&ENCAPSULATION) else {
        let found = bytes.get(..4).unwrap_or(bytes);
        return Err(format!("it begins with {found:02x?}, not as little-endian CDR"));
    };
    let (message, used) = cdr_encoding::from_bytes::<M, LittleEndian>(body)
        .map_err(|error| format!("no {}: {error}", M::NAME))?;
    match body.len() - used {
        0 => Ok(message),
        rest => Err(format!("{rest} bytes follow the {}", M::NAME)),
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Time {
    sec: i32,
    nanosec: u32,
}

impl Time {
    pub(crate) fn from_ns(ns: u64) -> Self {
        let sec = i32::try_from(ns / 1_000_000_000).unwrap_or(i32::MAX);
        Self { sec, nanosec: (ns % 1_000_000_000) as u32 }
    }
}

/// Axes of the vessel frame, origin at the entry.
pub(crate) const ENTRY: &str = "entry";
/// The vessel frame of `rig.toml`.
pub(crate) const VESSEL: &str = "vessel";
/// x is the operator's linear axis, and the axis of its rotation.
pub(crate) const OPERATOR: &str = "operator";

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Header {
    stamp: Time,
    frame_id: Cow<'static, str>,
}

impl Header {
    pub(crate) fn new(at_ns: u64, frame_id: &'static str) -> Self {
        Self { stamp: Time::from_ns(at_ns), frame_id: frame_id.into() }
    }

    pub(crate) fn ns(&self) -> u64 {
        let seconds = u64::try_from(self.stamp.sec).unwrap_or(0);
        seconds.saturating_mul(1_000_000_000).saturating_add(u64::from(self.stamp.nanosec))
    }
}

const TIME: (&str, &str) = ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n");
const HEADER: (&str, &str) =
    ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n");
const VECTOR: (&str, &str) = ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n");

macro_rules! message {
    ($type:ty, $name:literal, $definition:literal, [$($part:expr),* $(,)?]) => {
        impl Message for $type {
            const NAME: &'static str = $name;
            const DEFINITION: &'static str = $definition;
            const PARTS: &'static [(&'static str, &'static str)] = &[$($part),*];
        }
    };
}

/// A frame of the bus.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct CanFrame {
    pub header: Header,
    pub id: u32,
    pub is_rtr: bool,
    pub is_extended: bool,
    pub is_error: bool,
    pub dlc: u8,
    pub data: [u8; 8],
}

message!(
    CanFrame,
    "can_msgs/msg/Frame",
    "std_msgs/Header header\nuint32 id\nbool is_rtr\nbool is_extended\nbool is_error\nuint8 dlc\n\
     uint8[8] data\n",
    [HEADER, TIME]
);

/// A drive: insertion and rotation, with its load as effort.
#[derive(Serialize)]
pub(crate) struct Joints<'a> {
    header: Header,
    name: &'static [&'static str],
    position: &'a [f64],
    velocity: &'a [f64],
    effort: &'a [f64],
}

impl<'a> Joints<'a> {
    /// `position`: m, rad; `effort`: N, N·m, empty where it is not known.
    pub(crate) fn new(header: Header, position: &'a [f64], effort: &'a [f64]) -> Self {
        Self { header, name: &["insertion", "rotation"], position, velocity: &[], effort }
    }

    /// Displacements of the tendons' drives \[m\].
    pub(crate) fn tendons(header: Header, position: &'a [f64]) -> Self {
        const NAMES: &[&str] = &["tendon_1", "tendon_2", "tendon_3", "tendon_4"];
        let name = NAMES.get(..position.len()).unwrap_or(NAMES);
        Self { header, name, position, velocity: &[], effort: &[] }
    }
}

message!(
    Joints<'_>,
    "sensor_msgs/msg/JointState",
    "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n\
     float64[] effort\n",
    [HEADER, TIME]
);

/// Force \[N\] and moment \[N·m\] about the origin of the frame.
#[derive(Serialize)]
pub(crate) struct WrenchStamped {
    pub header: Header,
    pub force: [f64; 3],
    pub torque: [f64; 3],
}

message!(
    WrenchStamped,
    "geometry_msgs/msg/WrenchStamped",
    "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n",
    [
        HEADER,
        TIME,
        ("geometry_msgs/Wrench", "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n"),
        VECTOR,
    ]
);

/// Transform of the entry, for tools that draw.
#[derive(Serialize)]
pub(crate) struct TfMessage {
    transforms: Vec<Transform>,
}

#[derive(Serialize)]
struct Transform {
    header: Header,
    child_frame_id: &'static str,
    translation: [f64; 3],
    rotation: [f64; 4],
}

impl TfMessage {
    /// The entry in the vessel frame \[m\].
    pub(crate) fn entry(position_m: [f64; 3]) -> Self {
        Self {
            transforms: vec![Transform {
                header: Header::new(0, VESSEL),
                child_frame_id: ENTRY,
                translation: position_m,
                rotation: [0.0, 0.0, 0.0, 1.0],
            }],
        }
    }
}

message!(
    TfMessage,
    "tf2_msgs/msg/TFMessage",
    "geometry_msgs/TransformStamped[] transforms\n",
    [
        (
            "geometry_msgs/TransformStamped",
            "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"
        ),
        (
            "geometry_msgs/Transform",
            "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"
        ),
        ("geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"),
        VECTOR,
        HEADER,
        TIME,
    ]
);

/// The nodes of the instrument, tip first.
#[derive(Serialize)]
pub(crate) struct PointCloud2 {
    header: Header,
    height: u32,
    width: u32,
    fields: Vec<PointField>,
    is_bigendian: bool,
    point_step: u32,
    row_step: u32,
    data: Vec<u8>,
    is_dense: bool,
}

#[derive(Serialize)]
struct PointField {
    name: &'static str,
    offset: u32,
    datatype: u8,
    count: u32,
}

/// `sensor_msgs/msg/PointField.FLOAT32`.
const FLOAT32: u8 = 7;

impl PointCloud2 {
    /// Position \[m\], magnitude of the contact force as intensity and the force itself \[N\].
    const FIELDS: [&'static str; 7] = ["x", "y", "z", "intensity", "fx", "fy", "fz"];

    /// Points in the order of [`Self::FIELDS`].
    pub(crate) fn new(header: Header, points: impl Iterator<Item = [f32; 7]>) -> Self {
        let field =
            |(i, name): (u32, _)| PointField { name, offset: 4 * i, datatype: FLOAT32, count: 1 };
        let data: Vec<u8> = points.flatten().flat_map(f32::to_le_bytes).collect();
        let point_step = 4 * Self::FIELDS.len() as u32;
        Self {
            header,
            height: 1,
            width: data.len() as u32 / point_step,
            fields: (0..).zip(Self::FIELDS).map(field).collect(),
            is_bigendian: false,
            point_step,
            row_step: data.len() as u32,
            data,
            is_dense: true,
        }
    }
}

message!(
    PointCloud2,
    "sensor_msgs/msg/PointCloud2",
    "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\n\
     bool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n",
    [
        HEADER,
        TIME,
        ("sensor_msgs/PointField", "string name\nuint32 offset\nuint8 datatype\nuint32 count\n"),
    ]
);

/// State of the device in the terms of CRTK.
#[derive(Serialize)]
pub(crate) struct OperatingState {
    pub header: Header,
    /// DISABLED, ENABLED, PAUSED or FAULT.
    pub state: &'static str,
    pub is_homed: bool,
    pub is_busy: bool,
}

message!(
    OperatingState,
    "crtk_msgs/msg/OperatingState",
    "std_msgs/Header header\nstring state\nbool is_homed\nbool is_busy\n",
    [HEADER, TIME]
);

/// Status of a tick.
#[derive(Serialize)]
pub(crate) struct Status {
    pub header: Header,
    pub tick: u64,
    pub mode: u8,
    pub fault: u8,
    pub unresolved: bool,
    pub limited: bool,
}

message!(
    Status,
    "cathforce_msgs/msg/Status",
    "std_msgs/Header header\n# ticks since the recording began\nuint64 tick\n\
     # codes of mode and fault, 0 is none\nuint8 mode\nuint8 fault\n\
     # forces of this tick are not to be trusted\nbool unresolved\n\
     # the haptic output was limited\nbool limited\n",
    [HEADER, TIME]
);

/// A row of the trial. A value that was not measured is an empty sequence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct MeasuredRow {
    pub header: Header,
    pub t_s: f64,
    pub insertion_m: f64,
    pub rotation_rad: f64,
    pub force_n: Vec<f64>,
    pub drive_force_n: Vec<f64>,
    pub tip_m: Vec<f64>,
    pub shape_m: Vec<f64>,
    pub guidewire: Vec<f64>,
    pub guidewire_force_n: Vec<f64>,
    pub tendons_m: Vec<f64>,
}

message!(
    MeasuredRow,
    "cathforce_msgs/msg/Measured",
    "std_msgs/Header header\n# of the trial [s]\nfloat64 t_s\n# of the drive\n\
     float64 insertion_m\nfloat64 rotation_rad\n\
     # empty where not measured: on the phantom, x y z, vessel frame\nfloat64[] force_n\n\
     # behind the guide\nfloat64[] drive_force_n\n# x y z, vessel frame\nfloat64[] tip_m\n\
     # x y z of one point after the other, tip first\nfloat64[] shape_m\n\
     # of the guidewire's drive: insertion [m], rotation [rad]\nfloat64[] guidewire\n\
     float64[] guidewire_force_n\n\
     # displacements of the tendons' drives, as many as there are\nfloat64[] tendons_m\n",
    [HEADER, TIME]
);

/// Frames that the recording lacks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct DropoutMessage {
    pub header: Header,
    pub from_ns: u64,
    pub cause: Cow<'static, str>,
    pub id: u32,
    pub frames: u32,
}

impl DropoutMessage {
    pub(crate) fn of(dropout: &Dropout) -> Self {
        Self {
            header: Header::new(dropout.to_ns, ""),
            from_ns: dropout.from_ns,
            cause: dropout.cause.name().into(),
            id: dropout.id.unwrap_or_default(),
            frames: dropout.frames,
        }
    }
}

message!(
    DropoutMessage,
    "cathforce_msgs/msg/Dropout",
    "# header.stamp: when the last of the frames was missed\nstd_msgs/Header header\n\
     # when the first one was, time of the bus\nuint64 from_ns\nstring cause\n\
     # of the frames; 0 when there were several\nuint32 id\nuint32 frames\n",
    [HEADER, TIME]
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_survives_its_bytes_and_nothing_else_is_one() {
        let message = DropoutMessage {
            header: Header::new(1_000_000_007, ENTRY),
            from_ns: 7,
            cause: "lost".into(),
            id: 3,
            frames: 4,
        };
        let bytes = to_cdr(&message).unwrap();
        assert_eq!(from_cdr(&bytes), Ok(message));
        let short = from_cdr::<DropoutMessage>(&bytes[..bytes.len() - 1]).unwrap_err();
        assert!(short.contains("no cathforce_msgs/msg/Dropout"), "{short}");
        let long = [&bytes[..], &[0]].concat();
        let long = from_cdr::<DropoutMessage>(&long).unwrap_err();
        assert!(long.contains("1 bytes follow"), "{long}");
        let big_endian = from_cdr::<DropoutMessage>(&[0, 0, 0, 0]).unwrap_err();
        assert!(big_endian.contains("little-endian CDR"), "{big_endian}");
        assert!(from_cdr::<DropoutMessage>(&[]).is_err());
    }

    /// Alignment counts from the end of the encapsulation: 4 bytes fill up to the time.
    #[test]
    fn numbers_stand_where_cdr_puts_them() {
        let header = Header::new(0, "");
        let bytes = to_cdr(&WrenchStamped { header, force: [1.0; 3], torque: [0.0; 3] }).unwrap();
        // Time 8, length 4 and terminator 1 of the text, then filled up to 16.
        assert_eq!(bytes[4 + 16..][..8], 1.0_f64.to_le_bytes());
        assert_eq!(bytes.len(), 4 + 16 + 48);
    }
}
