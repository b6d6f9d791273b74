//! A CAN interface of Linux.

use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use cathforce_bus::{EXTENDED, Frame, MAX_EXTENDED_ID};
use socketcan::{
    CanFrame, CanSocket, EmbeddedFrame, ExtendedId, Frame as _, Id as CanId, Socket, SocketOptions,
    StandardId,
};

use crate::reader::{READ_TIMEOUT, Reader, is_timeout};
use crate::{Link, LinkError};

/// How long a full transmit queue may stay full.
const SEND_TIMEOUT: Duration = Duration::from_millis(500);

// Numbers of Linux (`errno.h`), the same on every architecture that Rust runs on but MIPS
// and SPARC.
const ENODEV: i32 = 19;
pub(crate) const EAFNOSUPPORT: i32 = 97;
const ENETDOWN: i32 = 100;
const ENOBUFS: i32 = 105;

/// What helps where sockets are not permitted.
pub(crate) const SHARE_NETWORK: &str =
    "Inside a container, share the host's network (`--network host`)";

/// A raw CAN socket.
pub(crate) struct SocketCan {
    name: String,
    interface: String,
    socket: Arc<CanSocket>,
    /// Frames, and when the kernel got them.
    reader: Reader<(Frame, SystemTime)>,
    waited: Option<Duration>,
}

impl SocketCan {
    pub(crate) fn open(name: &str, interface: &str) -> Result<Self, LinkError> {
        let failed = |source: io::Error| {
            let (link, interface) = (name.to_owned(), interface.to_owned());
            match source.raw_os_error() {
                Some(EAFNOSUPPORT) => LinkError::NoCanInKernel { link },
                Some(ENODEV) => LinkError::NoInterface { link, interface },
                Some(ENETDOWN) => LinkError::InterfaceDown { link, interface },
                _ if source.kind() == io::ErrorKind::PermissionDenied => {
                    LinkError::Permission { link, source, fix: SHARE_NETWORK }
                }
                _ => {
                    LinkError::Open { link, source, check: "the interface with `ip -details link`" }
                }
            }
        };
        // On every interface first: by name, a kernel without CAN would blame the name.
        drop(CanSocket::open_iface(0).map_err(failed)?);
        let socket = CanSocket::open(interface).map_err(failed)?;
        socket.set_write_timeout(SEND_TIMEOUT).map_err(failed)?;
        socket.set_read_timeout(READ_TIMEOUT).map_err(failed)?;
        // Bus errors and loss of arbitration are for `ip -statistics link`, not for us.
        socket.set_error_filter_drop_all().map_err(failed)?;
        socket.set_recv_timestamp(true).map_err(failed)?;
        let socket = Arc::new(socket);
        let source = Arc::clone(&socket);
        let reader = Reader::spawn(move || match source.read_frame_with_timestamp() {
            Ok((frame, at)) => Ok(taken(&frame).map(|frame| (frame, at)).into_iter().collect()),
            Err(e) if is_timeout(&e) => Ok(Vec::new()),
            Err(e) => Err(e),
        });
        let (name, interface) = (name.into(), interface.into());
        Ok(Self { name, interface, socket, reader, waited: None })
    }

    fn error(&self, source: io::Error) -> LinkError {
        let (link, interface) = (self.name.clone(), self.interface.clone());
        match source.raw_os_error() {
            Some(ENETDOWN) => LinkError::InterfaceDown { link, interface },
            Some(ENODEV) => LinkError::NoInterface { link, interface },
            _ => LinkError::lost(&self.name, source),
        }
    }
}

/// Data frames, with identifiers of 11 and 29 bits.
fn taken(frame: &CanFrame) -> Option<Frame> {
    let CanFrame::Data(data) = frame else { return None };
    let mark = if data.is_extended() { EXTENDED } else { 0 };
    Frame::new(data.raw_id() | mark, data.data())
}

/// The identifier as the socket has it.
fn socket_id(frame: &Frame) -> Option<CanId> {
    let raw = frame.id() & MAX_EXTENDED_ID;
    match frame.is_extended() {
        true => ExtendedId::new(raw).map(CanId::Extended),
        false => StandardId::new(u16::try_from(raw).ok()?).map(CanId::Standard),
    }
}

impl Link for SocketCan {
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        let Some(raw) = socket_id(frame).and_then(|id| CanFrame::new(id, frame.data())) else {
            let unfit = io::Error::new(io::ErrorKind::InvalidInput, "not a classic CAN frame");
            return Err(self.error(unfit));
        };
        let started = Instant::now();
        loop {
            match self.socket.write_frame(&raw) {
                Ok(()) => return Ok(()),
                // The transmit queue is full.
                Err(e) if e.raw_os_error() == Some(ENOBUFS) || is_timeout(&e) => {
                    if started.elapsed() > SEND_TIMEOUT {
                        return Err(LinkError::Stuck { link: self.name.clone() });
                    }
                    std::thread::sleep(Duration::from_micros(100));
                }
                Err(e) => return Err(self.error(e)),
            }
        }
    }

    fn flush(&mut self) -> Result<(), LinkError> {
        Ok(())
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>, LinkError> {
        let received = self.reader.receive(timeout).map_err(|e| self.error(e))?;
        // The kernel's clock is the time of day, which somebody may have set back meanwhile.
        self.waited = received.and_then(|(_, at)| SystemTime::now().duration_since(at).ok());
        Ok(received.map(|(frame, _)| frame))
    }

    fn waited(&self) -> Option<Duration> {
        self.waited
    }

    fn dropped(&self) -> u64 {
        self.reader.dropped()
    }

    fn name(&self) -> &str {
        &self.name
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever this machine has, the interface does not exist; the message says what is
    /// missing and what to do.
    #[test]
    fn a_missing_interface_or_a_kernel_without_can_is_explained() {
        let error = SocketCan::open("socketcan:nope7", "nope7").err().unwrap();
        let text = error.to_string();
        match error {
            LinkError::NoInterface { .. } => {
                assert!(text.contains("cathforce link up nope7"), "{text}");
            }
            LinkError::NoCanInKernel { .. } => {
                assert!(text.contains("modprobe can can_raw"), "{text}");
                assert!(text.contains("slcan:"), "{text}");
            }
            other => panic!("{other}"),
        }
    }
}
