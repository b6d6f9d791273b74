//! STL files, binary and ASCII, in millimetres, into triangles in metres.

use nalgebra::Vector3;
use thiserror::Error;

use crate::error::Place;

/// Corners of a triangle \[m\].
pub type Triangle = [Vector3<f64>; 3];

const HEADER_BYTES: usize = 84;
const TRIANGLE_BYTES: usize = 50;
const METRES_PER_UNIT: f64 = 1e-3;

/// Why an STL file is refused.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum StlCause {
    #[error(
        "the file has {found} bytes; a binary STL has a header of 84, and this is no ASCII STL"
    )]
    NoHeader { found: usize },
    #[error(
        "the header promises {promised} triangles, {expected} bytes; the file ends after {found}, \
         inside or before triangle {triangle}"
    )]
    Truncated { promised: usize, expected: usize, found: usize, triangle: usize },
    #[error("{extra} bytes follow the last of the {promised} triangles that the header promises")]
    TrailingBytes { promised: usize, extra: usize },
    #[error("this is no STL file; it begins with `{starts}`")]
    NotStl { starts: String },
    #[error("the surface has no triangles")]
    Empty,
    #[error("triangle {triangle} has a coordinate that is not a finite number")]
    NotFinite { triangle: usize },
    #[error("expected `{expected}`, found `{found}`")]
    Syntax { expected: &'static str, found: String },
    #[error("`{0}` is not a number")]
    NotANumber(String),
    #[error("the file ends inside facet {facet}; `{expected}` is missing")]
    TruncatedAscii { facet: usize, expected: &'static str },
}

impl StlCause {
    pub(crate) fn fix(&self) -> String {
        match self {
            StlCause::NoHeader { .. } | StlCause::Truncated { .. } => {
                "the file was cut short, or is no STL: export or copy it again".into()
            }
            StlCause::TrailingBytes { .. } => {
                "the triangle count in bytes 80 to 83 and the file disagree: export it again".into()
            }
            StlCause::NotStl { .. } => "export the surface as STL, binary if possible".into(),
            StlCause::Empty => "export the lumen surface again; nothing was selected".into(),
            StlCause::NotFinite { .. } => {
                "repair the mesh in the program that made it, and export it again".into()
            }
            StlCause::Syntax { .. } | StlCause::NotANumber(_) | StlCause::TruncatedAscii { .. } => {
                "export the surface again, as binary STL if possible".into()
            }
        }
    }
}

/// Reads an STL file, binary or ASCII whatever its first word says: many binary files
/// begin with `solid` too.
pub fn read_stl(bytes: &[u8]) -> Result<Vec<Triangle>, (Place, StlCause)> {
    let triangles = if looks_ascii(bytes) { read_ascii(bytes)? } else { read_binary(bytes)? };
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

fn looks_ascii(bytes: &[u8]) -> bool {
    if promised_bytes(bytes).is_some_and(|(_, length)| length == bytes.len()) {
        return false;
    }
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
            let first = head.split(|&byte| byte == b'\n').next().unwrap_or_default();
            let starts = String::from_utf8_lossy(first).trim_end().to_owned();
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

/// Words of a text with their lines.
struct Words<'a> {
    words: Box<dyn Iterator<Item = (usize, &'a str)> + 'a>,
    last_line: usize,
    facet: usize,
}

impl<'a> Words<'a> {
    fn new(text: &'a str) -> Self {
        let words = text.lines().enumerate().flat_map(|(index, line)| {
            line.split_ascii_whitespace().map(move |word| (index + 1, word))
        });
        Self { words: Box::new(words), last_line: 1, facet: 0 }
    }

    fn next(&mut self, expected: &'static str) -> Result<(usize, &'a str), (Place, StlCause)> {
        let Some((line, word)) = self.words.next() else {
            let cause = StlCause::TruncatedAscii { facet: self.facet, expected };
            return Err((Place::Line(self.last_line), cause));
        };
        self.last_line = line;
        Ok((line, word))
    }

    fn expect(&mut self, expected: &'static str) -> Result<(), (Place, StlCause)> {
        let (line, word) = self.next(expected)?;
        if word.eq_ignore_ascii_case(expected) {
            return Ok(());
        }
        Err((Place::Line(line), StlCause::Syntax { expected, found: word.into() }))
    }

    fn point(&mut self) -> Result<Vector3<f64>, (Place, StlCause)> {
        let mut point = Vector3::zeros();
        for axis in 0..3 {
            let (line, word) = self.next("a number")?;
            // In the precision of a binary file, so that both forms give the same lumen.
            let number: f32 =
                word.parse().map_err(|_| (Place::Line(line), StlCause::NotANumber(word.into())))?;
            if !number.is_finite() {
                return Err((Place::Line(line), StlCause::NotFinite { triangle: self.facet }));
            }
            point[axis] = f64::from(number) * METRES_PER_UNIT;
        }
        Ok(point)
    }
}

fn read_ascii(bytes: &[u8]) -> Result<Vec<Triangle>, (Place, StlCause)> {
    let text = String::from_utf8_lossy(bytes);
    // The solid's name may hold anything, even the word `facet`: drop the rest of its line.
    let body: String = text
        .lines()
        .map(|line| {
            let word = line.split_ascii_whitespace().next().unwrap_or_default();
            let named = ["solid", "endsolid"].iter().find(|w| word.eq_ignore_ascii_case(w));
            named.copied().unwrap_or(line)
        })
        .flat_map(|line| [line, "\n"])
        .collect();
    let mut words = Words::new(&body);
    let mut triangles = Vec::new();
    words.expect("solid")?;
    loop {
        let (line, word) = words.next("endsolid")?;
        match word.to_ascii_lowercase().as_str() {
            "facet" => {
                words.expect("normal")?;
                words.normal()?;
                words.expect("outer")?;
                words.expect("loop")?;
                let mut corners = [Vector3::zeros(); 3];
                for corner in &mut corners {
                    words.expect("vertex")?;
                    *corner = words.point()?;
                }
                words.expect("endloop")?;
                words.expect("endfacet")?;
                triangles.push(corners);
                words.facet += 1;
            }
            "endsolid" => match words.words.next() {
                None => return Ok(triangles),
                Some((_, word)) if word.eq_ignore_ascii_case("solid") => {}
                Some((line, word)) => {
                    let cause = StlCause::Syntax { expected: "solid", found: word.into() };
                    return Err((Place::Line(line), cause));
                }
            },
            _ => {
                let cause = StlCause::Syntax { expected: "facet", found: word.into() };
                return Err((Place::Line(line), cause));
            }
        }
    }
}

impl Words<'_> {
    /// Skips a facet's normal: writers put zeros or NaN there, and it is not used.
    fn normal(&mut self) -> Result<(), (Place, StlCause)> {
        for _ in 0..3 {
            let (line, word) = self.next("a number")?;
            if word.parse::<f64>().is_err() {
                return Err((Place::Line(line), StlCause::NotANumber(word.into())));
            }
        }
        Ok(())
    }
}
