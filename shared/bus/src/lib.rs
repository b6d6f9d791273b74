//! Everything that crosses the bus, as bytes and as types. No hardware, no model.
//!
//! * [`Frame`]: one classic CAN data frame with an 11-bit identifier.
//! * [`Process`]: the fixed-layout process frames, in raw codes with their units beside them.
//! * [`Sealer`], [`Protection`]: counter and CRC of process frames, on sending and receiving.
//! * [`master`]: where a master's own frames have what ENCODER and GUIDEWIRE would say.
//! * [`slcan`]: frames as text over a UART or a socket.
//! * [`transfer`]: messages of more than one frame (ISO 15765-2).
//! * [`service`]: the messages that configure and question a device.
//! * [`Counters`]: what became of every frame received, by name.
//!
//! Nothing here panics on any input: whatever does not fit is an error, and every error is
//! a counter. `docs/architecture.md` has the table of frames, `docs/cathforce.dbc` the same
//! for other tools.

#![no_std]
#![forbid(unsafe_code)]

mod codes;
mod counters;
mod frame;
pub mod master;
mod process;
mod protection;
pub mod service;
pub mod slcan;
pub mod transfer;

pub use codes::{
    BandWidth, DriveTorque, Force, HapticForce, HapticTorque, Insertion, Moment, Position, Rotation,
};
pub use counters::{Counter, Counters};
pub use frame::{Direction, Frame, MAX_ID};
pub use process::{
    Band, Command, Contact, Drive, Encoder, FROM_HOST, GuidewireDrive, Haptic, Id, MAX_NODES,
    MODE_UNCONFIGURED, NodeForce, Process, Shape, Sync, Tick, TotalMoment,
};
pub use protection::{Accepted, Protection, Rejection, Sealer, Status, crc8};
