//! From an address to a link.

use std::path::Path;

use cathforce_bus::Placement;

use crate::moved::{self, Moved};
use crate::qemu::Qemu;
use crate::{Hub, Link, LinkError, Sim, Slcan, hub};

/// Bit rate of a serial port, if the address says nothing. USB adapters ignore it.
const DEFAULT_BAUD: u32 = 1_000_000;
/// Where a bus listens unless the address says otherwise: SLCAN knows no passwords, so that other
/// computers are let in only when somebody asks for it.
const LOOPBACK: &str = "127.0.0.1";

/// What an address says.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Address<'a> {
    SocketCan { interface: &'a str },
    Tcp { host_and_port: &'a str },
    Listen { host_and_port: String },
    Serial { path: &'a str, baud: u32 },
    Qemu { elf: Option<&'a str> },
    Sim,
}

/// Checks the form of an address, that its CAN interface is there and that its port is free; sends
/// nothing and starts nothing.
pub fn check(address: &str) -> Result<(), LinkError> {
    match understood(address)?.0 {
        Address::SocketCan { interface } => open_socketcan(address, interface).map(drop),
        Address::Listen { host_and_port } => hub::check(address, &host_and_port),
        Address::Tcp { .. } | Address::Serial { .. } | Address::Qemu { .. } | Address::Sim => {
            Ok(())
        }
    }
}

fn understood(address: &str) -> Result<(Address<'_>, Placement), LinkError> {
    let parts =
        moved::placement(address).and_then(|(carrier, placement)| Ok((parse(carrier)?, placement)));
    parts.map_err(|problem| LinkError::Address { address: address.into(), problem })
}

/// Opens a link by its address; [`crate::ADDRESSES`] lists the forms. One that listens waits for the first
/// who connects, and says so ([`crate::set_remarks`]).
pub fn open(address: &str) -> Result<Box<dyn Link>, LinkError> {
    let (carrier, placement) = understood(address)?;
    let link: Box<dyn Link> = match carrier {
        Address::SocketCan { interface } => open_socketcan(address, interface)?,
        Address::Tcp { host_and_port } => Box::new(Slcan::connect(address, host_and_port)?),
        Address::Listen { host_and_port } => Box::new(Hub::open(address, &host_and_port)?),
        Address::Serial { path, baud } => Box::new(Slcan::open_serial(address, path, baud)?),
        Address::Qemu { elf } => Box::new(Qemu::boot(elf.map(Path::new))?),
        // A device in this process is where its host looks for it.
        Address::Sim => return Ok(Box::new(Sim::new())),
    };
    Ok(match placement.base() {
        None => link,
        Some(_) => Box::new(Moved::new(link, placement, address)),
    })
}

#[cfg(all(target_os = "linux", feature = "hardware"))]
fn open_socketcan(address: &str, interface: &str) -> Result<Box<dyn Link>, LinkError> {
    Ok(Box::new(crate::socketcan::SocketCan::open(address, interface)?))
}

#[cfg(not(all(target_os = "linux", feature = "hardware")))]
fn open_socketcan(address: &str, _: &str) -> Result<Box<dyn Link>, LinkError> {
    Err(LinkError::no_can(address))
}

fn parse(address: &str) -> Result<Address<'_>, &'static str> {
    let (kind, rest) = match address.split_once(':') {
        Some((kind, rest)) => (kind, Some(rest)),
        None => (address, None),
    };
    match (kind, rest) {
        ("socketcan", Some(interface)) if !interface.is_empty() => {
            Ok(Address::SocketCan { interface })
        }
        ("socketcan", _) => Err("the interface is missing"),
        ("slcan", Some(rest)) => parse_slcan(rest),
        ("slcan", None) => {
            Err("the serial port, `tcp:HOST:PORT` or `listen:PORT` is missing after `slcan:`")
        }
        ("qemu", Some("")) => Err("the firmware after `qemu:` is missing"),
        ("qemu", elf) => Ok(Address::Qemu { elf }),
        ("sim", None) => Ok(Address::Sim),
        _ => Err("it does not begin with a carrier, such as `socketcan:`, `slcan:` or `sim`"),
    }
}

fn parse_slcan(rest: &str) -> Result<Address<'_>, &'static str> {
    if let Some(host_and_port) = rest.strip_prefix("tcp:") {
        let port = host_and_port.rsplit_once(':').map(|(_, port)| port.parse::<u16>());
        return match port {
            Some(Ok(_)) => Ok(Address::Tcp { host_and_port }),
            _ => Err("after `tcp:` come a host, a colon and a port"),
        };
    }
    if let Some(at) = rest.strip_prefix("listen:") {
        let (host, port) = at.rsplit_once(':').unwrap_or((LOOPBACK, at));
        return match port.parse::<u16>() {
            Ok(port) if !host.is_empty() => {
                Ok(Address::Listen { host_and_port: format!("{host}:{port}") })
            }
            _ => Err("after `listen:` comes a port, or a host, a colon and a port"),
        };
    }
    let (path, baud) = match rest.rsplit_once('@') {
        Some((path, baud)) => (path, baud.parse().map_err(|_| "the baud rate is no number")?),
        None => (rest, DEFAULT_BAUD),
    };
    if path.is_empty() {
        Err("the serial port is missing")
    } else {
        Ok(Address::Serial { path, baud })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_is_understood() {
        let tcp = Address::Tcp { host_and_port: "[::1]:2000" };
        assert_eq!(parse("socketcan:can0"), Ok(Address::SocketCan { interface: "can0" }));
        assert_eq!(parse("slcan:tcp:[::1]:2000"), Ok(tcp));
        let listen = |at: &str| Ok(Address::Listen { host_and_port: at.into() });
        assert_eq!(parse("slcan:listen:5555"), listen("127.0.0.1:5555"));
        assert_eq!(parse("slcan:listen:0.0.0.0:5555"), listen("0.0.0.0:5555"));
        assert_eq!(parse("slcan:listen:[::1]:5555"), listen("[::1]:5555"));
        let serial = |baud| Ok(Address::Serial { path: "/dev/ttyACM0", baud });
        assert_eq!(parse("slcan:/dev/ttyACM0"), serial(DEFAULT_BAUD));
        assert_eq!(parse("slcan:/dev/ttyACM0@115200"), serial(115_200));
        assert_eq!(parse("qemu"), Ok(Address::Qemu { elf: None }));
        assert_eq!(parse("qemu:a/b.elf"), Ok(Address::Qemu { elf: Some("a/b.elf") }));
        assert_eq!(parse("sim"), Ok(Address::Sim));
    }

    #[test]
    fn a_can_interface_that_is_not_there_is_missed_before_anything_is_done() {
        // No kernel has an interface of this name, which is too long for one.
        assert!(check("socketcan:no-such-interface").is_err());
        // A serial port is opened only to speak to it.
        assert!(check("slcan:/dev/no-such-port").is_ok());
    }

    #[test]
    fn what_is_no_address_is_refused_with_the_forms_there_are() {
        for address in [
            "",
            "can0",
            "socketcan:",
            "slcan",
            "slcan:",
            "slcan:tcp:host",
            "slcan:listen:",
            "slcan:listen::5555",
            "slcan:listen:70000",
            "slcan:/dev/x@fast",
            "qemu:",
        ] {
            let error = open(address).err().unwrap().to_string();
            assert!(error.contains("slcan:tcp:HOST:PORT"), "{error}");
        }
    }
}
