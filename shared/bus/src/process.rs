//! The process frames: identifiers and payloads of 6 bytes, little endian.

use crate::codes::{
    BandWidth, Displacement, DriveTorque, Force, HapticForce, HapticTorque, Insertion, Moment,
    Position, Rotation,
};

/// Nodes that SHAPE and FORCE frames can name.
pub const MAX_NODES: u8 = 64;

/// TENDONS frames; each states two tendons.
pub const TENDON_PAIRS: u8 = 2;

const TENDONS: u32 = 0x10A;
const SHAPE: u32 = 0x200;
const FORCE: u32 = 0x280;

/// Process frames that the host sends.
pub const FROM_HOST: [Id; 6] =
    [Id::Sync, Id::Encoder, Id::Guidewire, Id::Tendons(0), Id::Tendons(1), Id::Command];

/// A counter for each of [`FROM_HOST`].
pub type NextCounters = [u8; FROM_HOST.len()];

/// Meaning of an identifier.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Id {
    Sync,
    Encoder,
    Guidewire,
    /// Displacements of a pair of tendons, below [`TENDON_PAIRS`].
    Tendons(u8),
    Command,
    Haptic,
    Contact,
    Tick,
    Drive,
    Moment,
    GuidewireDrive,
    Band,
    Heartbeat,
    /// Position of this node, below [`MAX_NODES`].
    Shape(u8),
    /// Contact force at this node, below [`MAX_NODES`].
    Force(u8),
    /// Segments from host to device.
    ServiceRequest,
    /// Segments from device to host.
    ServiceResponse,
}

impl Id {
    /// `None` for identifiers that are not ours.
    pub fn from_raw(raw: u32) -> Option<Self> {
        let node = (raw & 0x7F) as u8;
        Some(match raw {
            0x080 => Self::Sync,
            0x100 => Self::Encoder,
            0x108 => Self::Guidewire,
            0x10A => Self::Tendons(0),
            0x10B => Self::Tendons(1),
            0x110 => Self::Command,
            0x180 => Self::Haptic,
            0x190 => Self::Contact,
            0x1A0 => Self::Tick,
            0x1A8 => Self::Drive,
            0x1B0 => Self::Moment,
            0x1B8 => Self::GuidewireDrive,
            0x1C0 => Self::Band,
            0x1C8 => Self::Heartbeat,
            0x580 => Self::ServiceResponse,
            0x600 => Self::ServiceRequest,
            _ if node < MAX_NODES && raw & !0x7F == SHAPE => Self::Shape(node),
            _ if node < MAX_NODES && raw & !0x7F == FORCE => Self::Force(node),
            _ => return None,
        })
    }

    /// The 11-bit identifier.
    pub const fn raw(self) -> u32 {
        match self {
            Self::Sync => 0x080,
            Self::Encoder => 0x100,
            Self::Guidewire => 0x108,
            Self::Tendons(pair) => TENDONS + pair as u32,
            Self::Command => 0x110,
            Self::Haptic => 0x180,
            Self::Contact => 0x190,
            Self::Tick => 0x1A0,
            Self::Drive => 0x1A8,
            Self::Moment => 0x1B0,
            Self::GuidewireDrive => 0x1B8,
            Self::Band => 0x1C0,
            Self::Heartbeat => 0x1C8,
            Self::Shape(node) => SHAPE + node as u32,
            Self::Force(node) => FORCE + node as u32,
            Self::ServiceResponse => 0x580,
            Self::ServiceRequest => 0x600,
        }
    }

    /// Sent by the host; everything else is sent by the device.
    pub fn is_from_host(self) -> bool {
        matches!(
            self,
            Self::Sync
                | Self::Encoder
                | Self::Guidewire
                | Self::Tendons(_)
                | Self::Command
                | Self::ServiceRequest
        )
    }
}

/// Lock step only: run this many ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sync {
    /// Ticks granted, at least 1.
    pub grant: u16,
    /// Count of the host, for logs; the device ignores it.
    pub host_tick: u32,
}

/// Position of a drive: the catheter's (ENCODER) or the guidewire's (GUIDEWIRE).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Encoder {
    pub insertion: Insertion,
    pub rotation: Rotation,
}

/// Displacements of the drives of two tendons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tendons {
    /// 0: the first two tendons; below [`TENDON_PAIRS`].
    pub pair: u8,
    pub displacements: [Displacement; 2],
}

/// A command of the operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    SelfTest,
    Arm,
    Disarm,
    /// Clears a latched fault; `token`: of the fault to clear.
    ClearFault {
        token: u32,
    },
}

/// Mode in the HAPTIC frame while a device has no configuration. The other codes are those of the modes
/// in the control crate.
pub const MODE_UNCONFIGURED: u8 = 7;

/// Rendered force and torque, mode, and fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Haptic {
    pub force: HapticForce,
    pub torque: HapticTorque,
    /// Code of the mode, see `docs/cathforce.dbc`.
    pub mode: u8,
    /// Code of the fault or of the ramp's cause; 0 for none.
    pub fault: u8,
}

/// Total contact force on the vessel: x, y, z, vessel frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Contact {
    pub force: [Force; 3],
}

/// Number of the tick, and digest of all ticks so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tick {
    /// Low bits of the number of the tick.
    pub tick: u16,
    pub digest: u32,
}

/// Load on the drive, limits, and age of the encoder sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Drive {
    pub force: Force,
    pub torque: DriveTorque,
    /// Bits of the limits that changed the output.
    pub limits: u8,
    /// Ticks since the last valid encoder frame, saturating.
    pub encoder_age_ticks: u8,
}

/// Total moment on the vessel about the entry: x, y, z, vessel frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TotalMoment {
    pub moment: [Moment; 3],
}

/// Load on the guidewire's drive. Sent only with a guidewire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GuidewireDrive {
    pub force: Force,
    pub torque: DriveTorque,
    /// Ticks since the last valid frame of its encoder, saturating.
    pub encoder_age_ticks: u8,
    /// The operator feels this load instead of the catheter's.
    pub felt: bool,
}

/// Uncertainty of the forces: half widths of the band that contains nine of ten true forces. Sent only
/// if a diagnosis has measured it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Band {
    /// Half widths of CONTACT's x, y, z; `None` if unknown.
    pub force: Option<[BandWidth; 3]>,
    /// Half width of DRIVE's force; `None` if unknown.
    pub drive_force: Option<BandWidth>,
}

/// State of the device in brief, for whoever looks at the bus now and then.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Heartbeat {
    /// Code of the mode, as in HAPTIC.
    pub mode: u8,
    /// Code of the fault that latched first, or for which the device reset itself; 0 for none.
    pub fault: u8,
    /// Resets by the device itself since it was switched on, saturating.
    pub resets: u8,
    /// Ticks that began late or not at all, saturating.
    pub missed_ticks: u8,
    /// Frames that were rejected, saturating.
    pub rejected_frames: u16,
}

/// Position of a node relative to the entry: x, y, z, vessel frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// 0 is the tip; below [`MAX_NODES`].
    pub node: u8,
    pub position: [Position; 3],
}

/// Contact force at a node: x, y, z, vessel frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NodeForce {
    /// 0 is the tip; below [`MAX_NODES`].
    pub node: u8,
    pub force: [Force; 3],
}

/// Any process frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Process {
    Sync(Sync),
    Encoder(Encoder),
    Guidewire(Encoder),
    Tendons(Tendons),
    Command(Command),
    Haptic(Haptic),
    Contact(Contact),
    Tick(Tick),
    Drive(Drive),
    Moment(TotalMoment),
    GuidewireDrive(GuidewireDrive),
    Band(Band),
    Heartbeat(Heartbeat),
    Shape(Shape),
    Force(NodeForce),
}

impl Process {
    /// Identifier of the frame.
    pub fn id(&self) -> Id {
        match *self {
            Self::Sync(_) => Id::Sync,
            Self::Encoder(_) => Id::Encoder,
            Self::Guidewire(_) => Id::Guidewire,
            Self::Tendons(Tendons { pair, .. }) => Id::Tendons(pair % TENDON_PAIRS),
            Self::Command(_) => Id::Command,
            Self::Haptic(_) => Id::Haptic,
            Self::Contact(_) => Id::Contact,
            Self::Tick(_) => Id::Tick,
            Self::Drive(_) => Id::Drive,
            Self::Moment(_) => Id::Moment,
            Self::GuidewireDrive(_) => Id::GuidewireDrive,
            Self::Band(_) => Id::Band,
            Self::Heartbeat(_) => Id::Heartbeat,
            Self::Shape(Shape { node, .. }) => Id::Shape(node % MAX_NODES),
            Self::Force(NodeForce { node, .. }) => Id::Force(node % MAX_NODES),
        }
    }

    /// Payload of the frame.
    pub fn payload(&self) -> [u8; 6] {
        match *self {
            Self::Sync(Sync { grant, host_tick }) => join_u16_u32(grant.to_le_bytes(), host_tick),
            Self::Encoder(Encoder { insertion, rotation })
            | Self::Guidewire(Encoder { insertion, rotation }) => {
                let ([a, b, c], [d, e, f]) = (insertion.to_bytes(), rotation.to_bytes());
                [a, b, c, d, e, f]
            }
            Self::Tendons(Tendons { displacements, .. }) => {
                let [[a, b, c], [d, e, f]] = displacements.map(Displacement::to_bytes);
                [a, b, c, d, e, f]
            }
            Self::Command(command) => {
                let (code, token) = match command {
                    Command::SelfTest => (1, 0),
                    Command::Arm => (2, 0),
                    Command::Disarm => (3, 0),
                    Command::ClearFault { token } => (4, token),
                };
                join_u16_u32([code, 0], token)
            }
            Self::Haptic(Haptic { force, torque, mode, fault }) => {
                let ([a, b], [c, d]) = (force.0.to_le_bytes(), torque.0.to_le_bytes());
                [a, b, c, d, mode, fault]
            }
            Self::Contact(Contact { force }) => vector_payload(force.map(|x| x.0)),
            Self::Tick(Tick { tick, digest }) => join_u16_u32(tick.to_le_bytes(), digest),
            Self::Drive(Drive { force, torque, limits, encoder_age_ticks }) => {
                let ([a, b], [c, d]) = (force.0.to_le_bytes(), torque.0.to_le_bytes());
                [a, b, c, d, limits, encoder_age_ticks]
            }
            Self::Moment(TotalMoment { moment }) => vector_payload(moment.map(|x| x.0)),
            Self::GuidewireDrive(GuidewireDrive { force, torque, encoder_age_ticks, felt }) => {
                let ([a, b], [c, d]) = (force.0.to_le_bytes(), torque.0.to_le_bytes());
                [a, b, c, d, encoder_age_ticks, u8::from(felt)]
            }
            Self::Band(Band { force, drive_force }) => {
                // Each has 12 bits.
                let [x, y, z] = force.map_or([BandWidth::UNKNOWN; 3], |xyz| xyz.map(|n| n.0));
                let drive = drive_force.map_or(BandWidth::UNKNOWN, |n| n.0);
                let ([a, b, c], [d, e, f]) = (pack_12_bit_pair(x, y), pack_12_bit_pair(z, drive));
                [a, b, c, d, e, f]
            }
            Self::Heartbeat(heartbeat) => {
                let Heartbeat { mode, fault, resets, missed_ticks, rejected_frames } = heartbeat;
                let [e, f] = rejected_frames.to_le_bytes();
                [mode, fault, resets, missed_ticks, e, f]
            }
            Self::Shape(Shape { position, .. }) => vector_payload(position.map(|x| x.0)),
            Self::Force(NodeForce { force, .. }) => vector_payload(force.map(|x| x.0)),
        }
    }

    /// Decodes a payload; `None` if it is invalid under this identifier.
    pub fn decode(id: Id, payload: [u8; 6]) -> Option<Self> {
        let [a, b, c, d, e, f] = payload;
        let tail = u32::from_le_bytes([c, d, e, f]);
        let xyz = [[a, b], [c, d], [e, f]].map(i16::from_le_bytes);
        let [first, second, _] = xyz;
        let position = Encoder {
            insertion: Insertion::from_bytes([a, b, c]),
            rotation: Rotation::from_bytes([d, e, f]),
        };
        Some(match id {
            Id::Sync => {
                let grant = u16::from_le_bytes([a, b]);
                if grant == 0 {
                    return None;
                }
                Self::Sync(Sync { grant, host_tick: tail })
            }
            Id::Encoder => Self::Encoder(position),
            Id::Guidewire => Self::Guidewire(position),
            Id::Tendons(pair) => Self::Tendons(Tendons {
                pair,
                displacements: [[a, b, c], [d, e, f]].map(Displacement::from_bytes),
            }),
            Id::Command => Self::Command(match (a, b, tail) {
                (1, 0, 0) => Command::SelfTest,
                (2, 0, 0) => Command::Arm,
                (3, 0, 0) => Command::Disarm,
                (4, 0, token) => Command::ClearFault { token },
                _ => return None,
            }),
            Id::Haptic => Self::Haptic(Haptic {
                force: HapticForce(first),
                torque: HapticTorque(second),
                mode: e,
                fault: f,
            }),
            Id::Contact => Self::Contact(Contact { force: xyz.map(Force) }),
            Id::Tick => Self::Tick(Tick { tick: u16::from_le_bytes([a, b]), digest: tail }),
            Id::Drive => Self::Drive(Drive {
                force: Force(first),
                torque: DriveTorque(second),
                limits: e,
                encoder_age_ticks: f,
            }),
            Id::Moment => Self::Moment(TotalMoment { moment: xyz.map(Moment) }),
            Id::GuidewireDrive if f <= 1 => Self::GuidewireDrive(GuidewireDrive {
                force: Force(first),
                torque: DriveTorque(second),
                encoder_age_ticks: e,
                felt: f == 1,
            }),
            Id::Band => {
                let ([x, y], [z, drive]) =
                    (unpack_12_bit_pair([a, b, c]), unpack_12_bit_pair([d, e, f]));
                let force = match [x, y, z].map(BandWidth::known) {
                    [Some(x), Some(y), Some(z)] => Some([x, y, z]),
                    [None, None, None] => None,
                    _ => return None,
                };
                Self::Band(Band { force, drive_force: BandWidth::known(drive) })
            }
            Id::Heartbeat => Self::Heartbeat(Heartbeat {
                mode: a,
                fault: b,
                resets: c,
                missed_ticks: d,
                rejected_frames: u16::from_le_bytes([e, f]),
            }),
            Id::Shape(node) => Self::Shape(Shape { node, position: xyz.map(Position) }),
            Id::Force(node) => Self::Force(NodeForce { node, force: xyz.map(Force) }),
            Id::GuidewireDrive | Id::ServiceRequest | Id::ServiceResponse => return None,
        })
    }
}

fn join_u16_u32([a, b]: [u8; 2], tail: u32) -> [u8; 6] {
    let [c, d, e, f] = tail.to_le_bytes();
    [a, b, c, d, e, f]
}

/// Packs two 12-bit numbers, the first one into the low bits.
fn pack_12_bit_pair(low: u16, high: u16) -> [u8; 3] {
    let [low_0, low_1] = low.to_le_bytes();
    let [high_0, high_1] = (high << 4).to_le_bytes();
    [low_0, low_1 & 0xF | high_0, high_1]
}

fn unpack_12_bit_pair([a, b, c]: [u8; 3]) -> [u16; 2] {
    [u16::from_le_bytes([a, b & 0xF]), u16::from_le_bytes([b, c]) >> 4]
}

fn vector_payload(xyz: [i16; 3]) -> [u8; 6] {
    let [[a, b], [c, d], [e, f]] = xyz.map(i16::to_le_bytes);
    [a, b, c, d, e, f]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn identifiers_map_both_ways() {
        let known = (0..=0x7FF).filter_map(|raw| Id::from_raw(raw).map(|id| (raw, id)));
        assert_eq!(
            known.clone().count(),
            14 + usize::from(TENDON_PAIRS) + 2 * usize::from(MAX_NODES)
        );
        assert!(known.into_iter().all(|(raw, id)| id.raw() == raw));
    }

    #[test]
    fn a_grant_of_nothing_and_unknown_commands_mean_nothing() {
        assert_eq!(Process::decode(Id::Sync, [0; 6]), None);
        assert_eq!(Process::decode(Id::Command, [0; 6]), None);
        assert_eq!(Process::decode(Id::Command, [5, 0, 0, 0, 0, 0]), None);
        assert_eq!(Process::decode(Id::Command, [2, 1, 0, 0, 0, 0]), None);
        assert_eq!(Process::decode(Id::Command, [2, 0, 0, 0, 0, 1]), None);
    }

    proptest! {
        #[test]
        fn what_decodes_encodes_to_the_same_bytes(raw in 0u32..=0x7FF, payload: [u8; 6]) {
            if let Some(process) = Id::from_raw(raw).and_then(|id| Process::decode(id, payload)) {
                prop_assert_eq!(process.id().raw(), raw);
                prop_assert_eq!(process.payload(), payload);
            }
        }
    }
}
