//! STL files, binary and ASCII, in millimetres, into triangles in metres.

use nalgebra::Vector3;

use super::stl_ascii::read_ascii;
use super::stl_format::{METRES_PER_UNIT, StlCause, shown};
use super::wall::Triangle;
use crate::place::Place;

const HEADER_BYTES: usize = 84;
const TRIANGLE_BYTES: usize = 50;

/// Reads an STL file, binary or ASCII whatever its first word says: many binary files
/// begin with `solid` too.
pub fn read_stl(bytes: &[u8]) -> Result<Vec<Triangle>, (Place, StlCause)> {
    // Windows programs put this mark in front of UTF-8; DOS programs put 0x1A behind a text.
    let text = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    let triangles = if is_whole_binary(bytes) {
        read_binary(bytes)?
    } else if let Some(format) = other_format(bytes) {
        return Err((Place::Whole, StlCause::OtherFormat(format)));
    } else if looks_ascii(text) {
        read_ascii(text.strip_suffix(b"\x1A").unwrap_or(text))?
    } else {
        read_binary(bytes)?
    };
    if triangles.is_empty() {
        return Err((Place::Whole, StlCause::Empty));
    }
    Ok(triangles)
}

/// Bytes that a binary file with this header must have.
fn promised_bytes(bytes: &[u8]) -> Option<(usize, usize)> {
    let count = bytes.get(80..HEADER_BYTES)?;
    let count = u32::from_le_bytes([count[0], count[1], count[2], count[3]]) as usize;
    Some((count, HEADER_BYTES + TRIANGLE_BYTES * count))
}

fn is_whole_binary(bytes: &[u8]) -> bool {
    promised_bytes(bytes).is_some_and(|(_, length)| length == bytes.len())
}

/// Formats that are often mistaken for STL, by their first bytes.
fn other_format(bytes: &[u8]) -> Option<&'static str> {
    const FORMATS: [(&[u8], &str); 4] = [
        (b"PK\x03\x04", "a ZIP archive (3MF files are such)"),
        (b"\x1F\x8B", "a gzip archive"),
        (b"\xFF\xFE", "text in UTF-16"),
        (b"\xFE\xFF", "text in UTF-16"),
    ];
    FORMATS.iter().find(|(first, _)| bytes.starts_with(first)).map(|(_, format)| *format)
}

fn looks_ascii(bytes: &[u8]) -> bool {
    let start = bytes.trim_ascii_start();
    let head = &start[..start.len().min(1024)];
    // A binary header that begins with "solid" is padded with zeros or holds a count.
    let word = head.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    word && head.iter().all(|&byte| byte >= 0x20 || byte.is_ascii_whitespace())
}

fn read_binary(bytes: &[u8]) -> Result<Vec<Triangle>, (Place, StlCause)> {
    let found = bytes.len();
    let Some((promised, expected)) = promised_bytes(bytes) else {
        return Err((Place::Byte(found), StlCause::NoHeader { found }));
    };
    if found < expected {
        // The header of a binary STL may be text, a count of less than 16 million is not.
        let head = &bytes[..HEADER_BYTES];
        if head.iter().all(|byte| byte.is_ascii_graphic() || byte.is_ascii_whitespace()) {
            let first = head.split(|&byte| byte == b'\n' || byte == b'\r').next();
            let starts = shown(first.unwrap_or_default().trim_ascii_end());
            return Err((Place::Whole, StlCause::NotStl { starts }));
        }
        let triangle = (found - HEADER_BYTES) / TRIANGLE_BYTES;
        let cause = StlCause::Truncated { promised, expected, found, triangle };
        return Err((Place::Byte(found), cause));
    }
    if found > expected {
        let cause = StlCause::TrailingBytes { promised, extra: found - expected };
        return Err((Place::Byte(expected), cause));
    }
    let (records, _) = bytes[HEADER_BYTES..].as_chunks::<TRIANGLE_BYTES>();
    let mut triangles = Vec::with_capacity(promised);
    for (triangle, record) in records.iter().enumerate() {
        let coordinate = |index: usize| {
            let at = 12 + 4 * index; // after the facet's normal, which nobody may trust
            f32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]])
        };
        let corner = |k: usize| {
            Vector3::from_fn(|axis, _| f64::from(coordinate(3 * k + axis)) * METRES_PER_UNIT)
        };
        for index in 0..9 {
            if !coordinate(index).is_finite() {
                let byte = HEADER_BYTES + TRIANGLE_BYTES * triangle + 12 + 4 * index;
                return Err((Place::Byte(byte), StlCause::NotFinite { triangle }));
            }
        }
        triangles.push([corner(0), corner(1), corner(2)]);
    }
    Ok(triangles)
}
