//! ASCII STL files, as many programs write them: lines may end as on any system, or not at all.

use nalgebra::Vector3;

use super::stl_format::{END, METRES_PER_UNIT, StlCause, shown};
use super::wall::Triangle;
use crate::place::Place;

type Refusal = (Place, StlCause);

/// Reads the text of an ASCII STL file; the first fault refuses it.
pub(super) fn read_ascii(text: &[u8]) -> Result<Vec<Triangle>, Refusal> {
    let mut words = Words { rest: text, line: 1, last_line: 1, facet: 0 };
    let mut triangles = Vec::new();
    words.expect("solid")?;
    words.skip_name(false);
    loop {
        let word = words.next(END)?;
        if word.eq_ignore_ascii_case(b"facet") {
            triangles.push(words.facet()?);
            words.facet += 1;
        } else if word.eq_ignore_ascii_case(END.as_bytes()) {
            words.skip_name(true);
            match words.word() {
                None => return Ok(triangles),
                Some(word) if word.eq_ignore_ascii_case(b"solid") => words.skip_name(false),
                Some(word) => return Err(words.unexpected("solid", word)),
            }
        } else {
            return Err(words.unexpected("facet", word));
        }
    }
}

/// The words of a text, with their lines.
struct Words<'a> {
    rest: &'a [u8],
    /// Of the rest's first byte.
    line: usize,
    /// Of the last word.
    last_line: usize,
    facet: usize,
}

impl<'a> Words<'a> {
    fn word(&mut self) -> Option<&'a [u8]> {
        let skipped = self.rest.iter().take_while(|byte| byte.is_ascii_whitespace()).count();
        self.skip(skipped);
        let length = self.rest.iter().take_while(|byte| !byte.is_ascii_whitespace()).count();
        let word = &self.rest[..length];
        self.rest = &self.rest[length..];
        if length == 0 {
            return None;
        }
        self.last_line = self.line;
        Some(word)
    }

    /// Goes on behind so many bytes.
    fn skip(&mut self, count: usize) {
        let (skipped, rest) = self.rest.split_at(count);
        // A return alone ends a line too.
        let ends = |at: &usize| match skipped[*at] {
            b'\n' => true,
            b'\r' => self.rest.get(at + 1) != Some(&b'\n'),
            _ => false,
        };
        self.line += (0..count).filter(ends).count();
        self.rest = rest;
    }

    /// Goes on behind the name of a solid: it may hold anything, even the word `facet`, and ends
    /// with its line, or in a file of one line where the first facet begins; `at_end`: where the
    /// next solid does.
    fn skip_name(&mut self, at_end: bool) {
        let length = self.rest.iter().take_while(|byte| !matches!(byte, b'\n' | b'\r')).count();
        let line = &self.rest[..length];
        let words: Vec<&[u8]> =
            line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()).collect();
        let is = |at: usize, expected: &str| {
            words.get(at).is_some_and(|word| word.eq_ignore_ascii_case(expected.as_bytes()))
        };
        let is_facet = |at: &usize| is(*at, "facet") && is(at + 1, "normal");
        let facet = (0..words.len()).find(is_facet);
        let solid = |facet: usize| (0..facet).rev().find(|&at| is(at, "solid"));
        let end = if at_end { facet.and_then(solid) } else { facet };
        let count = match end {
            Some(at) => words[at].as_ptr().addr() - line.as_ptr().addr(),
            None => length,
        };
        self.skip(count);
    }

    fn next(&mut self, expected: &'static str) -> Result<&'a [u8], Refusal> {
        let cause = StlCause::TruncatedAscii { facet: self.facet, expected };
        self.word().ok_or((Place::Line(self.last_line), cause))
    }

    fn unexpected(&self, expected: &'static str, found: &[u8]) -> Refusal {
        (Place::Line(self.last_line), StlCause::Syntax { expected, found: shown(found) })
    }

    fn expect(&mut self, expected: &'static str) -> Result<(), Refusal> {
        let word = self.next(expected)?;
        if word.eq_ignore_ascii_case(expected.as_bytes()) {
            return Ok(());
        }
        Err(self.unexpected(expected, word))
    }

    /// The rest of a facet.
    fn facet(&mut self) -> Result<Triangle, Refusal> {
        self.expect("normal")?;
        for _ in 0..3 {
            self.skip_number()?;
        }
        self.expect("outer")?;
        self.expect("loop")?;
        let mut corners = [Vector3::zeros(); 3];
        for corner in &mut corners {
            self.expect("vertex")?;
            for axis in 0..3 {
                corner[axis] = self.coordinate_m()?;
            }
        }
        self.expect("endloop")?;
        self.expect("endfacet")?;
        Ok(corners)
    }

    /// Of a facet's normal, which is not used: writers put zeros there, NaN, or what a C library
    /// prints for it, like `-nan(ind)` and `1.#QNAN`.
    fn skip_number(&mut self) -> Result<(), Refusal> {
        let word = self.next("a number")?;
        let unsigned = word.strip_prefix(b"-").or(word.strip_prefix(b"+")).unwrap_or(word);
        let begins = |with: &str| {
            unsigned.get(..with.len()).is_some_and(|w| w.eq_ignore_ascii_case(with.as_bytes()))
        };
        let is_number = unsigned.first().is_some_and(|byte| byte.is_ascii_digit() || *byte == b'.')
            || begins("nan")
            || begins("inf");
        let cause = || StlCause::NotANumber(shown(word));
        if is_number { Ok(()) } else { Err((Place::Line(self.last_line), cause())) }
    }

    fn coordinate_m(&mut self) -> Result<f64, Refusal> {
        let word = self.next("a number")?;
        let refuse = |cause| Err((Place::Line(self.last_line), cause));
        let text = str::from_utf8(word).unwrap_or_default();
        // In the precision of a binary file, so that both forms give the same lumen.
        match text.parse::<f32>() {
            Ok(number) if number.is_finite() => Ok(f64::from(number) * METRES_PER_UNIT),
            Ok(_) => refuse(StlCause::NotFinite { triangle: self.facet }),
            Err(_) if text.replacen(',', ".", 1).parse::<f32>().is_ok() => {
                refuse(StlCause::DecimalComma(shown(word)))
            }
            Err(_) => refuse(StlCause::NotANumber(shown(word))),
        }
    }
}
