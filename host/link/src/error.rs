//! What can be wrong with a link, and what to check.

use std::fmt;
use std::io;
use std::time::Duration;

/// The forms of an address.
pub const ADDRESSES: [&str; 6] = [
    "socketcan:can0",
    "slcan:/dev/ttyACM0[@BAUD]",
    "slcan:tcp:HOST:PORT",
    "slcan:listen:[HOST:]PORT",
    "qemu[:ELF]",
    "sim",
];

/// The link cannot be opened, or is lost, or silent. The command ends with exit code 4.
#[derive(Debug)]
pub enum LinkError {
    Address {
        address: String,
        problem: &'static str,
    },
    NoCanInKernel {
        link: String,
    },
    /// This program was built without the feature `hardware`.
    LeftOut {
        link: String,
    },
    NoInterface {
        link: String,
        interface: String,
    },
    InterfaceDown {
        link: String,
        interface: String,
    },
    Permission {
        link: String,
        source: io::Error,
        fix: &'static str,
    },
    /// A CAN interface cannot be asked or set.
    Interface {
        interface: String,
        action: &'static str,
        source: io::Error,
        by_hand: String,
    },
    Open {
        link: String,
        source: io::Error,
        check: &'static str,
    },
    /// Nobody acknowledges what is sent.
    Stuck {
        link: String,
    },
    /// Everybody who had joined the bus that this program holds has left it.
    Alone {
        link: String,
    },
    Lost {
        link: String,
        source: io::Error,
    },
    Silent {
        link: String,
        waited: Duration,
        awaited: &'static str,
        check: &'static str,
    },
    /// No firmware of this board was installed with the program.
    Firmware {
        board: String,
        tried: Vec<String>,
    },
    /// The emulator cannot be started or does not behave.
    Emulator {
        link: String,
        problem: String,
        fix: String,
    },
}

impl LinkError {
    pub(crate) fn lost(link: &str, source: io::Error) -> Self {
        Self::Lost { link: link.into(), source }
    }

    /// Where CAN interfaces cannot be reached at all.
    #[cfg(not(all(target_os = "linux", feature = "hardware")))]
    pub(crate) fn no_can(link: &str) -> Self {
        match cfg!(target_os = "linux") {
            true => Self::LeftOut { link: link.into() },
            false => Self::NoCanInKernel { link: link.into() },
        }
    }

    /// What is wrong, and where.
    pub fn problem(&self) -> String {
        match self {
            Self::Address { address, problem } => {
                format!("`{address}` is not the address of a link: {problem}")
            }
            Self::NoCanInKernel { link } => format!("{link}: this kernel has no CAN sockets"),
            Self::LeftOut { link } => {
                format!("{link}: this program was built without CAN interfaces and serial ports")
            }
            Self::NoInterface { link, interface } => {
                format!("{link}: there is no CAN interface `{interface}`")
            }
            Self::InterfaceDown { link, .. } => format!("{link}: the interface is down"),
            Self::Permission { link, source, .. } => format!("{link}: no permission ({source})"),
            Self::Interface { interface, action, source, .. } => {
                format!("{interface}: cannot be {action}: {source}")
            }
            Self::Open { link, source, .. } => format!("{link}: cannot be opened: {source}"),
            Self::Stuck { link } => {
                format!("{link}: the bus takes no more frames: nobody acknowledges them")
            }
            Self::Alone { link } => format!("{link}: everybody who was connected has left"),
            Self::Lost { link, source } => format!("{link}: lost: {source}"),
            Self::Silent { link, waited, awaited, .. } => {
                let waited_s = waited.as_secs_f32();
                format!("{link}: nothing heard for {waited_s} s while waiting for {awaited}")
            }
            Self::Firmware { board, tried } => {
                let tried = tried.join("\n  ");
                format!("no firmware of the board {board} was found; tried were\n  {tried}")
            }
            Self::Emulator { link, problem, .. } => format!("{link}: {problem}"),
        }
    }

    /// What to do about it.
    pub fn fix(&self) -> String {
        match self {
            Self::Address { .. } => format!("A link is one of {}", ADDRESSES.join(", ")),
            Self::NoCanInKernel { .. } => {
                "Load them (`modprobe can can_raw`), or reach the device \
                in another way: slcan:/dev/ttyACM0, slcan:tcp:HOST:PORT, qemu"
                    .into()
            }
            Self::LeftOut { .. } => {
                "Build it with its feature `hardware`, which is on by default: `cargo install \
                 --path host/cli`"
                    .into()
            }
            Self::NoInterface { interface, .. } => {
                let is_virtual = interface.starts_with("vcan");
                let first = if is_virtual { "" } else { "Plug in the adapter; " };
                format!(
                    "{first}`cathforce link list` says which there are, `cathforce link up \
                     {interface}` {} it",
                    if is_virtual { "makes" } else { "then brings up" }
                )
            }
            Self::InterfaceDown { interface, .. } => format!(
                "Bring it up: `cathforce link up {interface}`, or `ip link set {interface} up type \
                 can bitrate 1000000`"
            ),
            Self::Permission { fix, .. } => (*fix).into(),
            Self::Interface { by_hand, .. } => format!(
                "Interfaces are set by root: `sudo cathforce link …`, or by hand: {by_hand}"
            ),
            Self::Open { check, .. } | Self::Silent { check, .. } => format!("Check {check}"),
            Self::Stuck { .. } => {
                "Check that the device is powered, that both ends are terminated \
                with 120 Ω and that both run at 1 Mbit/s"
                    .into()
            }
            Self::Alone { .. } => {
                "Start both sides again, first the one that listens, and look at what the other \
                 one said when it ended"
                    .into()
            }
            Self::Lost { .. } => "Check the cable and that the device is still running".into(),
            Self::Firmware { .. } => {
                "Name the file with --firmware; `cargo xtask dist` in a checkout builds it".into()
            }
            Self::Emulator { fix, .. } => fix.clone(),
        }
    }
}

impl fmt::Display for LinkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (problem, fix) = (self.problem(), self.fix());
        match problem.contains('\n') {
            true => write!(f, "{problem}\n  fix: {fix}"),
            false => write!(f, "{problem}. {fix}"),
        }
    }
}

impl std::error::Error for LinkError {}
