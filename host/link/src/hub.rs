//! A CAN bus without CAN: this program listens on a TCP port, and whoever connects joins the bus.
//!
//! Every member speaks SLCAN. As on CAN, a frame reaches every member but its sender, all members
//! see all frames in one order, and this program is a member itself. A member may join and leave
//! at any time. Nobody waits for a slow member: when [`MOST_WAITING`] frames wait for it, the next
//! ones are dropped for it alone, counted and reported.
//!
//! Lock step works over a hub, because SYNC frames and the frames of a tick keep their order. One
//! member alone may grant ticks, as on CAN.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use cathforce_bus::Frame;
use cathforce_bus::slcan::{self, ANSWER_DONE, ANSWER_ERROR, Decoder, Line, MAX_LINE};

use crate::reader::{READ_TIMEOUT, is_timeout};
use crate::remark::remark;
use crate::slcan::OPEN_CHANNEL;
use crate::{Link, LinkError};

/// Frames that may wait for one member: two seconds of a device that sends four in a tick.
const MOST_WAITING: usize = 8192;
/// Members of one bus; every one costs two threads.
const MOST_MEMBERS: usize = 32;
/// From one look for new members to the next.
const ACCEPT_EVERY: Duration = Duration::from_millis(10);
/// How long a member that does not read may delay the end of the hub.
const LAST_WRITES: Duration = Duration::from_millis(500);

/// The bus, and this program's own place on it.
pub struct Hub {
    name: String,
    shared: Arc<Shared>,
    unsent: Vec<Frame>,
}

struct Shared {
    bus: Mutex<Bus>,
    /// A frame has come for this program, or somebody has joined.
    news: Condvar,
}

#[derive(Default)]
struct Bus {
    members: Vec<Member>,
    /// For this program.
    inbox: VecDeque<Frame>,
    /// Members so far, and the next one's number.
    joined: u64,
    /// Frames that were dropped for anyone.
    dropped: u64,
    is_closed: bool,
}

struct Member {
    number: u64,
    address: SocketAddr,
    outbox: Arc<Condvar>,
    /// Whole lines.
    unwritten: Vec<u8>,
    waiting: usize,
    /// Frames dropped since its queue was full first, until it has caught up.
    dropping: u64,
    writer: Option<JoinHandle<()>>,
}

impl Hub {
    /// Listens on `host_and_port`, where port 0 is any free one, and waits until the first member
    /// has joined.
    pub fn open(name: &str, host_and_port: &str) -> Result<Self, LinkError> {
        let hub = Self::listen(name, host_and_port)?;
        let address = hub.name.trim_start_matches("slcan:listen:");
        let from_there = match address.parse::<SocketAddr>() {
            Ok(every) if every.ip().is_unspecified() => format!("HOST:{}", every.port()),
            _ => address.to_owned(),
        };
        remark(&format!(
            "waiting on {address} for the other side, which connects with `--link \
             slcan:tcp:{from_there}`; Ctrl-C ends it"
        ));
        let mut bus = hub.shared.lock();
        while bus.joined == 0 {
            bus = hub.shared.news.wait(bus).unwrap_or_else(PoisonError::into_inner);
        }
        drop(bus);
        Ok(hub)
    }

    /// The same without waiting.
    pub fn listen(name: &str, host_and_port: &str) -> Result<Self, LinkError> {
        let failed = |source| failed(name, source);
        let listener = TcpListener::bind(host_and_port).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        if !address.ip().is_loopback() {
            remark(&format!(
                "{address} can be reached from other computers: whoever connects can send frames \
                 to the device"
            ));
        }
        let shared = Arc::new(Shared { bus: Mutex::default(), news: Condvar::new() });
        let door = Arc::clone(&shared);
        std::thread::spawn(move || door.admit(&listener));
        Ok(Self { name: format!("slcan:listen:{address}"), shared, unsent: Vec::new() })
    }
}

/// Says now that a port cannot be listened on; nobody can connect.
pub(crate) fn check(name: &str, host_and_port: &str) -> Result<(), LinkError> {
    TcpListener::bind(host_and_port).map(drop).map_err(|source| failed(name, source))
}

fn failed(name: &str, source: io::Error) -> LinkError {
    let check = match source.kind() {
        io::ErrorKind::AddrInUse => {
            "that no other program listens on this port, or take another one; if a hub listens \
             there already, join it with slcan:tcp:HOST:PORT"
        }
        io::ErrorKind::PermissionDenied => "that the port is above 1023, which any user may take",
        _ => "that the address before the port is one of this computer's, such as 127.0.0.1",
    };
    LinkError::Open { link: name.into(), source, check }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Bus> {
        self.bus.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes in whoever connects until the hub is closed.
    fn admit(self: Arc<Self>, listener: &TcpListener) {
        while !self.lock().is_closed {
            match listener.accept() {
                // A connection that is gone already is nobody's loss.
                Ok((stream, address)) => drop(self.join(stream, address)),
                Err(_) => std::thread::sleep(ACCEPT_EVERY),
            }
        }
    }

    fn join(self: &Arc<Self>, stream: TcpStream, address: SocketAddr) -> io::Result<()> {
        stream.set_nonblocking(false)?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(READ_TIMEOUT))?;
        stream.set_write_timeout(Some(READ_TIMEOUT))?;
        let (source, mut sink) = (stream.try_clone()?, stream);
        // The other side may be an adapter, which says nothing until its channel is open.
        sink.write_all(OPEN_CHANNEL)?;
        let outbox = Arc::new(Condvar::new());
        let mut bus = self.lock();
        if bus.members.len() == MOST_MEMBERS {
            drop(bus);
            remark(&format!("{address} was turned away: {MOST_MEMBERS} are on the bus already"));
            return Ok(());
        }
        let number = bus.joined;
        bus.joined += 1;
        let (of_writer, ready) = (Arc::clone(self), Arc::clone(&outbox));
        let writer = std::thread::spawn(move || {
            of_writer.write(number, &ready, &mut sink);
            // The other side may be gone already.
            let _ = sink.shutdown(Shutdown::Write);
        });
        bus.members.push(Member {
            number,
            address,
            outbox,
            unwritten: Vec::new(),
            waiting: 0,
            dropping: 0,
            writer: Some(writer),
        });
        let members = bus.members.len();
        drop(bus);
        self.news.notify_all();
        let of_reader = Arc::clone(self);
        std::thread::spawn(move || of_reader.read(number, source));
        remark(&format!("{address} has joined the bus; {}", connected(members)));
        Ok(())
    }

    /// Reads a member's lines until it leaves.
    fn read(&self, number: u64, mut source: TcpStream) {
        let mut decoder = Decoder::default();
        let mut buffer = [0; 4096];
        loop {
            let read = match source.read(&mut buffer) {
                Ok(0) => break,
                Ok(n) => &buffer[..n],
                Err(e) if is_timeout(&e) => &[],
                Err(_) => break,
            };
            let (mut frames, mut answers) = (Vec::new(), Vec::new());
            for line in read.iter().filter_map(|&byte| decoder.push(byte)) {
                match line {
                    Line::Frame(frame) => frames.push(frame),
                    Line::Open | Line::Close | Line::BitRate(_) => answers.extend(ANSWER_DONE),
                    Line::Bad(_) => answers.extend(ANSWER_ERROR),
                    Line::Foreign | Line::Done | Line::Error | Line::BusOff(_) => {}
                }
            }
            let mut bus = self.lock();
            if bus.is_closed {
                break;
            }
            bus.answer(number, &answers);
            let slow = bus.put(Some(number), &frames);
            drop(bus);
            if !frames.is_empty() {
                self.news.notify_all();
            }
            report(&slow);
        }
        self.leave(number);
    }

    /// Writes what waits for a member, until it leaves or the hub is closed and nothing waits.
    fn write(&self, number: u64, ready: &Condvar, sink: &mut TcpStream) {
        loop {
            let mut bus = self.lock();
            let (lines, caught_up) = loop {
                let is_closed = bus.is_closed;
                let Some(member) = bus.member(number) else { return };
                if !member.unwritten.is_empty() {
                    member.waiting = 0;
                    let dropped = std::mem::take(&mut member.dropping);
                    let caught_up = (dropped > 0).then_some((member.address, dropped));
                    break (std::mem::take(&mut member.unwritten), caught_up);
                }
                if is_closed {
                    return;
                }
                bus = ready.wait(bus).unwrap_or_else(PoisonError::into_inner);
            };
            drop(bus);
            if let Some((address, dropped)) = caught_up {
                remark(&format!("{address} reads again; {dropped} frames to it were dropped"));
            }
            if self.write_all(sink, &lines).is_err() {
                return self.leave(number);
            }
        }
    }

    /// A write that a member takes no time for goes on until it does or the hub has closed.
    fn write_all(&self, sink: &mut TcpStream, mut lines: &[u8]) -> io::Result<()> {
        let mut closed_since = None;
        while !lines.is_empty() {
            match sink.write(lines) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(n) => lines = &lines[n..],
                Err(e) if is_timeout(&e) => {}
                Err(e) => return Err(e),
            }
            if self.lock().is_closed {
                let since = *closed_since.get_or_insert_with(Instant::now);
                if since.elapsed() > LAST_WRITES {
                    return Err(io::ErrorKind::TimedOut.into());
                }
            }
        }
        Ok(())
    }

    fn leave(&self, number: u64) {
        let mut bus = self.lock();
        let is_closed = bus.is_closed;
        let Some(at) = bus.members.iter().position(|member| member.number == number) else {
            return;
        };
        // While the hub closes, it waits for the writers itself.
        let member = bus.members.remove(at);
        let members = bus.members.len();
        drop(bus);
        member.outbox.notify_all();
        self.news.notify_all();
        if is_closed {
            return;
        }
        let dropped = match member.dropping {
            0 => String::new(),
            dropped => format!("; {dropped} frames to it were dropped"),
        };
        remark(&format!("{} has left the bus{dropped}; {}", member.address, connected(members)));
    }
}

fn connected(members: usize) -> String {
    match members {
        0 => "nobody is connected".into(),
        1 => "1 is connected".into(),
        members => format!("{members} are connected"),
    }
}

fn report(slow: &[SocketAddr]) {
    for address in slow {
        remark(&format!(
            "{address} reads too slowly: {MOST_WAITING} frames wait for it, the next ones are \
             dropped"
        ));
    }
}

impl Bus {
    fn member(&mut self, number: u64) -> Option<&mut Member> {
        self.members.iter_mut().find(|member| member.number == number)
    }

    /// Answers a member's commands, unless it reads none of the answers.
    fn answer(&mut self, number: u64, answers: &[u8]) {
        let Some(member) = self.member(number).filter(|_| !answers.is_empty()) else { return };
        if member.unwritten.len() < MOST_WAITING * MAX_LINE {
            member.unwritten.extend_from_slice(answers);
            member.outbox.notify_all();
        }
    }

    /// Puts frames on the bus; `from` is a member, or this program. Gives those who have just
    /// become too slow.
    fn put(&mut self, from: Option<u64>, frames: &[Frame]) -> Vec<SocketAddr> {
        let mut slow = Vec::new();
        if frames.is_empty() {
            return slow;
        }
        let lines: Vec<_> = frames.iter().map(slcan::encode).collect();
        for member in self.members.iter_mut().filter(|member| Some(member.number) != from) {
            let room = MOST_WAITING.saturating_sub(member.waiting).min(lines.len());
            member.unwritten.extend(lines[..room].iter().flatten());
            member.waiting += room;
            let dropped = (lines.len() - room) as u64;
            if dropped > 0 && member.dropping == 0 {
                slow.push(member.address);
            }
            member.dropping += dropped;
            self.dropped += dropped;
            member.outbox.notify_all();
        }
        if from.is_some() {
            let room = MOST_WAITING.saturating_sub(self.inbox.len()).min(frames.len());
            self.inbox.extend(&frames[..room]);
            self.dropped += (frames.len() - room) as u64;
        }
        slow
    }
}

impl Link for Hub {
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        if self.shared.lock().members.is_empty() {
            self.unsent.clear();
            return Err(LinkError::Alone { link: self.name.clone() });
        }
        self.unsent.push(*frame);
        Ok(())
    }

    fn flush(&mut self) -> Result<(), LinkError> {
        let slow = self.shared.lock().put(None, &self.unsent);
        self.unsent.clear();
        report(&slow);
        Ok(())
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>, LinkError> {
        self.flush()?;
        let deadline = Instant::now() + timeout;
        let mut bus = self.shared.lock();
        loop {
            if let Some(frame) = bus.inbox.pop_front() {
                return Ok(Some(frame));
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(None);
            }
            let woken = self.shared.news.wait_timeout(bus, left);
            (bus, _) = woken.unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn dropped(&self) -> u64 {
        self.shared.lock().dropped
    }

    fn name(&self) -> &str {
        &self.name
    }
}

impl Drop for Hub {
    /// What was sent is still written, as far as members take it.
    fn drop(&mut self) {
        // Nobody is told when nobody is there.
        let _ = self.flush();
        let mut bus = self.shared.lock();
        bus.is_closed = true;
        let writers: Vec<_> = bus.members.iter_mut().filter_map(|m| m.writer.take()).collect();
        bus.members.iter().for_each(|member| member.outbox.notify_all());
        drop(bus);
        for writer in writers {
            // It has nothing to say, not even that it panicked.
            let _ = writer.join();
        }
    }
}
