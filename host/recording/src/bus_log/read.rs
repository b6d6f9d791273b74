//! Reads a log, whose format its content tells.

use std::io::Read as _;

use super::log::{BusLog, Lines, LogError, LogFormat};
use super::{asc, blf, candump, table, trc};

/// Largest log that is unpacked \[bytes\]: hours of a full bus, and no memory is filled by a few bytes.
const LARGEST: u64 = 4 << 30;
const GZIP: [u8; 2] = [0x1F, 0x8B];
const MDF: &[u8] = b"MDF     ";

const FORMATS: &str = "give a log of candump, Vector ASC or BLF, PEAK TRC, or a table of SavvyCAN or \
                       python-can";
const NOT_MDF: &str = "export the bus log as BLF or ASC, for example with `python -m can.logconvert \
                       in.mf4 out.blf`";

impl BusLog {
    /// Reads a log of any format.
    pub fn read(bytes: &[u8]) -> Result<Self, LogError> {
        let wrong = |problem: String, fix| LogError { line: 1, problem, fix };
        let unpacked;
        let bytes = match bytes.starts_with(&GZIP) {
            true => {
                unpacked = unzipped(bytes).map_err(|problem| wrong(problem, "copy it again"))?;
                &unpacked[..]
            }
            false => bytes,
        };
        if bytes.starts_with(blf::MAGIC) {
            return blf::read(bytes);
        }
        if bytes.starts_with(MDF) {
            return Err(wrong("this is an MF4 file, which is not read here".into(), NOT_MDF));
        }
        let format = text_format(bytes)
            .ok_or_else(|| wrong("this is no log of a CAN bus".into(), FORMATS))?;
        let text = Lines::new(bytes);
        match format {
            LogFormat::Candump => candump::read(text),
            LogFormat::Asc => asc::read(text),
            LogFormat::Trc => trc::read(text),
            LogFormat::SavvyCan | LogFormat::PythonCan => table::read(text, format),
            LogFormat::Blf => blf::read(bytes),
        }
    }

    /// Whether bytes look like a log of some format, judged by their beginning.
    pub fn is_one(bytes: &[u8]) -> bool {
        bytes.starts_with(&GZIP)
            || bytes.starts_with(blf::MAGIC)
            || bytes.starts_with(MDF)
            || text_format(bytes).is_some()
    }
}

fn unzipped(bytes: &[u8]) -> Result<Vec<u8>, String> {
    let mut unpacked = Vec::new();
    // A log may be packed in several pieces.
    let decoder = flate2::read::MultiGzDecoder::new(bytes);
    let read = decoder.take(LARGEST + 1).read_to_end(&mut unpacked);
    read.map_err(|e| format!("the file is packed by gzip and damaged: {e}"))?;
    match unpacked.len() as u64 > LARGEST {
        true => Err(format!("it would have more than {LARGEST} bytes when it is unpacked")),
        false => Ok(unpacked),
    }
}

/// The format of a text, by its first lines that are not empty.
fn text_format(bytes: &[u8]) -> Option<LogFormat> {
    const HEAD: usize = 4096;
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(HEAD)]);
    let first =
        head.trim_start_matches('\u{feff}').lines().map(str::trim).find(|line| !line.is_empty())?;
    let small = first.to_ascii_lowercase();
    let begins = |words: &[&str]| words.iter().any(|word| small.starts_with(word));
    if table::is_savvycan(first) {
        Some(LogFormat::SavvyCan)
    } else if table::is_python_can(first) {
        Some(LogFormat::PythonCan)
    } else if begins(&[";"]) || trc::is_line(first) {
        Some(LogFormat::Trc)
    } else if begins(&[
        "date ",
        "base ",
        "begin triggerblock",
        "begin trigger block",
        "internal events",
        "no internal events",
        "// version",
    ]) {
        Some(LogFormat::Asc)
    } else if candump::is_line(first) {
        Some(LogFormat::Candump)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use super::*;

    #[test]
    fn the_format_is_told_by_the_content_packed_or_not() {
        let log = b"(1.5) can0 100#0102030405060708\n";
        let whole = BusLog::read(log).unwrap();
        let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        packer.write_all(log).unwrap();
        let packed = packer.finish().unwrap();
        assert_eq!(BusLog::read(&packed).unwrap(), whole);
        let cut = BusLog::read(&packed[..packed.len() - 9]).unwrap_err();
        assert!(cut.problem.contains("gzip and damaged"), "{cut}");
        assert!(BusLog::read(b"MDF     4.10").unwrap_err().fix.contains("logconvert"));
        let other = BusLog::read(b"solid vessel\n").unwrap_err();
        assert!(other.problem.contains("no log") && !BusLog::is_one(b"solid vessel\n"), "{other}");
    }
}
