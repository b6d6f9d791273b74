//! The decoders of the bus.

use std::time::Duration;

use cathforce_bus::master::{Collector, Drive, Master, Place, Selector, Signal};
use cathforce_bus::service::{self, HostEndpoint, Request, Response};
use cathforce_bus::slcan::{Decoder, Line};
use cathforce_bus::{Counter, Counters, EXTENDED, Frame, Id, Process, crc8};
use cathforce_device::ControlLoop;
use cathforce_link::{Link as _, Sim};

/// A byte of the input after the other; zeros past its end.
pub struct Bytes<'a>(pub &'a [u8]);

impl Bytes<'_> {
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn next(&mut self) -> u8 {
        let (first, rest) = self.0.split_first().unwrap_or((&0, &[]));
        self.0 = rest;
        *first
    }

    pub fn array<const N: usize>(&mut self) -> [u8; N] {
        std::array::from_fn(|_| self.next())
    }
}

/// A frame: identifier, length and checksum as they come, or the checksum put right.
pub fn frame(bytes: &mut Bytes<'_>) -> Option<Frame> {
    let [low, high, len] = bytes.array();
    // Some have 29 bits, of which these are the lowest.
    let mark = if high & 0x40 != 0 { EXTENDED } else { 0 };
    let id = u32::from(u16::from_le_bytes([low, high & 0x7])) | mark;
    let mut data: [u8; 8] = bytes.array();
    if high & 0x80 != 0 {
        let [body @ .., _] = data;
        data[7] = crc8(id, body);
    }
    Frame::new(id, &data[..usize::from(len % 9)])
}

/// Exactly one counter rises for each frame, and what is decoded is encoded to the same bytes.
pub fn frames(data: &[u8]) {
    let mut bytes = Bytes(data);
    let mut control = ControlLoop::new();
    let mut endpoint = HostEndpoint::new(Id::ServiceRequest.raw(), 0);
    while !bytes.is_empty() {
        let Some(frame) = frame(&mut bytes) else { continue };
        endpoint.receive(&frame, &mut Counters::default());
        control.on_frame(&frame);
        let payload = frame.data().get(..6).and_then(|payload| <[u8; 6]>::try_from(payload).ok());
        if let Some((id, payload)) = Id::from_raw(frame.id()).zip(payload)
            && let Some(process) = Process::decode(id, payload)
        {
            let again = Process::decode(id, process.payload());
            assert_eq!(again, Some(process), "{frame:?}");
        }
    }
    control.tick(None, None);
}

/// A line ends where it ends, whatever stands in it, and the next one is read.
pub fn slcan(data: &[u8]) {
    let mut decoder = Decoder::default();
    for &byte in data {
        decoder.push(byte);
    }
    decoder.push(b'\r');
    let read = b"t1002AABB\r".iter().filter_map(|&byte| decoder.push(byte)).collect::<Vec<_>>();
    let expected = Frame::new(0x100, &[0xAA, 0xBB]).map(Line::Frame);
    assert_eq!(read.first(), expected.as_ref());
}

/// Messages with a right checksum, in segments: the device answers or stays silent, and still answers
/// `Hello`.
pub fn service(data: &[u8]) {
    let _ = service::open::<Request<'_>>(data);
    let _ = service::open::<Response<'_>>(data);
    let mut sim = Sim::in_lock_step();
    for part in data.split(|&byte| byte == b'\n').take(16) {
        let longest = part.len().min(service::MAX_REQUEST - 4);
        let mut message = part.get(..longest).unwrap_or(part).to_vec();
        message.extend(service::crc32(&message).to_le_bytes());
        let _ = service::open::<Request<'_>>(&message);
        let _ = service::open::<Response<'_>>(&message);
        send(&mut sim, &message);
    }
    // Two of them: the first may take the number of the message before, which is then answered again.
    let mut hello = |sequence| {
        let request = service::seal::<_, 16>(sequence, &Request::Hello).expect("it is short");
        send(&mut sim, &request).expect("the device answers")
    };
    hello(0xA5);
    let answer = hello(0x5A);
    let (_, answer) = service::open::<Response<'_>>(&answer).expect("it is whole");
    assert!(matches!(answer, Response::Hello(_)), "{answer:?}");
}

/// Sends a message and gives the answer, if there is one.
fn send(sim: &mut Sim, message: &[u8]) -> Option<Vec<u8>> {
    /// More than the segments of the longest message and its answer.
    const MOST_STEPS: u32 = 2000;
    let mut endpoint = HostEndpoint::new(Id::ServiceRequest.raw(), 0);
    endpoint.send(message).ok()?;
    let mut answer = None;
    for _ in 0..MOST_STEPS {
        let next = endpoint.next_frame(0);
        if let Some(frame) = &next {
            sim.send(frame).expect("in process");
        }
        let received = sim.receive(Duration::ZERO).expect("in process");
        if let Some(frame) = &received
            && Id::from_raw(frame.id()) == Some(Id::ServiceResponse)
        {
            let whole = endpoint.receive(frame, &mut Counters::default());
            answer = whole.map(<[u8]>::to_vec).or(answer);
        }
        if next.is_none() && received.is_none() {
            break;
        }
    }
    answer
}

/// A layout that passes its check reads any frame without a panic, and what it writes it reads back.
pub fn master(data: &[u8]) {
    let mut bytes = Bytes(data);
    let mut place = || {
        let [low, high, start_bit, bits, flags] = bytes.array();
        let scale = f32::from_le_bytes(bytes.array());
        let offset = f32::from_le_bytes(bytes.array());
        let (big_endian, signed, float) = (flags & 1 != 0, flags & 2 != 0, flags & 32 != 0);
        let signal = Signal { start_bit, bits, big_endian, signed, float, scale, offset };
        let selector = (flags & 64 != 0).then(|| {
            let [start_bit, bits, value] = bytes.array();
            Selector { start_bit, bits, big_endian, value: value.into() }
        });
        let mark = if flags & 128 != 0 { EXTENDED } else { 0 };
        let id = u32::from(u16::from_le_bytes([low, high])) | mark;
        (Place { id, signal, selector }, flags)
    };
    let (insertion, flags) = place();
    let (rotation, _) = place();
    let held = (flags & 4 != 0).then(|| place().0);
    let grip = (flags & 8 != 0).then(|| place().0);
    let drive = Drive { insertion, rotation, held };
    let guidewire = (flags & 16 != 0).then_some(drive);
    let master = Master { catheter: Some(drive), guidewire, grip };
    if master.validate().is_err() {
        return;
    }
    let mut frame = [0; 8];
    insertion.signal.write(0.0, &mut frame);
    let read = match insertion.signal.read(&frame) {
        Ok(read) => read,
        // Scale and offset are finite, and their sum may not be.
        Err(counter) => return assert_eq!(counter, Counter::BadValue, "a whole frame"),
    };
    let mut again = [0; 8];
    insertion.signal.write(f64::from(read), &mut again);
    assert!(read.is_finite() && insertion.signal.read(&again) != Err(Counter::WrongLength));
    let mut collector = Collector::new(master);
    while !bytes.is_empty() {
        let [which, len] = bytes.array();
        let ids = [insertion.id, rotation.id, held.map_or(0, |place| place.id), 0x7FF];
        let data: [u8; 8] = bytes.array();
        let id = ids[usize::from(which % 4)];
        if let Some(frame) = Frame::new(id, &data[..usize::from(len % 9)]) {
            collector.take(&frame);
            collector.catheter();
            collector.guidewire();
        }
    }
}
