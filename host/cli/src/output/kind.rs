//! Recognises the kind of a file, so that a file is replaced only by one of its own kind.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use cathforce_config::image::MAGIC;
use cathforce_mechanics::{BRICK_NODES, FINE, FREE, NODE_BYTES, OCTANTS, OUTSIDE};
use cathforce_recording::is_recording;

use super::settings_file::is_settings;

/// The kind of a file that a command writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind<'a> {
    Recording,
    /// A web page.
    Page,
    Json,
    DeviceImage,
    /// The field of a lumen, which has no magic number.
    Lumen,
    Settings,
    /// A CSV whose heading begins with this text.
    Table(&'a str),
    Parquet,
    Candump,
    /// The page of the reproduced figures.
    Reproduced,
}

/// The tables of ticks and of nodes, by their first columns.
pub const TICKS: Kind<'static> = Kind::Table("tick,t_s,mode,");
pub const NODES: Kind<'static> = Kind::Table("t_s,node,x_m,y_m,z_m,");

/// Bytes that are read to recognise a file; a heading is shorter.
const HEAD_BYTES: usize = 4096;

impl Kind<'_> {
    /// The kind in words, with its article.
    pub fn name(self) -> &'static str {
        match self {
            Self::Recording => "a recording",
            Self::Page => "a web page",
            Self::Json => "a JSON document",
            Self::DeviceImage => "a device image",
            Self::Lumen => "a lumen",
            Self::Settings => "a settings file",
            Self::Table(_) => "a table with these columns",
            Self::Parquet => "a Parquet file",
            Self::Candump => "a log of candump",
            Self::Reproduced => "a page of reproduced figures",
        }
    }

    /// Whether a file is of this kind. An empty file is of every kind; an unreadable one of none.
    pub fn is_in(self, path: &Path) -> bool {
        if path.metadata().is_ok_and(|file| file.len() == 0) {
            return true;
        }
        let whole = || std::fs::read(path).unwrap_or_default();
        match self {
            Self::Recording => is_recording(path),
            Self::Page => begins(path, |text| {
                text.get(..14).is_some_and(|text| text.eq_ignore_ascii_case("<!doctype html"))
            }),
            Self::Json => serde_json::from_slice::<serde::de::IgnoredAny>(&whole()).is_ok(),
            Self::DeviceImage => head(path).starts_with(&MAGIC),
            Self::Lumen => is_lumen(&whole()),
            Self::Settings => std::fs::read_to_string(path).is_ok_and(|text| is_settings(&text)),
            Self::Table(heading) => begins(path, |text| text.starts_with(heading)),
            Self::Parquet => head(path).starts_with(b"PAR1"),
            Self::Candump => begins(path, is_candump),
            Self::Reproduced => begins(path, |text| text.starts_with("# Reproduced\n")),
        }
    }
}

/// Whether a web page was made by cathforce, or is empty.
pub fn is_own_page(path: &Path) -> bool {
    let head = head(path);
    head.is_empty() || String::from_utf8_lossy(&head).contains(GENERATOR)
}

/// In the head of every page that cathforce makes.
const GENERATOR: &str = "<meta name=\"generator\" content=\"cathforce\">";

fn head(path: &Path) -> Vec<u8> {
    let mut bytes = Vec::new();
    // An unreadable file is of no known kind.
    let _ = File::open(path).and_then(|file| file.take(HEAD_BYTES as u64).read_to_end(&mut bytes));
    bytes
}

fn begins(path: &Path, like: impl Fn(&str) -> bool) -> bool {
    let head = head(path);
    let text = String::from_utf8_lossy(&head);
    like(text.trim_start_matches('\u{feff}').trim_start())
}

/// `(1700000000.123456) can0 100#…`
fn is_candump(text: &str) -> bool {
    let mut words = text.lines().next().unwrap_or_default().split_whitespace();
    let time = words.next().and_then(|word| word.strip_prefix('(')?.strip_suffix(')'));
    time.is_some_and(|time| time.parse::<f64>().is_ok())
        && words.nth(1).is_some_and(|frame| frame.contains('#'))
}

/// The directory of a lumen numbers its bricks in order, and the bricks fill the rest of the file.
fn is_lumen(bytes: &[u8]) -> bool {
    let mut stored: u16 = 0;
    for (i, entry) in bytes.chunks_exact(2).enumerate() {
        let bricks = match u16::from_le_bytes([entry[0], entry[1]]) {
            FREE | OUTSIDE => 0,
            entry if entry == stored => 1,
            entry if entry == FINE | stored => OCTANTS,
            _ => return false,
        };
        let Some(count) = stored.checked_add(bricks) else { return false };
        stored = count;
        let length = 2 * (i + 1) + usize::from(stored) * BRICK_NODES * NODE_BYTES;
        if stored > 0 && length == bytes.len() {
            return true;
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_is_told_from_the_others_and_from_what_somebody_measured() {
        let folder = tempfile::tempdir().unwrap();
        let mut lumen = [FREE, 0, OUTSIDE, FINE | 1].map(u16::to_le_bytes).concat();
        lumen.resize(lumen.len() + 9 * BRICK_NODES * NODE_BYTES, 7);
        let kinds: [(Kind<'_>, &[u8]); 10] = [
            (Kind::Recording, &mcap_magic()),
            (Kind::Page, b"\n<!DOCTYPE html><p>"),
            (Kind::Json, b"{\"ticks\": 3}\n"),
            (Kind::DeviceImage, b"CFIM and more"),
            (Kind::Lumen, &lumen),
            (Kind::Settings, b"rig = \"a\"\n[set]\n"),
            (TICKS, b"tick,t_s,mode,fault\n"),
            (Kind::Parquet, b"PAR1..."),
            (Kind::Candump, b"(1700000000.000000) can0 100#00\n"),
            (Kind::Reproduced, b"# Reproduced\n\n"),
        ];
        let measured: [&[u8]; 4] = [
            b"t_s,insertion_m,rotation_rad,fx_N,fy_N,fz_N\n0,0.1,0,,,\n",
            b"time;feed\n0;1\n",
            b"format = \"trial-bundle/1\"\nname = \"a\"\n",
            b"solid vessel\nfacet normal 0 0 1\n",
        ];
        let path = folder.path().join("file");
        let all = kinds.iter().map(|(_, bytes)| *bytes).chain(measured);
        for (i, bytes) in all.enumerate() {
            std::fs::write(&path, bytes).unwrap();
            for (k, (kind, _)) in kinds.iter().enumerate() {
                assert_eq!(kind.is_in(&path), i == k, "{kind:?} in {i}");
            }
        }
        std::fs::write(&path, "").unwrap();
        assert!(kinds.iter().all(|(kind, _)| kind.is_in(&path)), "an empty file is nobody's");
    }

    fn mcap_magic() -> [u8; 8] {
        [0x89, b'M', b'C', b'A', b'P', 0x30, b'\r', b'\n']
    }
}
