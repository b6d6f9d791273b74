//! Reads the tables of an SQLite database, as a bag of rosbag2 is one by default.
//!
//! Only what a bag needs: whole tables from their first row to their last. So no library in C has to be
//! built for every system. Source of the format: <https://www.sqlite.org/fileformat2.html>.

use std::collections::HashSet;

pub(super) const MAGIC: &[u8] = b"SQLite format 3\0";

const HEADER_BYTES: usize = 100;
const INTERIOR: u8 = 0x05;
const LEAF: u8 = 0x0D;
/// Encoding of texts that rosbag2 uses.
const UTF_8: u32 = 1;

/// A value of a row.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Null,
    Integer(i64),
    Real,
    Text(String),
    Blob(Vec<u8>),
}

impl Value {
    pub(super) fn text(&self) -> Option<&str> {
        if let Self::Text(text) = self { Some(text) } else { None }
    }

    pub(super) fn integer(&self) -> Option<i64> {
        if let Self::Integer(number) = self { Some(*number) } else { None }
    }
}

/// A database in memory.
pub(super) struct Database<'a> {
    bytes: &'a [u8],
    page_bytes: usize,
    /// Bytes of a page that hold content.
    usable: usize,
}

/// A table: its first page, and the names of its columns.
#[derive(Debug, PartialEq)]
pub(super) struct Table {
    root: u32,
    pub(super) columns: Vec<String>,
    /// The column that holds the number of the row, which is not stored in it.
    row_id: Option<usize>,
}

impl<'a> Database<'a> {
    pub(super) fn open(bytes: &'a [u8]) -> Result<Self, String> {
        if bytes.len() < HEADER_BYTES || !bytes.starts_with(MAGIC) {
            return Err("this is no SQLite database".into());
        }
        let page_bytes = match u16_at(bytes, 16).unwrap_or_default() {
            1 => 0x1_0000,
            size => usize::from(size),
        };
        let usable = page_bytes.saturating_sub(usize::from(bytes[20]));
        if !page_bytes.is_power_of_two() || page_bytes < 512 || usable < 480 {
            return Err(format!("its pages would have {page_bytes} bytes: the file is damaged"));
        }
        match u32_at(bytes, 56) {
            Some(UTF_8) => Ok(Self { bytes, page_bytes, usable }),
            _ => Err("its texts are no UTF-8".into()),
        }
    }

    /// The table of a name.
    pub(super) fn table(&self, wanted: &str) -> Result<Option<Table>, String> {
        let mut found = None;
        // Its own first table lists the others.
        let schema = Table { root: 1, columns: Vec::new(), row_id: None };
        self.rows(&schema, |row| {
            let [kind, name, _, root, sql] = &row[..] else { return Ok(()) };
            if kind.text() == Some("table") && name.text() == Some(wanted) {
                let root = root.integer().and_then(|root| u32::try_from(root).ok());
                let sql = sql.text().unwrap_or_default();
                found = root.map(|root| Table::of(root, sql));
            }
            Ok(())
        })?;
        Ok(found)
    }

    /// Gives every row of a table to `take`, in the order of their numbers.
    pub(super) fn rows(
        &self,
        table: &Table,
        mut take: impl FnMut(Vec<Value>) -> Result<(), String>,
    ) -> Result<(), String> {
        // A page that is met twice would lead round in a circle.
        let mut seen = HashSet::new();
        let mut pages = vec![table.root];
        while let Some(number) = pages.pop() {
            if !seen.insert(number) {
                return Err(format!("page {number} is in two places: the file is damaged"));
            }
            let (page, start) = self.page(number)?;
            let damaged = || format!("page {number} is damaged");
            let kind = *page.get(start).ok_or_else(damaged)?;
            let cells = usize::from(u16_at(page, start + 3).ok_or_else(damaged)?);
            let pointers = start + if kind == INTERIOR { 12 } else { 8 };
            let cell = |k: usize| u16_at(page, pointers + 2 * k).map(usize::from);
            match kind {
                INTERIOR => {
                    let last = u32_at(page, start + 8).ok_or_else(damaged)?;
                    let children = (0..cells).map(|k| cell(k).and_then(|at| u32_at(page, at)));
                    let children = children.collect::<Option<Vec<_>>>().ok_or_else(damaged)?;
                    pages.push(last);
                    pages.extend(children.into_iter().rev());
                }
                LEAF => {
                    for k in 0..cells {
                        let at = cell(k).ok_or_else(damaged)?;
                        let (row_id, payload) = self.payload(page, at).ok_or_else(damaged)??;
                        let mut row = record(&payload).ok_or_else(damaged)?;
                        if let Some(value) = table.row_id.and_then(|at| row.get_mut(at)) {
                            *value = Value::Integer(row_id);
                        }
                        take(row)?;
                    }
                }
                other => return Err(format!("page {number} has the unknown kind {other}")),
            }
        }
        Ok(())
    }

    /// A page, and where its content begins.
    fn page(&self, number: u32) -> Result<(&'a [u8], usize), String> {
        let index = usize::try_from(number).ok().and_then(|number| number.checked_sub(1));
        let start = index.and_then(|index| index.checked_mul(self.page_bytes));
        let page = start.and_then(|start| self.bytes.get(start..)?.get(..self.page_bytes));
        let page = page.ok_or_else(|| {
            format!("page {number} is not there: the file was cut short, or is still being written")
        })?;
        Ok((page, if number == 1 { HEADER_BYTES } else { 0 }))
    }

    /// The number of a row and its bytes; `None` where the cell is damaged.
    fn payload(&self, page: &[u8], at: usize) -> Option<Result<(i64, Vec<u8>), String>> {
        let mut rest = page.get(at..)?;
        let length = usize::try_from(varint(&mut rest)?).ok().filter(|n| *n <= self.bytes.len())?;
        let row_id = varint(&mut rest)?;
        let most = self.usable - 35;
        let least = (self.usable - 12) * 32 / 255 - 23;
        let local = match length <= most {
            true => length,
            false => {
                let local = least + (length - least) % (self.usable - 4);
                if local <= most { local } else { least }
            }
        };
        let mut payload = rest.get(..local)?.to_vec();
        let mut next = if local < length { u32_at(rest, local)? } else { 0 };
        while payload.len() < length {
            let page = match self.page(next) {
                Ok((page, _)) => page,
                Err(error) => return Some(Err(error)),
            };
            let take = (length - payload.len()).min(self.usable - 4);
            payload.extend(page.get(4..4 + take)?);
            next = u32_at(page, 0)?;
        }
        Some(Ok((row_id, payload)))
    }
}

impl Table {
    /// From `CREATE TABLE name (id INTEGER PRIMARY KEY, name TEXT NOT NULL, …)`.
    fn of(root: u32, sql: &str) -> Self {
        let inner = sql.split_once('(').map_or("", |(_, rest)| rest);
        let inner = inner.rsplit_once(')').map_or(inner, |(inner, _)| inner);
        let (mut parts, mut depth) = (vec![String::new()], 0_u32);
        for letter in inner.chars() {
            match letter {
                '(' => depth += 1,
                ')' => depth = depth.saturating_sub(1),
                ',' if depth == 0 => {
                    parts.push(String::new());
                    continue;
                }
                _ => {}
            }
            if let Some(part) = parts.last_mut() {
                part.push(letter);
            }
        }
        let is_row_id = |part: &String| {
            let words = part.split_whitespace().skip(1).collect::<Vec<_>>().join(" ");
            words.to_uppercase().starts_with("INTEGER PRIMARY KEY")
        };
        let name = |part: &String| {
            let word = part.split_whitespace().next().unwrap_or_default();
            word.trim_matches(['"', '`', '[', ']']).to_owned()
        };
        let row_id = parts.iter().position(is_row_id);
        Self { root, columns: parts.iter().map(name).collect(), row_id }
    }

    pub(super) fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column == name)
    }
}

fn record(payload: &[u8]) -> Option<Vec<Value>> {
    let mut rest = payload;
    let header = usize::try_from(varint(&mut rest)?).ok()?;
    let start = payload.len() - rest.len();
    let mut kinds = payload.get(start..header)?;
    let mut body = payload.get(header..)?;
    let mut values = Vec::new();
    while !kinds.is_empty() {
        let kind = u64::try_from(varint(&mut kinds)?).ok()?;
        let length = match kind {
            0 | 8 | 9 => 0,
            1..=4 => usize::try_from(kind).ok()?,
            5 => 6,
            6 | 7 => 8,
            10 | 11 => return None,
            _ => usize::try_from((kind - 12) / 2).ok()?,
        };
        let (own, after) = body.split_at_checked(length)?;
        body = after;
        values.push(match kind {
            0 => Value::Null,
            7 => Value::Real,
            8 => Value::Integer(0),
            9 => Value::Integer(1),
            1..=6 => {
                let sign = own.first().is_some_and(|first| first & 0x80 != 0);
                let start = if sign { -1_i64 } else { 0 };
                Value::Integer(own.iter().fold(start, |n, byte| n << 8 | i64::from(*byte)))
            }
            _ if kind % 2 == 0 => Value::Blob(own.to_vec()),
            _ => Value::Text(String::from_utf8_lossy(own).into_owned()),
        });
    }
    Some(values)
}

/// A number of one to nine bytes, the highest first.
fn varint(bytes: &mut &[u8]) -> Option<i64> {
    let mut number = 0_u64;
    for k in 0..9 {
        let (&byte, rest) = bytes.split_first()?;
        *bytes = rest;
        if k == 8 {
            return Some((number << 8 | u64::from(byte)).cast_signed());
        }
        number = number << 7 | u64::from(byte & 0x7F);
        if byte & 0x80 == 0 {
            break;
        }
    }
    Some(number.cast_signed())
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    bytes.get(at..)?.first_chunk().map(|bytes| u16::from_be_bytes(*bytes))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..)?.first_chunk().map(|bytes| u32::from_be_bytes(*bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_read_from_the_words_that_made_the_table() {
        let sql = "CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL, \
                   \"timestamp\" INTEGER NOT NULL, data BLOB NOT NULL CHECK (length(data) > 0))";
        let table = Table::of(3, sql);
        assert_eq!(table.columns, ["id", "topic_id", "timestamp", "data"]);
        assert_eq!(
            (table.row_id, table.column("data"), table.column("x")),
            (Some(0), Some(3), None)
        );
    }

    #[test]
    fn numbers_have_one_to_nine_bytes() {
        for (bytes, number) in [
            (&[0x7F][..], 0x7F),
            (&[0x81, 0x00], 0x80),
            (&[0xFF; 9], -1),
            (&[0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x05], 5),
        ] {
            assert_eq!(varint(&mut &bytes[..]), Some(number), "{bytes:?}");
        }
        assert_eq!(varint(&mut &[0x80][..]), None);
        // Header of 5 bytes: null, one byte, six bytes, a text of one letter.
        let values = record(&[5, 0, 1, 5, 15, 0xFE, 0xFF, 0, 0, 0, 0, 1, b'a']).unwrap();
        let six = i64::from_be_bytes([0xFF, 0xFF, 0xFF, 0, 0, 0, 0, 1]);
        let expected =
            [Value::Null, Value::Integer(-2), Value::Integer(six), Value::Text("a".into())];
        assert_eq!(values, expected);
        assert_eq!(record(&[3, 10, 1, 0]), None);
    }
}
