//! One bus, many carriers.
//!
//! [`open`] turns an address into a [`Link`], which carries frames and does not interpret them:
//!
//! | address | carrier |
//! | --- | --- |
//! | `socketcan:can0` | a CAN interface of Linux |
//! | `slcan:tcp:HOST:PORT` | SLCAN over a socket that is connected from here |
//! | `slcan:listen:PORT`, `slcan:listen:HOST:PORT` | a bus that others join: SLCAN over sockets that are connected from there |
//! | `slcan:/dev/ttyACM0`, `slcan:/dev/ttyACM0@115200` | an SLCAN adapter on a serial port |
//! | `qemu`, `qemu:ELF` | the firmware on an emulated board, started here |
//! | `sim` | the device's code in this process, no hardware at all |
//!
//! Where the identifiers of a device were moved, `,id-base=BASE` stands behind its address.
//!
//! A [`Client`] talks over a link to one device: who it is, its configuration, ticks.

mod address;
mod boards;
mod bridge;
mod build;
mod client;
mod error;
mod firmware;
mod firmware_log;
mod hub;
mod identity;
pub mod interface;
mod moved;
mod play;
pub mod qemu;
mod reader;
mod remark;
mod serial;
mod serve;
mod sim;
mod slcan;
#[cfg(all(target_os = "linux", feature = "hardware"))]
mod socketcan;
mod ticks;

use std::time::Duration;

use cathforce_bus::Frame;

pub use cathforce_bus::Direction;

pub use address::{check as check_address, open};
pub use boards::{BOARDS, Board, Flash, board, update};
pub use bridge::{Bridged, bridge};
pub use build::{build_of, version_and_build};
pub use client::{Client, ClientError, CrashRecord, Device, SavedImage, Tap};
pub use error::{ADDRESSES, LinkError};
pub use firmware::firmware_of;
pub use hub::Hub;
pub use identity::{Identity, IdentityError, SECTION as IDENTITY_SECTION};
pub use moved::carrier;
pub use play::Step;
pub use remark::set_remarks;
pub use serial::{SerialPort, Usb, serial_ports};
pub use serve::{Served, serve};
pub use sim::Sim;
pub use slcan::Slcan;
pub use ticks::TickReport;

/// A carrier of frames, both ways.
///
/// Frames arrive in the order in which they were sent. A carrier keeps what it receives until
/// [`Link::receive`] is called.
pub trait Link: Send {
    /// Hands a frame to the carrier, which may keep it until [`Link::flush`].
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError>;

    /// Puts everything sent so far on the bus.
    fn flush(&mut self) -> Result<(), LinkError>;

    /// Flushes, then waits for the next frame of the other side; `None` after `timeout`.
    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>, LinkError>;

    /// How long the last received frame had waited on this computer, by the carrier's own time
    /// stamp; `None` without one.
    fn waited(&self) -> Option<Duration> {
        None
    }

    /// Frames that this carrier dropped because a member of the bus read too slowly.
    fn dropped(&self) -> u64 {
        0
    }

    /// Its address, for messages.
    fn name(&self) -> &str;
}

impl Link for Box<dyn Link> {
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        (**self).send(frame)
    }

    fn flush(&mut self) -> Result<(), LinkError> {
        (**self).flush()
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>, LinkError> {
        (**self).receive(timeout)
    }

    fn waited(&self) -> Option<Duration> {
        (**self).waited()
    }

    fn dropped(&self) -> u64 {
        (**self).dropped()
    }

    fn name(&self) -> &str {
        (**self).name()
    }
}
