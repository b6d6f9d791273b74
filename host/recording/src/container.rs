//! The records of an MCAP file, each held against its checksum.
//!
//! The envelope of a record (opcode, length, body) is parsed here and not by the library, so that every
//! fault can be reported with its byte, and so that what follows a damaged chunk can still be read.

use std::borrow::Cow;
use std::io::Read as _;
use std::ops::Range;

use mcap::records::{ChunkHeader, Record};

/// Where a recorder was killed; everything before is complete.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cut {
    /// First byte that does not belong to a complete record.
    pub byte: usize,
}

/// A part of a file that does not match its checksum and is left out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damage {
    /// Where it begins.
    pub byte: usize,
    /// What it is and how that shows.
    pub what: String,
}

/// Records outside of chunks, or those of one chunk.
pub(crate) struct Section<'a> {
    /// Where it begins.
    pub(crate) byte: usize,
    pub(crate) records: Cow<'a, [u8]>,
    pub(crate) is_chunk: bool,
}

/// A file's records in their order, without those that are damaged.
#[derive(Default)]
pub(crate) struct Container<'a> {
    pub(crate) sections: Vec<Section<'a>>,
    /// Where the file breaks off.
    pub(crate) cut: Option<Cut>,
    pub(crate) damage: Vec<Damage>,
    /// The checksum over all data does not match, be it for one of the damages or for another one.
    pub(crate) data_differs: bool,
}

/// The byte of a fault that leaves nothing to be used, and its cause.
pub(crate) type Fault = (usize, String);

const ATTACHMENT: u8 = 0x09;
const CHUNK: u8 = 0x06;
const FOOTER: u8 = 0x02;
const DATA_END: u8 = 0x0F;
/// Opcode and length of a record.
const HEAD_BYTES: usize = 9;
/// The checksum at the end of an attachment and of the footer.
const CRC_BYTES: usize = 4;
/// Largest chunk that is unpacked; a damaged length must not fill the memory.
const LARGEST_CHUNK: u64 = 1 << 30;

impl<'a> Container<'a> {
    /// Walks over the records of a file that begins with the magic of MCAP.
    pub(crate) fn read(bytes: &'a [u8]) -> Result<Self, Fault> {
        let mut found = Self::default();
        let mut byte = mcap::MAGIC.len();
        let (mut is_data_ended, mut has_footer) = (false, false);
        while &bytes[byte..] != mcap::MAGIC {
            let Some((opcode, body)) = split_record(&bytes[byte..]) else {
                // A recorder that was killed has not written the end.
                let has_end = bytes[byte..].ends_with(mcap::MAGIC);
                if has_end && is_data_ended {
                    found.note(byte, "the index of the file is damaged");
                    return Ok(found);
                }
                if has_end {
                    let cause = "the length of this record reaches past the end of the file";
                    return Err((byte, cause.into()));
                }
                found.cut = Some(Cut { byte });
                return Ok(found);
            };
            let next = byte + HEAD_BYTES + body.len();
            match opcode {
                CHUNK => found.chunk(byte, body),
                ATTACHMENT if !attachment_fits(body) => {
                    let cause = "an attachment is shorter than its own header";
                    return Err((byte, cause.into()));
                }
                ATTACHMENT if !attachment_is_whole(body) => {
                    let name = attachment_name(body);
                    found
                        .note(byte, format!("the attachment `{name}` does not match its checksum"));
                }
                DATA_END => {
                    is_data_ended = true;
                    found.data_differs = differs(crc_at(body, 0), &bytes[..byte]);
                }
                FOOTER => {
                    has_footer = true;
                    let end = next - CRC_BYTES;
                    let stated = body.first_chunk().map(|start| u64::from_le_bytes(*start));
                    // Without an index the checksum is that of the footer alone.
                    let start = match stated {
                        Some(0) | None => Some(byte),
                        Some(start) => usize::try_from(start).ok(),
                    };
                    let index = start.and_then(|start| bytes.get(start..end));
                    let crc = crc_at(body, body.len().saturating_sub(CRC_BYTES));
                    if index.is_none_or(|index| differs(crc, index)) {
                        found.note(byte, "the index of the file does not match its checksum");
                    }
                }
                _ => {
                    let records = Cow::Borrowed(&bytes[byte..next]);
                    found.sections.push(Section { byte, records, is_chunk: false });
                }
            }
            byte = next;
        }
        if !is_data_ended {
            found.note(byte, "the record that ends the data is damaged");
        }
        if !has_footer {
            found.note(byte, "the record that ends the file is damaged");
        }
        Ok(found)
    }

    fn note(&mut self, byte: usize, what: impl Into<String>) {
        self.damage.push(Damage { byte, what: what.into() });
    }

    fn chunk(&mut self, byte: usize, body: &'a [u8]) {
        match unpacked(body) {
            Ok(records) => self.sections.push(Section { byte, records, is_chunk: true }),
            Err((header, cause)) => {
                let times = header.map_or(String::new(), |header| {
                    let [from_s, to_s] = [header.message_start_time, header.message_end_time]
                        .map(|ns| ns as f64 * 1e-9);
                    format!(" of {from_s:.3} to {to_s:.3} s")
                });
                self.note(byte, format!("the chunk{times} is damaged: {cause}"));
            }
        }
    }
}

impl Section<'_> {
    /// Its records; they were found whole before.
    pub(crate) fn records(&self) -> impl Iterator<Item = Result<Record<'_>, String>> {
        let mut rest = &self.records[..];
        std::iter::from_fn(move || {
            let (opcode, body) = split_record(rest)?;
            rest = &rest[HEAD_BYTES + body.len()..];
            Some(mcap::parse_record(opcode, body).map_err(|e| e.to_string()))
        })
    }
}

/// The records of a chunk, which match its checksum and are whole.
fn unpacked(body: &[u8]) -> Result<Cow<'_, [u8]>, (Option<ChunkHeader>, String)> {
    let parsed = mcap::parse_record(CHUNK, body).map_err(|e| (None, e.to_string()))?;
    let Record::Chunk { header, data } = parsed else {
        return Err((None, "it is none".into()));
    };
    let unpacked = decompressed(&header, data).and_then(|records| {
        if differs(header.uncompressed_crc, &records) {
            return Err("it does not match its checksum".into());
        }
        let mut rest = &records[..];
        while !rest.is_empty() {
            let (opcode, body) = split_record(rest).ok_or("it ends within a record")?;
            mcap::parse_record(opcode, body).map_err(|e| e.to_string())?;
            rest = &rest[HEAD_BYTES + body.len()..];
        }
        Ok(records)
    });
    unpacked.map_err(|cause: String| (Some(header), cause))
}

/// The bytes of a chunk as they were before its compression.
fn decompressed<'a>(header: &ChunkHeader, data: Cow<'a, [u8]>) -> Result<Cow<'a, [u8]>, String> {
    let size = header.uncompressed_size;
    if size > LARGEST_CHUNK {
        return Err(format!("it would have {size} bytes"));
    }
    let failed =
        |e: &dyn std::fmt::Display| format!("it cannot be unpacked ({}): {e}", header.compression);
    // One byte more shows a chunk that is longer than it says.
    let mut bytes = Vec::new();
    match header.compression.as_str() {
        "" => return Ok(data),
        "zstd" => {
            let decoder = ruzstd::decoding::StreamingDecoder::new(&data[..]);
            let decoder = decoder.map_err(|e| failed(&e))?;
            decoder.take(size + 1).read_to_end(&mut bytes).map_err(|e| failed(&e))?;
        }
        "lz4" => {
            let decoder = lz4_flex::frame::FrameDecoder::new(&data[..]);
            decoder.take(size + 1).read_to_end(&mut bytes).map_err(|e| failed(&e))?;
        }
        other => return Err(format!("it is compressed with {other}, which is not known")),
    }
    match bytes.len() as u64 == size {
        true => Ok(Cow::Owned(bytes)),
        false => Err(format!("it has not the {size} bytes that it states")),
    }
}

/// Whether bytes do not match a checksum; 0 is none.
fn differs(crc: u32, bytes: &[u8]) -> bool {
    crc != 0 && crc != crc32fast::hash(bytes)
}

fn crc_at(body: &[u8], at: usize) -> u32 {
    let bytes = body.get(at..).and_then(|rest| rest.first_chunk());
    bytes.map_or(0, |bytes| u32::from_le_bytes(*bytes))
}

/// Opcode and body of the first record, if it is complete.
fn split_record(bytes: &[u8]) -> Option<(u8, &[u8])> {
    let (&opcode, rest) = bytes.split_first()?;
    let (length, rest) = rest.split_first_chunk()?;
    let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
    Some((opcode, rest.get(..length)?))
}

/// Where an attachment's name and media type end; `None` if they do not fit.
fn attachment_strings(body: &[u8]) -> Option<Range<usize>> {
    const TIMES: usize = 16;
    let after_string = |at: usize| {
        let length = body.get(at..)?.first_chunk()?;
        at.checked_add(4)?.checked_add(usize::try_from(u32::from_le_bytes(*length)).ok()?)
    };
    after_string(TIMES).and_then(after_string).map(|end| TIMES..end)
}

/// Whether an attachment's lengths fit; the library's parser does not check it.
fn attachment_fits(body: &[u8]) -> bool {
    const DATA_LENGTH_AND_CRC: usize = 12;
    attachment_strings(body)
        .is_some_and(|s| body.len() >= s.end.saturating_add(DATA_LENGTH_AND_CRC))
}

fn attachment_is_whole(body: &[u8]) -> bool {
    let data = body.len().saturating_sub(CRC_BYTES);
    !differs(crc_at(body, data), body.get(..data).unwrap_or_default())
        && mcap::parse_record(ATTACHMENT, body).is_ok()
}

fn attachment_name(body: &[u8]) -> String {
    const NAME: usize = 20;
    let length = crc_at(body, NAME - 4) as usize;
    let name = body.get(NAME..).and_then(|rest| rest.get(..length)).unwrap_or_default();
    String::from_utf8_lossy(name).escape_debug().to_string()
}
