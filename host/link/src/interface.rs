//! CAN interfaces of Linux: reads how they are set, and sets them.
//!
//! It does what a user would do with `ip link`, by the same netlink messages. Every error names the
//! `ip` command that does the same by hand.

#[cfg(all(target_os = "linux", feature = "hardware"))]
mod linux;
#[cfg(all(target_os = "linux", feature = "hardware"))]
pub use linux::{bring_down, bring_up, check_sockets, find, list};
#[cfg(not(all(target_os = "linux", feature = "hardware")))]
mod none;
#[cfg(not(all(target_os = "linux", feature = "hardware")))]
pub use none::{bring_down, bring_up, check_sockets, find, list};

/// Bit rate of the bus \[bit/s\], the CathBot master's.
pub const BIT_RATE: u32 = 1_000_000;
/// Frames that the transmit queue of an interface should hold. The host has 16 ticks of up to four
/// frames under way, which is half of it; Linux gives a CAN interface 10.
pub const QUEUE_FRAMES: u32 = 128;
/// After a bus-off the controller may begin again after so many milliseconds.
pub const RESTART_MS: u32 = 100;

/// What drives an interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A CAN controller with a bit rate of its own.
    Controller,
    /// An SLCAN adapter behind a serial port; its bit rate was set when it was attached.
    SerialLine,
    /// Inside this computer only.
    Virtual,
}

impl Kind {
    pub const fn name(self) -> &'static str {
        match self {
            Self::Controller => "controller",
            Self::SerialLine => "serial line",
            Self::Virtual => "virtual",
        }
    }
}

/// The error state of a CAN controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusState {
    ErrorActive,
    ErrorWarning,
    ErrorPassive,
    BusOff,
    Stopped,
}

impl BusState {
    pub const fn name(self) -> &'static str {
        match self {
            Self::ErrorActive => "error active",
            Self::ErrorWarning => "error warning",
            Self::ErrorPassive => "error passive",
            Self::BusOff => "bus off",
            Self::Stopped => "stopped",
        }
    }
}

/// A CAN interface as it is now.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Interface {
    pub name: String,
    pub kind: Kind,
    pub is_up: bool,
    /// Only controllers have one; `None` while it is not set \[bit/s\].
    pub bit_rate: Option<u32>,
    /// Only controllers and serial lines know.
    pub state: Option<BusState>,
    /// Pause after a bus-off \[ms\]; 0 is for ever. Only controllers have one.
    pub restart_ms: Option<u32>,
    /// Frames that its transmit queue holds.
    pub queue_frames: u32,
}

/// How an interface should be set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setup {
    /// \[bit/s\]
    pub bit_rate: u32,
    pub queue_frames: u32,
    /// \[ms\]
    pub restart_ms: u32,
}

impl Default for Setup {
    fn default() -> Self {
        Self { bit_rate: BIT_RATE, queue_frames: QUEUE_FRAMES, restart_ms: RESTART_MS }
    }
}

/// The `ip` lines that bring an interface up like this.
pub fn ip_up(interface: &str, kind: Kind, setup: Setup) -> String {
    let Setup { bit_rate, queue_frames, restart_ms } = setup;
    let down = format!("ip link set {interface} down");
    let up = format!("ip link set {interface} txqueuelen {queue_frames} up");
    match kind {
        Kind::Controller => format!(
            "{down} && ip link set {interface} type can bitrate {bit_rate} restart-ms \
             {restart_ms} && {up}"
        ),
        Kind::SerialLine | Kind::Virtual => up,
    }
}

/// The `ip` line that takes an interface down.
pub fn ip_down(interface: &str) -> String {
    format!("ip link set {interface} down")
}
