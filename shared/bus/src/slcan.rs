//! SLCAN: CAN frames as lines of text, over a UART or a socket.
//!
//! Lines end in a carriage return. `t` and `T` are data frames with ids of 11 and 29 bits, `r` and `R`
//! remote frames, `O` opens, `L` listens only, `C` closes, `S0`–`S8` set the bit rate. The device
//! answers `O`, `L`, `C`, `S` with a carriage return, and unknown commands with a bell. It does not
//! acknowledge frames: they are protected end to end, and acknowledgements would double the traffic.
//!
//! An adapter states its controller's error state by `s`, the state and both error counters, as Linux
//! reads it: `sb256256` is bus-off, `sa000000` is error active. [`REOPEN`] starts a controller again.

use heapless::Vec;

use crate::{Counter, EXTENDED, Frame, MAX_EXTENDED_ID};

/// Longest line: `T`, 8 digits of id, 1 of length, 16 of data, 4 of a time stamp.
pub const MAX_LINE: usize = 30;
/// Answer to a valid command.
pub const ANSWER_DONE: &[u8] = b"\r";
/// Answer to an invalid command.
pub const ANSWER_ERROR: &[u8] = b"\x07";
/// Closes the channel and opens it at 1 Mbit/s, by which a controller leaves bus-off.
pub const REOPEN: &[u8] = b"C\rS8\rO\r";

/// Meaning of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// A data frame.
    Frame(Frame),
    /// A remote frame, which this protocol has not.
    Foreign,
    /// `O` or `L`: open the channel.
    Open,
    /// `C`: close the channel.
    Close,
    /// `S`: set the bit rate to this preset; 8 is 1 Mbit/s.
    BitRate(u8),
    /// An answer to our command: a bare carriage return, `z` or `Z`.
    Done,
    /// `s`: the adapter's controller is bus-off (`true`), or takes part in the bus.
    BusOff(bool),
    /// An error as answer to our command: a bell.
    Error,
    /// An invalid line.
    Bad(BadLine),
}

/// Why a line is invalid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BadLine {
    /// It begins with an unknown command.
    Unknown,
    /// A known command, with invalid digits or a wrong length.
    Broken,
    /// Longer than [`MAX_LINE`].
    TooLong,
}

impl BadLine {
    /// Counter of this error.
    pub fn counter(self) -> Counter {
        match self {
            Self::Unknown => Counter::LineUnknown,
            Self::Broken => Counter::LineBroken,
            Self::TooLong => Counter::LineTooLong,
        }
    }
}

/// Splits a stream of bytes into lines.
#[derive(Clone, Debug, Default)]
pub struct Decoder {
    line: Vec<u8, MAX_LINE>,
    overlong: bool,
}

impl Decoder {
    /// Takes one byte; returns the line that it ends.
    pub fn push(&mut self, byte: u8) -> Option<Line> {
        match byte {
            b'\r' => {
                let line =
                    if self.overlong { Line::Bad(BadLine::TooLong) } else { parse(&self.line) };
                *self = Self::default();
                Some(line)
            }
            // A bell is an answer by itself; it also ends a truncated line.
            b'\x07' => {
                let cut_off = self.overlong || !self.line.is_empty();
                *self = Self::default();
                Some(if cut_off { Line::Bad(BadLine::Broken) } else { Line::Error })
            }
            // Some terminals send a line feed after the carriage return.
            b'\n' if self.line.is_empty() => None,
            _ => {
                self.overlong |= self.line.push(byte).is_err();
                None
            }
        }
    }
}

fn parse(line: &[u8]) -> Line {
    let Some((&command, rest)) = line.split_first() else {
        return Line::Done;
    };
    match (command, rest) {
        (b't', _) => data_frame(rest, 3).map_or(Line::Bad(BadLine::Broken), Line::Frame),
        (b'T', _) => data_frame(rest, 8).map_or(Line::Bad(BadLine::Broken), Line::Frame),
        (b'r', _) if is_remote(rest, 3) => Line::Foreign,
        (b'R', _) if is_remote(rest, 8) => Line::Foreign,
        (b'O' | b'L', []) => Line::Open,
        (b'C', []) => Line::Close,
        (b'S', [preset @ b'0'..=b'8']) => Line::BitRate(preset - b'0'),
        (b'z' | b'Z', []) => Line::Done,
        (b's', [state @ (b'a' | b'w' | b'p' | b'b'), counts @ ..])
            if counts.len() == 6 && counts.iter().all(u8::is_ascii_digit) =>
        {
            Line::BusOff(*state == b'b')
        }
        (b'r' | b'R' | b'O' | b'L' | b'C' | b'S' | b's' | b'z' | b'Z', _) => {
            Line::Bad(BadLine::Broken)
        }
        _ => Line::Bad(BadLine::Unknown),
    }
}

/// Parses id, length, data, and an optional time stamp of 4 digits. An id of 8 digits is one of 29 bits.
fn data_frame(digits: &[u8], id_digits: usize) -> Option<Frame> {
    let (id, rest) = digits.split_at_checked(id_digits)?;
    let (&len, rest) = rest.split_first()?;
    let (data, stamp) = rest.split_at_checked(2 * usize::from(hex(len)?))?;
    if !(stamp.is_empty() || stamp.len() == 4 && stamp.iter().all(|&d| hex(d).is_some())) {
        return None;
    }
    let mut id_value = 0;
    for &digit in id {
        id_value = id_value << 4 | u32::from(hex(digit)?);
    }
    if id_digits == 8 {
        // What does not fit into 29 bits is no frame, with the mark or without it.
        id_value = (id_value <= MAX_EXTENDED_ID).then_some(id_value | EXTENDED)?;
    }
    let mut bytes = Vec::<u8, 8>::new();
    let (pairs, _) = data.as_chunks::<2>();
    for &[high, low] in pairs {
        bytes.push(hex(high)? << 4 | hex(low)?).ok()?;
    }
    Frame::new(id_value, &bytes)
}

/// Checks the syntax of a remote frame, which has no data.
fn is_remote(digits: &[u8], id_digits: usize) -> bool {
    let Some((&len, rest)) = digits.get(id_digits..).and_then(<[u8]>::split_first) else {
        return false;
    };
    let has_length = hex(len).is_some_and(|len| len <= 8);
    has_length && matches!(rest.len(), 0 | 4) && digits.iter().all(|&d| hex(d).is_some())
}

fn hex(digit: u8) -> Option<u8> {
    match digit {
        b'0'..=b'9' => Some(digit - b'0'),
        b'a'..=b'f' => Some(digit - b'a' + 10),
        b'A'..=b'F' => Some(digit - b'A' + 10),
        _ => None,
    }
}

/// A frame's line, carriage return included.
pub fn encode(frame: &Frame) -> Vec<u8, MAX_LINE> {
    let digit = |value: u8| {
        let value = value & 0xF;
        if value < 10 { b'0' + value } else { b'A' + value - 10 }
    };
    let (command, digits) = if frame.is_extended() { (b'T', 8) } else { (b't', 3) };
    let id = frame.id() & MAX_EXTENDED_ID;
    let id = (0..digits).rev().map(|place| digit((id >> (4 * place)) as u8));
    let length = digit(frame.data().len() as u8);
    let data = frame.data().iter().flat_map(|&byte| [digit(byte >> 4), digit(byte)]);
    // Always fits: there are at most 1 + 8 + 1 + 16 + 1 characters.
    let line = [command].into_iter().chain(id).chain([length]).chain(data).chain([b'\r']);
    line.take(MAX_LINE).collect()
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::MAX_ID;
    use proptest::prelude::*;
    use std::vec::Vec as StdVec;

    fn lines(bytes: &[u8]) -> StdVec<Line> {
        let mut decoder = Decoder::default();
        bytes.iter().filter_map(|&byte| decoder.push(byte)).collect()
    }

    #[test]
    fn what_adapters_send_is_understood() {
        let frame = |id, data: &[u8]| Line::Frame(Frame::new(id, data).unwrap());
        assert_eq!(lines(b"C\rS8\rO\r"), [Line::Close, Line::BitRate(8), Line::Open]);
        assert_eq!(lines(b"t1002abCD\r"), [frame(0x100, &[0xAB, 0xCD])]);
        assert_eq!(lines(b"t1000\r\nt7FF11212ab\r"), [frame(0x100, &[]), frame(0x7FF, &[0x12])]);
        assert_eq!(lines(b"T000001002ABCD\r"), [frame(EXTENDED | 0x100, &[0xAB, 0xCD])]);
        assert_eq!(lines(b"r1004\rR000001008\r"), [Line::Foreign; 2]);
        assert_eq!(lines(b"\rz\r\x07"), [Line::Done, Line::Done, Line::Error]);
        let states = [b'b', b'a', b'w', b'p'].map(|state| {
            let line = [&[b's', state][..], b"128256\r"].concat();
            lines(&line)
        });
        assert_eq!(states.map(|lines| lines == [Line::BusOff(true)]), [true, false, false, false]);
    }

    #[test]
    fn what_is_no_line_is_told_apart() {
        let bad = |bytes| match lines(bytes)[..] {
            [Line::Bad(bad)] => bad,
            ref other => panic!("{other:?}"),
        };
        assert_eq!(bad(b"hello\r"), BadLine::Unknown);
        assert_eq!(bad(b"\xFF\x00\r"), BadLine::Unknown);
        for broken in [
            &b"t\r"[..],
            b"t10\r",
            b"t100\r",
            b"t1009112233445566778899\r",
            b"t1002ab\r",
            b"t1002abcdef\r",
            b"t1002abxy\r",
            b"t8000\r",
            b"tzzz0\r",
            b"T0000010\r",
            b"T200000000\r",
            b"T800001000\r",
            b"r10041122\x31\r",
            b"S9\r",
            b"Oh\r",
            b"sb12825\r",
            b"sx128256\r",
            b"t10\x07",
        ] {
            assert_eq!(bad(broken), BadLine::Broken, "{broken:?}");
        }
        let mut long = [b't'; 1000];
        long[999] = b'\r';
        assert_eq!(bad(&long), BadLine::TooLong);
        // What comes after is read as if nothing had been.
        let mut decoder = Decoder::default();
        let again = long.iter().chain(b"C\r").filter_map(|&byte| decoder.push(byte));
        assert_eq!(again.last(), Some(Line::Close));
    }

    proptest! {
        #[test]
        fn p03_any_bytes_end_in_as_many_lines_as_there_are_ends(bytes: StdVec<u8>) {
            let ends = bytes.iter().filter(|&&b| b == b'\r' || b == 7).count();
            prop_assert_eq!(lines(&bytes).len(), ends);
        }

        #[test]
        fn a_frame_survives_in_any_pieces_after_any_garbage(
            garbage: StdVec<u8>,
            id in prop_oneof![0..=MAX_ID, EXTENDED..=EXTENDED | MAX_EXTENDED_ID],
            data in prop::collection::vec(any::<u8>(), 0..=8)
        ) {
            let frame = Frame::new(id, &data).unwrap();
            let mut bytes = garbage;
            bytes.push(b'\r');
            bytes.extend_from_slice(&encode(&frame));
            prop_assert_eq!(lines(&bytes).pop(), Some(Line::Frame(frame)));
        }
    }
}
