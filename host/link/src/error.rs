//! What can be wrong with a link, and what to check.

use std::io;
use std::time::Duration;

/// The link cannot be opened, or is lost, or silent. The command ends with exit code 4.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    #[error("`{address}` is no link: {problem}. A link is one of {}", crate::ADDRESSES.join(", "))]
    Address { address: String, problem: &'static str },

    #[error(
        "{link}: this kernel has no CAN sockets. Load them (`modprobe can can_raw`), or reach the \
         device in another way: slcan:/dev/ttyACM0, slcan:tcp:HOST:PORT, qemu"
    )]
    NoCanInKernel { link: String },

    #[error(
        "{link}: there is no interface `{interface}`. `ip link` lists those there are; a CAN \
         interface is brought up with `cathforce link up {interface}`"
    )]
    NoInterface { link: String, interface: String },

    #[error(
        "{link}: the interface is down. Bring it up: `cathforce link up {interface}`, or \
         `ip link set {interface} up type can bitrate 1000000`"
    )]
    InterfaceDown { link: String, interface: String },

    #[error("{link}: no permission ({source}). {fix}")]
    Permission { link: String, source: io::Error, fix: &'static str },

    /// A CAN interface cannot be asked or set.
    #[error(
        "{interface}: cannot be {action}: {source}. Interfaces are set by root: `sudo cathforce \
         link …`, or by hand: {by_hand}"
    )]
    Interface { interface: String, action: &'static str, source: io::Error, by_hand: String },

    #[error("{link}: cannot be opened: {source}. Check {check}")]
    Open { link: String, source: io::Error, check: &'static str },

    #[error(
        "{link}: the bus takes no more frames: nobody acknowledges them. Check that the device is \
         powered, that both ends are terminated with 120 Ω and that both run at 1 Mbit/s"
    )]
    Stuck { link: String },

    #[error("{link}: lost: {source}. Check the cable and that the device is still running")]
    Lost { link: String, source: io::Error },

    #[error("{link}: nothing heard for {} s while waiting for {awaited}. Check {check}", waited.as_secs_f32())]
    Silent { link: String, waited: Duration, awaited: &'static str, check: &'static str },

    /// The emulator cannot be started or does not behave.
    #[error("{link}: {problem}. {fix}")]
    Emulator { link: String, problem: String, fix: String },
}

impl LinkError {
    pub(crate) fn lost(link: &str, source: io::Error) -> Self {
        Self::Lost { link: link.into(), source }
    }
}
