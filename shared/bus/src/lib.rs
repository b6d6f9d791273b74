//! Everything that is sent over the bus, as bytes and as types. No hardware, no model.
//!
//! * [`Frame`]: one classic CAN data frame.
//! * [`Process`]: process frames of fixed layout, in raw codes with their units.
//! * [`Sealer`], [`Protection`]: counter and CRC of process frames, for sending and receiving.
//! * [`Placement`]: where the identifiers lie on a bus.
//! * [`master`]: drive positions in a master's own frames, instead of ENCODER and GUIDEWIRE.
//! * [`slcan`]: frames as text over a UART or a socket.
//! * [`transfer`]: segmented messages (ISO 15765-2).
//! * [`service`]: messages that configure and query a device.
//! * [`Counters`]: named counts of what was received.
//!
//! Nothing here panics on any input. Invalid input is an error, and every error has a counter.
//! `docs/reference/frames.md` describes the frames, and `docs/cathforce.dbc` describes them for other
//! tools.

#![no_std]
#![forbid(unsafe_code)]

mod codes;
mod counters;
mod frame;
pub mod master;
mod placement;
mod process;
mod protection;
pub mod service;
pub mod slcan;
pub mod transfer;

pub use codes::{
    BandWidth, Displacement, DriveTorque, Force, HapticForce, HapticTorque, Insertion, Moment,
    Position, Rotation,
};
pub use counters::{Counter, Counters};
pub use frame::{Direction, EXTENDED, Frame, IdDigits, MAX_EXTENDED_ID, MAX_ID, is_id};
pub use placement::{MAX_ID_BASE, Placement};
pub use process::{
    Band, Command, Contact, Drive, Encoder, FROM_HOST, GuidewireDrive, Haptic, Heartbeat, Id,
    MAX_NODES, MODE_UNCONFIGURED, NextCounters, NodeForce, Process, Shape, Sync, TENDON_PAIRS,
    Tendons, Tick, TotalMoment,
};
pub use protection::{Accepted, Protection, Rejection, Sealer, Status, crc8};
