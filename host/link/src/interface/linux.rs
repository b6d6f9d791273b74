//! Netlink, and `/sys/class/net` for the attributes that the netlink crate lacks.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use socketcan::nl::{CanInterface, CanState, InterfaceCanParams, InterfaceDetails};
use socketcan::{CanSocket, Socket};

use super::{BusState, Interface, Kind, Setup, ip_down, ip_up};
use crate::LinkError;

const NET: &str = "/sys/class/net";
/// `ARPHRD_CAN` of Linux' `if_arp.h`.
const TYPE_CAN: &str = "280";
const EOPNOTSUPP: i32 = 95;

/// Whether this kernel has CAN sockets and this process may open one.
pub fn check_sockets() -> Result<(), LinkError> {
    let link = "socketcan".to_owned();
    match CanSocket::open_iface(0) {
        Ok(_) => Ok(()),
        Err(e) if e.raw_os_error() == Some(crate::socketcan::EAFNOSUPPORT) => {
            Err(LinkError::NoCanInKernel { link })
        }
        Err(source) => {
            Err(LinkError::Permission { link, source, fix: crate::socketcan::SHARE_NETWORK })
        }
    }
}

/// Every CAN interface, by name.
pub fn list() -> Vec<Interface> {
    let entries = fs::read_dir(NET).into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    let mut interfaces = names.filter_map(|name| find(&name).ok()).collect::<Vec<_>>();
    interfaces.sort_by(|a, b| a.name.cmp(&b.name));
    interfaces
}

/// One CAN interface.
pub fn find(interface: &str) -> Result<Interface, LinkError> {
    if attribute(interface, "type").as_deref() != Some(TYPE_CAN) {
        let link = format!("socketcan:{interface}");
        return Err(LinkError::NoInterface { link, interface: interface.into() });
    }
    let details = open(interface)
        .and_then(|netlink| netlink.details().map_err(into_io))
        .map_err(|e| failed(interface, "asked how it is set", e, "ip -details link".into()))?;
    let queue = attribute(interface, "tx_queue_len").and_then(|text| text.parse().ok());
    Ok(described(interface, &details, queue.unwrap_or_default()))
}

/// Sets an interface and brings it up. One that is not there and is named `vcan…` is made.
///
/// An interface that is up with the same setup is left alone, so that nobody on the bus notices.
pub fn bring_up(interface: &str, setup: Setup) -> Result<Interface, LinkError> {
    check_sockets()?;
    if interface.starts_with("vcan") && !folder(interface).exists() {
        CanInterface::create_vcan(interface, None).map_err(|e| {
            let by_hand = format!("modprobe vcan && ip link add {interface} type vcan");
            failed(interface, "made", into_io(e), by_hand)
        })?;
    }
    let before = find(interface)?;
    let by_hand = || ip_up(interface, before.kind, setup);
    let failed = |e| failed(interface, "brought up", e, by_hand());
    let netlink = open(interface).map_err(failed)?;
    if before.queue_frames != setup.queue_frames {
        let file = folder(interface).join("tx_queue_len");
        fs::write(file, setup.queue_frames.to_string()).map_err(failed)?;
    }
    let is_set = before.kind != Kind::Controller
        || (before.bit_rate, before.restart_ms) == (Some(setup.bit_rate), Some(setup.restart_ms));
    if !is_set {
        if before.is_up {
            netlink.bring_down().map_err(|e| failed(into_io(e)))?;
        }
        netlink.set_bitrate(setup.bit_rate, None).map_err(|e| failed(into_io(e)))?;
        match netlink.set_restart_ms(setup.restart_ms).map_err(into_io) {
            // Some controllers cannot: then a bus-off needs `link down` and `link up`.
            Err(e) if e.raw_os_error() != Some(EOPNOTSUPP) => return Err(failed(e)),
            _ => {}
        }
    }
    if !before.is_up || !is_set {
        netlink.bring_up().map_err(|e| failed(into_io(e)))?;
    }
    find(interface)
}

/// Takes an interface down.
pub fn bring_down(interface: &str) -> Result<(), LinkError> {
    check_sockets()?;
    find(interface)?;
    open(interface)
        .and_then(|netlink| netlink.bring_down().map_err(into_io))
        .map_err(|e| failed(interface, "taken down", e, ip_down(interface)))
}

fn described(name: &str, details: &InterfaceDetails, queue_frames: u32) -> Interface {
    let InterfaceCanParams { bit_timing, bit_timing_const, state, restart_ms, .. } = &details.can;
    let kind = match (bit_timing_const, state) {
        (Some(_), _) => Kind::Controller,
        (None, Some(_)) => Kind::SerialLine,
        (None, None) => Kind::Virtual,
    };
    let is_controller = kind == Kind::Controller;
    let set = |timing: &socketcan::nl::CanBitTiming| Some(timing.bitrate).filter(|&rate| rate > 0);
    Interface {
        name: name.into(),
        kind,
        is_up: details.is_up,
        bit_rate: bit_timing.as_ref().and_then(set).filter(|_| is_controller),
        state: state.map(bus_state),
        restart_ms: restart_ms.filter(|_| is_controller),
        queue_frames,
    }
}

fn bus_state(state: CanState) -> BusState {
    match state {
        CanState::ErrorActive => BusState::ErrorActive,
        CanState::ErrorWarning => BusState::ErrorWarning,
        CanState::ErrorPassive => BusState::ErrorPassive,
        CanState::BusOff => BusState::BusOff,
        CanState::Stopped | CanState::Sleeping => BusState::Stopped,
    }
}

fn open(interface: &str) -> io::Result<CanInterface> {
    CanInterface::open(interface).map_err(into_io)
}

fn folder(interface: &str) -> PathBuf {
    Path::new(NET).join(interface)
}

fn attribute(interface: &str, name: &str) -> Option<String> {
    let text = fs::read_to_string(folder(interface).join(name)).ok()?;
    Some(text.trim().to_owned())
}

fn failed(interface: &str, action: &'static str, source: io::Error, by_hand: String) -> LinkError {
    LinkError::Interface { interface: interface.into(), action, source, by_hand }
}

/// The kernel's own error number where there is one.
fn into_io(error: socketcan::Error) -> io::Error {
    match error {
        socketcan::Error::Io(error) => error,
        socketcan::Error::Nl(error) => match error.errno() {
            Some(errno) => io::Error::from_raw_os_error(errno),
            None => io::Error::other(error),
        },
        other => io::Error::other(other.to_string()),
    }
}
