//! SLCAN over anything that carries bytes.

use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use cathforce_bus::Frame;
use cathforce_bus::slcan::{self, Decoder, Line};

use crate::reader::{READ_TIMEOUT, Reader, is_timeout};
use crate::{Link, LinkError};

const CONNECT_TIMEOUT: Duration = Duration::from_secs(3);

/// Close, 1 Mbit/s, open; the leading carriage return ends whatever was cut off before.
pub(crate) const OPEN_CHANNEL: &[u8] = b"\rC\rS8\rO\r";

/// A link over a stream of SLCAN lines.
pub struct Slcan {
    name: String,
    reader: Reader<Frame>,
    writer: Box<dyn Write + Send>,
    unsent: Vec<u8>,
    openings: Arc<AtomicU32>,
}

impl Slcan {
    /// A link over both halves of a stream, whose channel is opened here.
    ///
    /// A read of `source` must come back after a time-out, and give 0 bytes only at the end
    /// of the stream.
    pub fn new(
        name: &str,
        mut source: impl Read + Send + 'static,
        mut sink: impl Write + Send + 'static,
    ) -> Result<Self, LinkError> {
        sink.write_all(OPEN_CHANNEL).map_err(|e| LinkError::lost(name, e))?;
        let mut decoder = Decoder::default();
        let mut buffer = [0; 4096];
        let openings = Arc::new(AtomicU32::new(0));
        let opened = Arc::clone(&openings);
        let reader = Reader::spawn(move || match source.read(&mut buffer) {
            Ok(0) => Err(io::Error::new(io::ErrorKind::UnexpectedEof, "closed by the other side")),
            Ok(n) => Ok(buffer[..n]
                .iter()
                .filter_map(|&byte| decoder.push(byte))
                // Answers need no attention, and a broken frame is noticed as a lost one.
                .filter_map(|line| match line {
                    Line::Frame(frame) => Some(frame),
                    Line::Open => {
                        opened.fetch_add(1, Ordering::Relaxed);
                        None
                    }
                    _ => None,
                })
                .collect()),
            Err(e) if is_timeout(&e) => Ok(Vec::new()),
            Err(e) => Err(e),
        });
        let (writer, unsent) = (Box::new(sink), Vec::new());
        Ok(Self { name: name.into(), reader, writer, unsent, openings })
    }

    /// Over TCP. `name` is what messages call the link.
    pub fn connect(name: &str, host_and_port: &str) -> Result<Self, LinkError> {
        let failed = |source: io::Error| LinkError::Open {
            link: name.into(),
            check: match source.kind() {
                io::ErrorKind::ConnectionRefused => {
                    "that the other side is running and listens on this port; `cathforce link \
                     serve slcan:listen:PORT` is a device that does"
                }
                io::ErrorKind::TimedOut => "that the host is on and no firewall is in between",
                _ => "the host's name and that the network reaches it",
            },
            source,
        };
        let mut last = io::Error::new(io::ErrorKind::NotFound, "the host has no address");
        for address in host_and_port.to_socket_addrs().map_err(failed)? {
            match TcpStream::connect_timeout(&address, CONNECT_TIMEOUT) {
                Ok(stream) => {
                    stream.set_nodelay(true).map_err(failed)?;
                    stream.set_read_timeout(Some(READ_TIMEOUT)).map_err(failed)?;
                    return Self::new(name, stream.try_clone().map_err(failed)?, stream);
                }
                Err(e) => last = e,
            }
        }
        Err(failed(last))
    }

    /// Over a serial port, which this program was built without.
    #[cfg(not(feature = "hardware"))]
    pub fn open_serial(name: &str, _: &str, _: u32) -> Result<Self, LinkError> {
        Err(LinkError::LeftOut { link: name.into() })
    }

    /// Over a serial port.
    #[cfg(feature = "hardware")]
    pub fn open_serial(name: &str, path: &str, baud: u32) -> Result<Self, LinkError> {
        let failed = |e: serialport::Error| {
            let (link, source) = (name.into(), io::Error::from(e));
            if source.kind() == io::ErrorKind::PermissionDenied {
                let fix = "Join the group that owns the port: `sudo usermod -aG dialout $USER`, then log in again";
                return LinkError::Permission { link, source, fix };
            }
            let check =
                "that the adapter is plugged in (`ls /dev/tty*`) and no other program uses it";
            LinkError::Open { link, source, check }
        };
        let port = serialport::new(path, baud).timeout(READ_TIMEOUT).open().map_err(failed)?;
        Self::new(name, port.try_clone().map_err(failed)?, port)
    }
}

impl Slcan {
    /// Sends any bytes among the frames, as a broken host might.
    pub fn send_bytes(&mut self, bytes: &[u8]) {
        self.unsent.extend_from_slice(bytes);
    }

    /// How often the other side has asked to open the channel. A device does after bus-off.
    pub fn openings(&self) -> u32 {
        self.openings.load(Ordering::Relaxed)
    }
}

impl Link for Slcan {
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.unsent.extend_from_slice(&slcan::encode(frame));
        Ok(())
    }

    fn flush(&mut self) -> Result<(), LinkError> {
        if self.unsent.is_empty() {
            return Ok(());
        }
        let sent = self.writer.write_all(&self.unsent).and_then(|()| self.writer.flush());
        self.unsent.clear();
        sent.map_err(|e| LinkError::lost(&self.name, e))
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>, LinkError> {
        self.flush()?;
        self.reader.receive(timeout).map_err(|e| LinkError::lost(&self.name, e))
    }

    fn dropped(&self) -> u64 {
        self.reader.dropped()
    }

    fn name(&self) -> &str {
        &self.name
    }
}
