//! Vector's BLF, the binary log of CANoe and CANalyzer.
//!
//! A file is a heading and objects, most of them in containers that zlib packs. An object begins with
//! `LOBJ`, the length of its heading, its own length and its type. An object may go on in the next
//! container.

use std::io::Read as _;

use cathforce_bus::Frame;

use super::log::{BusLog, LogError, LogFormat};

pub(super) const MAGIC: &[u8] = b"LOGG";
const OBJECT: &[u8] = b"LOBJ";
/// Signature, length of the heading, its version, length of the object, type.
const BASE_BYTES: usize = 16;
/// Flags, client and version, time.
const HEADING_BYTES: usize = BASE_BYTES + 16;
/// Where the file's heading has its beginning: year, month, day of the week, day, hour, minute, second,
/// millisecond.
const STARTED_AT: usize = 40;
const CONTAINER: u32 = 10;
/// A classic frame in its two versions, and what is a frame of another kind: CAN FD and errors.
const FRAMES: [u32; 2] = [1, 86];
const OTHER_FRAMES: [u32; 5] = [2, 73, 100, 101, 104];
const REMOTE: u8 = 0x80;
/// The unit of times is 10 µs or 1 ns.
const TENS_OF_MICROSECONDS: u32 = 1;
/// Largest container that is unpacked.
const LARGEST: u64 = 1 << 28;

/// Reads a log. A container that is damaged is left out with a remark, and so is an object that is cut.
pub(super) fn read(bytes: &[u8]) -> Result<BusLog, LogError> {
    let mut log = BusLog::new(LogFormat::Blf);
    let wrong =
        |problem: &str| LogError { line: 1, problem: problem.into(), fix: "copy the file again" };
    let heading = u32_at(bytes, 4).map(|length| length as usize);
    let start = heading.filter(|length| (STARTED_AT..=bytes.len()).contains(length));
    let start = start.ok_or_else(|| wrong("the file is shorter than its heading"))?;
    log.started_ns = started_ns(bytes).unwrap_or_default();
    let mut records = 0;
    // What is left of the last container: the beginning of an object.
    let mut rest = Vec::new();
    let mut at = start;
    while let Some((kind, object)) = next_object(bytes, &mut at) {
        if kind != CONTAINER {
            records += 1;
            take(&mut log, records, kind, object);
            continue;
        }
        match unpacked(object) {
            Ok(inside) => rest.extend(inside),
            Err(cause) => {
                let byte = at.saturating_sub(object.len());
                log.remarks
                    .push(format!("the container at byte {byte} is damaged and left out: {cause}"));
                rest.clear();
                continue;
            }
        }
        let mut inner = 0;
        while let Some((kind, object)) = next_object(&rest, &mut inner) {
            records += 1;
            take(&mut log, records, kind, object);
        }
        rest.drain(..inner.min(rest.len()));
    }
    if at + OBJECT.len() < bytes.len() || rest.len() > OBJECT.len() {
        log.remarks
            .push(format!("the file is cut off behind record {records}; the rest is left out"));
    }
    match log.frames.is_empty() && records == 0 {
        true => Err(wrong("no record of the file can be read")),
        false => Ok(log),
    }
}

/// The next whole object from `at` on: its type and all of it. `at` stays where an object is cut.
fn next_object<'a>(bytes: &'a [u8], at: &mut usize) -> Option<(u32, &'a [u8])> {
    let rest = bytes.get(*at..)?;
    // Objects are filled up to four bytes; damage is passed over to the next signature.
    let found = rest.windows(OBJECT.len()).position(|window| window == OBJECT)?;
    let begins = *at + found;
    let length = u32_at(bytes, begins + 8)? as usize;
    let object = bytes.get(begins..begins.checked_add(length)?);
    let Some(object) = object.filter(|object| object.len() >= BASE_BYTES) else {
        *at = begins;
        return None;
    };
    *at = begins + length;
    Some((u32_at(object, 12)?, object))
}

fn unpacked(container: &[u8]) -> Result<Vec<u8>, String> {
    let field = container.get(BASE_BYTES..BASE_BYTES + 16).ok_or("it is too short")?;
    let data = &container[BASE_BYTES + 16..];
    match u16::from_le_bytes([field[0], field[1]]) {
        0 => Ok(data.to_vec()),
        2 => {
            let size = u64::from(u32_at(field, 8).unwrap_or_default());
            if size > LARGEST {
                return Err(format!("it would have {size} bytes"));
            }
            let mut bytes = Vec::new();
            let decoder = flate2::read::ZlibDecoder::new(data);
            decoder.take(size + 1).read_to_end(&mut bytes).map_err(|e| e.to_string())?;
            match bytes.len() as u64 == size {
                true => Ok(bytes),
                false => Err(format!("it has not the {size} bytes that it states")),
            }
        }
        other => Err(format!("it is packed in the way {other}, which is not known")),
    }
}

/// Takes an object if it is a frame.
fn take(log: &mut BusLog, record: usize, kind: u32, object: &[u8]) {
    let is_frame = FRAMES.contains(&kind);
    if !is_frame && !OTHER_FRAMES.contains(&kind) {
        return;
    }
    let found = || {
        let heading = usize::from(u16_at(object, 4)?);
        let flags = u32_at(object, BASE_BYTES)?;
        let time = u64::from_le_bytes(*object.get(BASE_BYTES + 8..)?.first_chunk()?);
        let unit_ns = if flags == TENS_OF_MICROSECONDS { 10_000 } else { 1 };
        let at_ns = time.checked_mul(unit_ns)?.checked_add(log.started_ns)?;
        let body = object.get(heading.max(HEADING_BYTES)..)?;
        Some((at_ns, u16_at(body, 0)?, if is_frame { Some(frame(body)?) } else { None }))
    };
    match found() {
        Some((at_ns, channel, frame)) => {
            log.push(record, at_ns, &channel.to_string(), frame.flatten());
        }
        None => log.remarks.push(format!("record {record} is no whole frame and is left out")),
    }
}

/// The frame of a body; `Some(None)` for a remote one. The identifier is marked as ours are.
fn frame(body: &[u8]) -> Option<Option<Frame>> {
    let &[flags, length] = body.get(2..4)? else { return None };
    let id = u32_at(body, 4)?;
    if flags & REMOTE != 0 {
        return Some(None);
    }
    let data = body.get(8..8 + usize::from(length.min(8)))?;
    Frame::new(id, data).map(Some)
}

/// The beginning of the log, as if its time were that of Greenwich: the file does not say where it was.
fn started_ns(bytes: &[u8]) -> Option<u64> {
    let field = |k: usize| u16_at(bytes, STARTED_AT + 2 * k).map(u64::from);
    let (year, month, day) = (field(0)?, field(1)?, field(3)?);
    if !(1970..2200).contains(&year) || !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    // Days of the civil calendar, with years that begin in March so that leap days come last.
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let days = 365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + day - 1;
    const DAYS_TO_1970: u64 = 719_468;
    let seconds = ((days - DAYS_TO_1970) * 24 + field(4)?) * 3600 + field(5)? * 60 + field(6)?;
    Some(seconds * 1_000_000_000 + field(7)? * 1_000_000)
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    bytes.get(at..)?.first_chunk().map(|bytes| u16::from_le_bytes(*bytes))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..)?.first_chunk().map(|bytes| u32::from_le_bytes(*bytes))
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use super::*;

    fn object(kind: u32, time_ns: u64, body: &[u8]) -> Vec<u8> {
        let length = (HEADING_BYTES + body.len()) as u32;
        let mut object = OBJECT.to_vec();
        object.extend((HEADING_BYTES as u16).to_le_bytes());
        object.extend(1_u16.to_le_bytes());
        object.extend(length.to_le_bytes());
        object.extend(kind.to_le_bytes());
        object.extend(2_u32.to_le_bytes());
        object.extend([0; 4]);
        object.extend(time_ns.to_le_bytes());
        object.extend(body);
        object.resize(object.len().next_multiple_of(4), 0);
        object
    }

    fn body(channel: u16, flags: u8, id: u32, data: &[u8]) -> Vec<u8> {
        let mut body = channel.to_le_bytes().to_vec();
        body.extend([flags, data.len() as u8]);
        body.extend(id.to_le_bytes());
        body.extend(data);
        body.resize(16, 0);
        body
    }

    fn container(inside: &[u8]) -> Vec<u8> {
        let mut packer = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
        packer.write_all(inside).unwrap();
        let packed = packer.finish().unwrap();
        let mut container = OBJECT.to_vec();
        container.extend((BASE_BYTES as u16).to_le_bytes());
        container.extend(1_u16.to_le_bytes());
        container.extend(((BASE_BYTES + 16 + packed.len()) as u32).to_le_bytes());
        container.extend(CONTAINER.to_le_bytes());
        container.extend([2, 0, 0, 0, 0, 0, 0, 0]);
        container.extend((inside.len() as u32).to_le_bytes());
        container.extend([0; 4]);
        container.extend(packed);
        container.resize(container.len().next_multiple_of(4), 0);
        container
    }

    /// Frames over two containers, the second of which begins within an object.
    fn log() -> Vec<u8> {
        let objects = [
            object(1, 1_000_000, &body(1, 0, 0x123, &[1, 0xFF])),
            object(86, 2_000_000, &body(1, 0, 0x98FF_50E5, &[0])),
            object(100, 3_000_000, &body(2, 0, 0x123, &[0])),
            object(86, 4_000_000, &body(2, 0, 0x124, &[7; 8])),
        ]
        .concat();
        let mut file = MAGIC.to_vec();
        file.extend(144_u32.to_le_bytes());
        file.resize(STARTED_AT, 0);
        for field in [2023_u16, 3, 3, 15, 12, 0, 0, 0] {
            file.extend(field.to_le_bytes());
        }
        file.resize(144, 0);
        let (first, second) = objects.split_at(70);
        file.extend(container(first));
        file.extend(container(second));
        file
    }

    #[test]
    fn frames_are_read_over_the_borders_of_containers() {
        let log = BusLog::read(&log()).unwrap();
        assert_eq!((log.format, log.remarks.as_slice()), (LogFormat::Blf, &[][..]));
        assert_eq!(log.started_ns, 1_678_881_600_000_000_000);
        let found = log.frames.iter().map(|logged| (logged.at_ns - log.started_ns, logged.frame));
        let expected = [
            (1_000_000, Frame::new(0x123, &[1, 0xFF])),
            (2_000_000, Frame::new(0x98FF_50E5, &[0])),
            (3_000_000, None),
            (4_000_000, Frame::new(0x124, &[7; 8])),
        ];
        assert_eq!(found.collect::<Vec<_>>(), expected);
        assert_eq!(log.channels, ["1", "2"]);
    }

    #[test]
    fn what_is_damaged_or_cut_is_left_out_and_said() {
        let whole = log();
        let mut damaged = whole.clone();
        damaged[144 + BASE_BYTES + 16 + 5] ^= 0xFF;
        let found = BusLog::read(&damaged).unwrap();
        assert!(found.remarks[0].contains("container at byte 144"), "{:?}", found.remarks);
        let cut = BusLog::read(&whole[..whole.len() - 10]).unwrap();
        assert!(cut.frames.len() < 4 && cut.remarks[0].contains("cut off"), "{:?}", cut.remarks);
        assert!(BusLog::read(&whole[..60]).is_err());
        for length in (0..whole.len()).step_by(7) {
            let _ = BusLog::read(&whole[..length]);
        }
        // Any byte may be any other: no panic, and no more frames than there were.
        for at in 0..whole.len() {
            for flip in [0x01, 0x80, 0xFF] {
                let mut damaged = whole.clone();
                damaged[at] ^= flip;
                let frames = BusLog::read(&damaged).map_or(0, |log| log.frames.len());
                assert!(frames <= 4, "byte {at}: {frames}");
            }
        }
    }
}
