//! Messages that configure and query a device: postcard in an envelope with a CRC.
//!
//! The envelope is a sequence number (u8), the postcard bytes, and the CRC-32 of both (little endian). A
//! response carries the sequence number of its request. A device that receives the same request again,
//! because its response was lost, only sends the response again.
//!
//! An image is uploaded by `BeginImage`, by `ImageChunk` from offset 0 upwards without gaps, and by
//! `Activate`. Until `Activate` succeeds, the device uses its previous image.

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::transfer::Endpoint;
use crate::{Counters, NextCounters};

/// Segments that a device receives in one block. Its frame queue must hold a few more.
pub const BLOCK_SIZE: u8 = 64;
/// Longest part of an image in one request \[bytes\].
pub const MAX_CHUNK: usize = 1024;
/// Longest part of the image in use in one response \[bytes\].
pub const MAX_READ: usize = 256;
/// Longest request with its envelope \[bytes\].
pub const MAX_REQUEST: usize = MAX_CHUNK + 16;
/// Longest response with its envelope \[bytes\].
pub const MAX_RESPONSE: usize = 320;

/// Endpoint of the device.
pub type DeviceEndpoint = Endpoint<MAX_REQUEST, MAX_RESPONSE>;
/// Endpoint of the host.
pub type HostEndpoint = Endpoint<MAX_RESPONSE, MAX_REQUEST>;

/// Hash of the layout of these messages and of the process frames, so that nobody has to maintain a
/// version number. Host and device must agree on it before anything is armed.
pub const PROTOCOL_HASH: u64 = {
    use postcard_schema::key::Key;
    let messages = u64::from_le_bytes(Key::for_path::<(Request, Response)>("service").to_bytes());
    // The process frames, as `docs/cathforce.dbc` describes them; a test compares it with the code.
    let frames = include_bytes!("../../../docs/cathforce.dbc");
    let mut hash = messages;
    let mut i = 0;
    while i < frames.len() {
        // FNV-1a.
        hash = (hash ^ frames[i] as u64).wrapping_mul(0x100_0000_01B3);
        i += 1;
    }
    hash
};

/// A request of the host. `Hello` stays the first variant and unchanged, because host and device compare
/// their versions by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Request<'a> {
    /// Answered with [`Response::Hello`].
    Hello,
    /// Answered with [`Response::Status`].
    GetStatus,
    /// Begins an upload. An unfinished upload of another image is dropped. One of the same image, by
    /// length and CRC, is resumed: the next chunk is refused with the expected offset.
    BeginImage { len: u32, crc32: u32 },
    /// The next bytes of the image, at most [`MAX_CHUNK`].
    ImageChunk { offset: u32, bytes: &'a [u8] },
    /// The image is complete: the device checks it, uses it, and starts over at tick 0.
    Activate,
    /// Switches to ticks that SYNC frames grant, or to ticks by the clock.
    SetLockStep { on: bool },
    /// Resets counters and worst cases.
    ResetCounters,
    /// Answered with [`Response::ImageBytes`]: at most [`MAX_READ`] bytes of the image in use, from this
    /// offset on.
    ReadImage { offset: u32 },
    /// Answered with [`Response::Crash`].
    ReadCrash,
    /// Saves the image in use, so that the device boots with it.
    SaveImage,
    /// Answered with [`Response::Saved`].
    ReadSaved,
}

/// A response of the device. `Hello` stays the first variant and unchanged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Response<'a> {
    #[serde(borrow)]
    Hello(Hello<'a>),
    Status(Status),
    /// The request was done.
    Done,
    #[serde(borrow)]
    Refused(Refusal<'a>),
    /// Bytes of the image in use; empty past its end.
    #[serde(borrow)]
    ImageBytes(&'a [u8]),
    /// Why the device reset itself last; `None` if it has not since it was switched on.
    #[serde(borrow)]
    Crash(Option<Crash<'a>>),
    /// What the device found at its boot, or saved since.
    #[serde(borrow)]
    Saved(Saved<'a>),
}

/// The images that a device has saved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize, Schema)]
pub enum SavedState {
    /// Nothing has ever been saved.
    #[default]
    Empty,
    /// The newest one is good.
    Good,
    /// The newest one is damaged, was cut short, has failed its trials or is refused; the one before is used.
    Fallback,
    /// Something has been saved, and nothing of it can be used.
    Lost,
}

/// What a device has saved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize, Schema)]
pub struct Saved<'a> {
    pub state: SavedState,
    /// CRC-32 of the image that it boots with; 0 without one.
    pub image_crc32: u32,
    /// The device has not yet run long enough with that image to keep it. After a few boots in which it does
    /// not, it boots with the one before.
    pub on_trial: bool,
    /// Why it refused an image at its boot; empty if it did not.
    pub refused: &'a str,
}

/// Longest text of a [`Crash`] \[bytes\].
pub const MAX_CRASH_TEXT: usize = 120;

/// What a device wrote down before it reset itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize, Schema)]
pub struct Crash<'a> {
    /// Code of the fault.
    pub fault: u8,
    /// Resets by the device itself since it was switched on.
    pub resets: u32,
    /// Ticks since configuration.
    pub tick: u32,
    /// Time since the boot before \[µs\].
    pub time_us: u32,
    /// Where the processor was, and the return address there; 0 if unknown.
    pub program_counter: u32,
    pub link_register: u32,
    /// The processor's status of the fault, and the address that it concerns; 0 if none.
    pub status: u32,
    pub address: u32,
    /// Of a hang: the tasks that had not run, by bit. None of them: the tick itself.
    pub hung_tasks: u8,
    /// The message of a panic; names of the tasks that hung.
    pub text: &'a str,
}

/// Identity of the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Hello<'a> {
    /// Its [`PROTOCOL_HASH`].
    pub protocol_hash: u64,
    /// Hash of the device image's schema.
    pub image_schema_hash: u32,
    /// Version of the firmware; its build after a `+`, if known.
    pub firmware: &'a str,
    /// Name of the board.
    pub board: &'a str,
    /// The board can run in lock step.
    pub can_lock_step: bool,
    /// Longest image that fits \[bytes\].
    pub max_image_len: u32,
    /// Code of the mode, as in the HAPTIC frame.
    pub mode: u8,
    /// Counters that the host's next frames of [`crate::FROM_HOST`] must carry.
    pub next_counters: NextCounters,
}

/// Status of the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize, Schema)]
pub struct Status {
    /// Code of the mode, as in the HAPTIC frame.
    pub mode: u8,
    /// Code of the fault or of the ramp's cause; 0 for none.
    pub fault: u8,
    pub lock_step: bool,
    /// Ticks since configuration.
    pub tick: u32,
    /// Hash over all outputs of all ticks since configuration.
    pub digest: u32,
    /// CRC-32 of the image in use, computed by the device; 0 without an image.
    pub image_crc32: u32,
    pub load: Load,
    pub counters: Counters,
}

/// Cost of the ticks. Quantities that a board cannot measure are 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize, Schema)]
pub struct Load {
    /// Number of ticks that began late or not at all.
    pub missed_ticks: u32,
    /// Instructions of the most expensive tick.
    pub worst_instructions: u32,
    /// Processor cycles of the most expensive tick.
    pub worst_cycles: u32,
    /// Number of the most expensive tick.
    pub worst_tick: u32,
    /// Stack of the first tick since the counters were reset \[bytes\].
    pub tick_stack_bytes: u32,
    /// Ticks that ran into the next one.
    pub overruns: u32,
    /// Latest start of a tick after it was due \[ns\].
    pub latest_start_ns: u32,
    /// Largest use of the stack so far \[bytes\].
    pub stack_used_bytes: u32,
    /// Size of the stack \[bytes\].
    pub stack_size_bytes: u32,
}

/// Why a request was refused. Nothing has changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Refusal<'a> {
    /// Not a request of this protocol.
    Unknown,
    /// Output is armed or ramping down; disarm first.
    Armed,
    /// This board does not support it.
    Unsupported,
    /// There is no upload.
    NoUpload,
    /// There is no image in use.
    NoImage,
    /// The image is longer than the device's buffer.
    TooLong { capacity: u32 },
    /// A chunk leaves a gap, overlaps or exceeds the image; the next one must have this offset.
    Offset { expected: u32 },
    /// `Activate` came before the last byte.
    Incomplete { expected: u32, received: u32 },
    /// The received bytes differ from the announced ones.
    Crc { expected: u32, computed: u32 },
    /// The image is invalid at this byte; `field`: name of the number, if it is one.
    Image { offset: u32, reason: &'a str, field: &'a str },
    /// The flash failed, and what was saved before is there still.
    Flash { reason: &'a str },
}

/// Why bytes are refused as a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EnvelopeError {
    /// Too short for a sequence number and a CRC.
    Short,
    /// The CRC is wrong.
    Crc,
    /// The CRC is correct, but the bytes are not a message of ours, or bytes follow it.
    Meaning { sequence: u8 },
}

/// The CRC of images and envelopes: CRC-32 as in zip and Ethernet.
pub fn crc32(bytes: &[u8]) -> u32 {
    CRC32.checksum(bytes)
}

static CRC32: crc::Crc<u32, crc::Table<1>> =
    crc::Crc::<u32, crc::Table<1>>::new(&crc::CRC_32_ISO_HDLC);

/// [`crc32`] of bytes that come in pieces.
#[derive(Clone)]
pub struct RunningCrc32(crc::Digest<'static, u32, crc::Table<1>>);

impl Default for RunningCrc32 {
    fn default() -> Self {
        Self(CRC32.digest())
    }
}

impl RunningCrc32 {
    /// Takes the next bytes.
    pub fn add(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// The CRC of all bytes.
    pub fn value(self) -> u32 {
        self.0.finalize()
    }
}

/// Puts a message into its envelope; `None` if it does not fit into `N` bytes.
pub fn seal<M: Serialize, const N: usize>(sequence: u8, message: &M) -> Option<Vec<u8, N>> {
    let mut buffer = [0; N];
    let (first, rest) = buffer.split_first_mut()?;
    *first = sequence;
    let body = 1 + postcard::to_slice(message, rest).ok()?.len();
    let crc = crc32(buffer.get(..body)?);
    buffer.get_mut(body..body + 4)?.copy_from_slice(&crc.to_le_bytes());
    Vec::from_slice(buffer.get(..body + 4)?).ok()
}

/// Takes sequence number and message out of an envelope. No bytes may be left over.
pub fn open<'a, M: Deserialize<'a>>(bytes: &'a [u8]) -> Result<(u8, M), EnvelopeError> {
    let (body, crc) = bytes.split_last_chunk::<4>().ok_or(EnvelopeError::Short)?;
    let (&sequence, message) = body.split_first().ok_or(EnvelopeError::Short)?;
    if crc32(body) != u32::from_le_bytes(*crc) {
        return Err(EnvelopeError::Crc);
    }
    match postcard::take_from_bytes(message) {
        Ok((message, [])) => Ok((sequence, message)),
        _ => Err(EnvelopeError::Meaning { sequence }),
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::Counter;
    use proptest::prelude::*;
    use std::vec::Vec as StdVec;

    #[test]
    fn the_longest_messages_fit() {
        let chunk = Request::ImageChunk { offset: u32::MAX, bytes: &[0xFF; MAX_CHUNK] };
        assert!(seal::<_, MAX_REQUEST>(255, &chunk).is_some());

        let mut counters = Counters::default();
        Counter::ALL.iter().for_each(|&counter| counters.add(counter, u32::MAX));
        let load = Load {
            missed_ticks: u32::MAX,
            worst_instructions: u32::MAX,
            worst_cycles: u32::MAX,
            worst_tick: u32::MAX,
            tick_stack_bytes: u32::MAX,
            overruns: u32::MAX,
            latest_start_ns: u32::MAX,
            stack_used_bytes: u32::MAX,
            stack_size_bytes: u32::MAX,
        };
        let [tick, digest, image_crc32] = [u32::MAX; 3];
        let status = Status {
            mode: 7,
            fault: 255,
            lock_step: true,
            tick,
            digest,
            image_crc32,
            load,
            counters,
        };
        assert!(seal::<_, MAX_RESPONSE>(255, &Response::Status(status)).is_some());

        let text = core::str::from_utf8(&[b'x'; MAX_CRASH_TEXT]).unwrap();
        let most = u32::MAX;
        let crash = Crash {
            fault: 255,
            resets: most,
            tick: most,
            time_us: most,
            program_counter: most,
            link_register: most,
            status: most,
            address: most,
            hung_tasks: 255,
            text,
        };
        assert!(seal::<_, MAX_RESPONSE>(255, &Response::Crash(Some(crash))).is_some());

        let read = Response::ImageBytes(&[0xFF; MAX_READ]);
        assert!(seal::<_, MAX_RESPONSE>(255, &read).is_some());

        let reason = core::str::from_utf8(&[b'x'; 256]).unwrap();
        let refused = Response::Refused(Refusal::Image { offset: u32::MAX, reason, field: "" });
        assert!(seal::<_, MAX_RESPONSE>(255, &refused).is_some());
    }

    #[test]
    fn what_follows_a_message_makes_it_none() {
        let sealed: Vec<u8, 64> = seal(3, &Request::GetStatus).unwrap();
        assert_eq!(open(&sealed), Ok((3, Request::GetStatus)));
        let mut longer = StdVec::from(&sealed[..sealed.len() - 4]);
        longer.push(0);
        longer.extend(crc32(&longer).to_le_bytes());
        assert_eq!(open::<Request>(&longer), Err(EnvelopeError::Meaning { sequence: 3 }));
    }

    proptest! {
        #[test]
        fn p03_any_bytes_are_a_message_or_an_error(bytes: StdVec<u8>, checked: bool) {
            let mut bytes = bytes;
            if checked {
                bytes.extend(crc32(&bytes).to_le_bytes());
            }
            if let Ok((sequence, message)) = open::<Request>(&bytes) {
                // postcard reads some numbers in more than one spelling, so only the meaning
                // comes back.
                let again = seal::<_, MAX_REQUEST>(sequence, &message).unwrap();
                prop_assert_eq!(open(&again), Ok((sequence, message)));
            }
            let _ = open::<Response>(&bytes);
        }

        #[test]
        fn every_flipped_bit_is_found(offset: u32, bytes in prop::collection::vec(any::<u8>(), 0..40), flip in 0usize..10_000) {
            let mut sealed: Vec<u8, 64> = seal(9, &Request::ImageChunk { offset, bytes: &bytes }).unwrap();
            let (byte, bit) = (flip / 8 % sealed.len(), flip % 8);
            sealed[byte] ^= 1 << bit;
            prop_assert_eq!(open::<Request>(&sealed), Err(EnvelopeError::Crc));
        }
    }
}
