//! The device image: instrument, lumen, wall and settings as one block of bytes.
//!
//! | offset | bytes | what |
//! | --- | --- | --- |
//! | 0 | 4 | magic `CFIM` |
//! | 4 | 2 | format version |
//! | 6 | 4 | schema hash of [`ImageHead`] and the layout of a lumen |
//! | 10 | 4 | total length |
//! | 14 | 4 | length of the postcard part |
//! | 18 | 4 | CRC-32 (ISO-HDLC) of everything from 22 on |
//! | 22 | … | postcard of [`ImageHead`] |
//! | … | 0–3 | zeros up to a multiple of 4 |
//! | … | … | bytes of the lumen, read in place |
//!
//! Numbers are little endian. An image is accepted or refused as a whole.

use core::fmt;

use cathforce_bus::master::{Master, MasterError};
use cathforce_control::{Band, Config, SettingError, Settings, TICK_S};
use cathforce_mechanics::{
    Description, DescriptionError, LUMEN_LAYOUT, Lumen, LumenError, LumenHeader, MAX_LINKS, Model,
};
use crc::{CRC_32_ISO_HDLC, Crc, Table};
use serde::{Deserialize, Serialize};

use crate::schema;

/// First bytes of an image.
pub const MAGIC: [u8; 4] = *b"CFIM";
/// Version of the layout in the table above. The schema hash covers the types inside.
pub const VERSION: u16 = 1;
/// Bytes before the postcard part.
pub const HEADER_BYTES: usize = 22;

/// CRC with a small table of 1 KB, because an image is checked only once.
static CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// The decoded part of an image. The bytes of the lumen follow it and are read in place.
///
/// Names and order of the fields, here and in their types, enter the schema hash.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImageHead {
    pub description: Description<f32>,
    pub lumen: LumenHeader,
    pub settings: Settings,
    pub master: Master,
    /// Uncertainty of the estimated forces, if a diagnosis has measured it.
    pub band: Option<Band>,
}

/// Why bytes are refused as an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageError {
    /// Fewer bytes than a header.
    TooShort { found: usize },
    /// Offset 0: not `CFIM`.
    Magic { found: [u8; 4] },
    /// Offset 4: an unknown version of the layout.
    Version { expected: u16, found: u16 },
    /// Offset 6: made by a version with other types.
    Schema { expected: u32, found: u32 },
    /// Offset 10: the stated length differs from the actual one.
    Length { stated: u32, found: usize },
    /// Offset 14: the postcard part does not fit into the image.
    HeadLength { stated: u32 },
    /// Offset 18: the bytes are corrupt.
    Crc { stated: u32, computed: u32 },
    /// The postcard part, which begins at offset 22, cannot be read.
    Postcard,
    /// The postcard part has bytes left over from this offset on.
    TrailingBytes { offset: usize },
    /// The padding at this offset is not zero.
    Padding { offset: usize },
    /// A number of the description is refused.
    Description(DescriptionError),
    /// `solver.tick_s` is not the tick of the device.
    Tick,
    /// A tick would take too long (see [`overlong`]).
    Overlong(&'static str),
    /// The lumen is refused; its bytes begin at this offset.
    Lumen { offset: usize, error: LumenError },
    /// A setting is refused.
    Setting(SettingError),
    /// A frame of the master is refused.
    Master(MasterError),
    /// A number of the band is refused.
    Band(&'static str),
}

/// Why an image cannot be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EncodeError {
    /// A device would refuse the image.
    Refused(ImageError),
    /// The buffer is too small; [`encoded_len`] gives the length.
    BufferTooSmall { needed: usize },
    /// The image would be longer than its header can state.
    TooLong,
}

impl fmt::Display for ImageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::TooShort { found } => {
                write!(f, "{found} bytes are no device image: its header alone has {HEADER_BYTES}")
            }
            Self::Magic { found } => {
                write!(f, "byte 0: not a device image: begins with {found:02x?}, not \"CFIM\"")
            }
            Self::Version { expected, found } => write!(
                f,
                "byte 4: image format {found}, but this version reads format {expected}: \
                 make the image with the same version of cathforce as the firmware"
            ),
            Self::Schema { expected, found } => write!(
                f,
                "byte 6: layout {found:08x}, but this version reads {expected:08x}: \
                 make the image with the same version of cathforce as the firmware"
            ),
            Self::Length { stated, found } => write!(
                f,
                "byte 10: the image should have {stated} bytes but has {found}: send it again"
            ),
            Self::HeadLength { stated } => {
                write!(f, "byte 14: a description of {stated} bytes does not fit into the image")
            }
            Self::Crc { stated, computed } => write!(
                f,
                "byte 18: the CRC should be {stated:08x} but is {computed:08x}: \
                 the image was damaged, send it again"
            ),
            Self::Postcard => write!(f, "byte {HEADER_BYTES}: the description cannot be read"),
            Self::TrailingBytes { offset } => {
                write!(f, "byte {offset}: the description has bytes left over")
            }
            Self::Padding { offset } => write!(f, "byte {offset}: the padding is not zero"),
            Self::Description(DescriptionError::Range(name)) => {
                write!(f, "description: {name} is not finite or out of range")
            }
            Self::Description(DescriptionError::NoSections) => {
                f.write_str("description: the instrument has no section")
            }
            Self::Description(DescriptionError::EntryFrame) => f.write_str(
                "description: entry.direction and entry.up are not of length 1 and at right angles",
            ),
            Self::Tick => {
                write!(f, "description: solver.tick_s must be {TICK_S} s, the tick of the device")
            }
            Self::Overlong(what) => write!(
                f,
                "description: {what}: a tick would take more than half of its millisecond"
            ),
            Self::Lumen { error: LumenError::Header(name), .. } => {
                write!(f, "lumen: {name} of its header is not finite or out of range")
            }
            Self::Lumen { offset, error: LumenError::Length { expected, found } } => {
                write!(f, "byte {offset}: the lumen should have {expected} bytes but has {found}")
            }
            Self::Lumen { offset, error: LumenError::Directory { entry, brick } } => write!(
                f,
                "byte {}: entry {entry} of the lumen's directory names brick {brick}, \
                 which is not stored",
                offset + 2 * entry
            ),
            Self::Setting(error) => write!(f, "settings: {error}"),
            Self::Master(error) => write!(f, "master: {}", error.text()),
            Self::Band(name) => write!(f, "band: {name} is not finite or out of range"),
        }
    }
}

impl core::error::Error for ImageError {}

impl fmt::Display for EncodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused(error) => error.fmt(f),
            Self::BufferTooSmall { needed } => write!(f, "the image needs {needed} bytes"),
            Self::TooLong => f.write_str("the image would be longer than 4 GiB"),
        }
    }
}

impl core::error::Error for EncodeError {}

/// Header of an image, not checked against its contents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    pub version: u16,
    pub schema: u32,
    pub total_bytes: u32,
    pub head_bytes: u32,
    /// Also serves as short name of an image, because equal images have equal CRCs.
    pub crc: u32,
}

impl Header {
    /// Reads the header; checks only length and magic.
    pub fn read(image: &[u8]) -> Result<Self, ImageError> {
        let Some((header, _)) = image.split_first_chunk::<HEADER_BYTES>() else {
            return Err(ImageError::TooShort { found: image.len() });
        };
        let [m0, m1, m2, m3, v0, v1, s0, s1, s2, s3, rest @ ..] = *header;
        let [t0, t1, t2, t3, h0, h1, h2, h3, c0, c1, c2, c3] = rest;
        let magic = [m0, m1, m2, m3];
        if magic != MAGIC {
            return Err(ImageError::Magic { found: magic });
        }
        Ok(Self {
            version: u16::from_le_bytes([v0, v1]),
            schema: u32::from_le_bytes([s0, s1, s2, s3]),
            total_bytes: u32::from_le_bytes([t0, t1, t2, t3]),
            head_bytes: u32::from_le_bytes([h0, h1, h2, h3]),
            crc: u32::from_le_bytes([c0, c1, c2, c3]),
        })
    }

    fn write(&self) -> [u8; HEADER_BYTES] {
        let mut bytes = [0; HEADER_BYTES];
        let fields = (MAGIC.into_iter())
            .chain(self.version.to_le_bytes())
            .chain(self.schema.to_le_bytes())
            .chain(self.total_bytes.to_le_bytes())
            .chain(self.head_bytes.to_le_bytes())
            .chain(self.crc.to_le_bytes());
        for (byte, value) in bytes.iter_mut().zip(fields) {
            *byte = value;
        }
        bytes
    }
}

/// Hash of the layouts of [`ImageHead`] and of a lumen that this version writes and accepts.
pub fn schema_hash() -> u32 {
    // `None` only for types that `schema` cannot trace; a test checks that ours can be traced.
    schema::hash::<ImageHead>().unwrap_or(0).wrapping_add(LUMEN_LAYOUT)
}

/// Offset of the lumen.
fn lumen_offset(head_bytes: usize) -> Option<usize> {
    HEADER_BYTES.checked_add(head_bytes)?.checked_next_multiple_of(4)
}

fn head_len(head: &ImageHead) -> Result<usize, EncodeError> {
    postcard::serialize_with_flavor(head, postcard::ser_flavors::Size::default())
        .map_err(|_| EncodeError::Refused(ImageError::Postcard))
}

/// Length of the image that [`encode`] writes \[bytes\].
pub fn encoded_len(head: &ImageHead, lumen_bytes: &[u8]) -> Result<usize, EncodeError> {
    let total = lumen_offset(head_len(head)?).and_then(|at| at.checked_add(lumen_bytes.len()));
    total.filter(|&n| u32::try_from(n).is_ok()).ok_or(EncodeError::TooLong)
}

/// Writes an image; returns its length \[bytes\]. An image that a device would refuse is refused here.
pub fn encode(
    head: &ImageHead,
    lumen_bytes: &[u8],
    image: &mut [u8],
) -> Result<usize, EncodeError> {
    let needed = encoded_len(head, lumen_bytes)?;
    let Some(image) = image.get_mut(..needed) else {
        return Err(EncodeError::BufferTooSmall { needed });
    };
    let offset = needed - lumen_bytes.len();
    configure(head.clone(), lumen_bytes, offset).map_err(EncodeError::Refused)?;

    let too_small = EncodeError::BufferTooSmall { needed };
    let (header, body) = image.split_first_chunk_mut::<HEADER_BYTES>().ok_or(too_small)?;
    let (front, lumen) = body.split_at_mut_checked(offset - HEADER_BYTES).ok_or(too_small)?;
    front.fill(0);
    let head_bytes = postcard::to_slice(head, front).map_err(|_| too_small)?.len();
    lumen.copy_from_slice(lumen_bytes);
    *header = Header {
        version: VERSION,
        schema: schema_hash(),
        total_bytes: needed as u32,
        head_bytes: head_bytes as u32,
        crc: CRC.checksum(body),
    }
    .write();
    Ok(needed)
}

/// Decodes an image; the lumen is read in place. Returns the first error.
pub fn decode(image: &[u8]) -> Result<Config<'_>, ImageError> {
    let body = image.get(HEADER_BYTES..).unwrap_or_default();
    decode_summed(image, CRC.checksum(body))
}

/// [`decode`], by somebody who has computed the CRC-32 of everything behind the header already.
pub fn decode_summed(image: &[u8], body_crc: u32) -> Result<Config<'_>, ImageError> {
    let (head, lumen, offset) = split(image, body_crc)?;
    configure(head, lumen, offset)
}

/// Number of bytes at the beginning of an image that [`decode_head`] needs; `None` if the header is
/// incomplete.
pub fn head_end(image: &[u8]) -> Option<usize> {
    let header = Header::read(image).ok()?;
    HEADER_BYTES.checked_add(usize::try_from(header.head_bytes).ok()?)
}

/// Decodes the head of an image without its lumen. The CRC cannot be checked then, so this is for bytes
/// from a device that has checked the image itself.
pub fn decode_head(front: &[u8]) -> Result<ImageHead, ImageError> {
    let header = Header::read(front)?;
    let expected = schema_hash();
    if (header.version, header.schema) != (VERSION, expected) {
        return Err(ImageError::Schema { expected, found: header.schema });
    }
    let end = head_end(front).ok_or(ImageError::HeadLength { stated: header.head_bytes })?;
    let head = front.get(HEADER_BYTES..end).ok_or(ImageError::TooShort { found: front.len() })?;
    match postcard::take_from_bytes::<ImageHead>(head) {
        Ok((head, [])) => Ok(head),
        _ => Err(ImageError::Postcard),
    }
}

/// The header of an image that this program can read, as far as its format and its types go.
pub fn readable(image: &[u8]) -> Result<Header, ImageError> {
    let header = Header::read(image)?;
    if header.version != VERSION {
        return Err(ImageError::Version { expected: VERSION, found: header.version });
    }
    let expected = schema_hash();
    if header.schema != expected {
        return Err(ImageError::Schema { expected, found: header.schema });
    }
    Ok(header)
}

/// The description of the master's frames in an image that [`decode`] has accepted.
#[inline(never)]
pub fn master(image: &[u8]) -> Result<Master, ImageError> {
    Ok(decode_head(image)?.master)
}

/// Checks everything except the values of the numbers. Returns the head, and the lumen's bytes with their
/// offset.
fn split(image: &[u8], computed: u32) -> Result<(ImageHead, &[u8], usize), ImageError> {
    let header = readable(image)?;
    if usize::try_from(header.total_bytes) != Ok(image.len()) {
        return Err(ImageError::Length { stated: header.total_bytes, found: image.len() });
    }
    let head_length = ImageError::HeadLength { stated: header.head_bytes };
    let head_bytes = usize::try_from(header.head_bytes).map_err(|_| head_length)?;
    let offset = lumen_offset(head_bytes).ok_or(head_length)?;
    let (front, lumen) = image.split_at_checked(offset).ok_or(head_length)?;
    if header.crc != computed {
        return Err(ImageError::Crc { stated: header.crc, computed });
    }
    let (_, front) = front.split_at_checked(HEADER_BYTES).ok_or(head_length)?;
    let (head, padding) = front.split_at_checked(head_bytes).ok_or(head_length)?;
    let padding_offset = HEADER_BYTES + head_bytes;
    if let Some(i) = padding.iter().position(|&b| b != 0) {
        return Err(ImageError::Padding { offset: padding_offset + i });
    }
    let (head, rest) =
        postcard::take_from_bytes::<ImageHead>(head).map_err(|_| ImageError::Postcard)?;
    if !rest.is_empty() {
        return Err(ImageError::TrailingBytes { offset: padding_offset - rest.len() });
    }
    Ok((head, lumen, offset))
}

/// Largest number of links in half of a tick's time. All links would take longer with two substeps, or
/// with two solves and active effects ([`Description::has_active_effects`]). Measured by
/// `hil-tests/tests/tick_cost.rs`.
pub fn most_links(solves: u8, substeps: u8, has_active_effects: bool) -> usize {
    match (solves, substeps, has_active_effects) {
        (_, 2.., false) => 57,
        (_, 2.., true) => 47,
        (2.., _, true) => 57,
        _ => MAX_LINKS,
    }
}

/// The property of a description for which a tick would take too long; `None` if there is time enough.
pub fn overlong(description: &Description<f32>) -> Option<&'static str> {
    let solver = &description.solver;
    let has_tendons = !description.tendons.is_empty();
    match (solver.solves, solver.substeps, &description.guidewire) {
        (_, 3.., _) => Some("solver.substeps above 2"),
        (2.., ..) if has_tendons => Some("solver.solves = 2 with tendons that drives pull"),
        (_, 2, _) if has_tendons => {
            Some("half ticks, which a near-rigid wall asks for, with tendons that drives pull")
        }
        (_, _, Some(_)) if has_tendons => Some("a guidewire with tendons that drives pull"),
        (2.., _, Some(_)) => Some("solver.solves = 2 with a guidewire"),
        (_, 2, Some(_)) => Some("half ticks, which a near-rigid wall asks for, with a guidewire"),
        (2.., 2, None) => {
            Some("solver.solves = 2 with half ticks, which a near-rigid wall asks for")
        }
        _ => None,
    }
}

/// Tolerance of a reach for rounding.
const ROUNDED: f32 = 1.0 + 1e-5;

/// Checks the values of the numbers, and makes the configuration.
fn configure(
    head: ImageHead,
    lumen_bytes: &[u8],
    lumen_offset: usize,
) -> Result<Config<'_>, ImageError> {
    let ImageHead { description, lumen, settings, master, band } = head;
    band.map_or(Ok(()), |band| band.validate()).map_err(ImageError::Band)?;
    master.validate().map_err(ImageError::Master)?;
    settings.validate().map_err(ImageError::Setting)?;
    if description.solver.tick_s != TICK_S {
        return Err(ImageError::Tick);
    }
    if let Some(what) = overlong(&description) {
        return Err(ImageError::Overlong(what));
    }
    let solver = &description.solver;
    let links = most_links(solver.solves, solver.substeps, description.has_active_effects());
    let reach_m = solver.reach_m(links);
    if links < MAX_LINKS && settings.max_insertion_m > reach_m * ROUNDED {
        return Err(ImageError::Overlong(match solver.substeps {
            2.. => "more links than half ticks have time for",
            _ => "more links than two solves with effects have time for",
        }));
    }
    let lumen = Lumen::new(lumen, lumen_bytes)
        .map_err(|error| ImageError::Lumen { offset: lumen_offset, error })?;
    let model = Model::new(description).map_err(ImageError::Description)?;
    Ok(Config { model, lumen, settings, band })
}

#[cfg(test)]
pub(crate) mod tests;
