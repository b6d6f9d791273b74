//! Logs of a CAN bus as other tools write them: candump, Vector ASC and BLF, PEAK TRC, and the tables of
//! SavvyCAN and python-can; each of them packed by gzip or not.
//!
//! The format is told by the content, so that a name's ending does not matter.

mod asc;
mod blf;
mod candump;
mod numbers;
mod table;
mod trc;

use std::fmt;
use std::io::Read as _;

use cathforce_bus::Frame;

/// Largest log that is unpacked \[bytes\]: hours of a full bus, and no memory is filled by a few bytes.
const LARGEST: u64 = 4 << 30;
const GZIP: [u8; 2] = [0x1F, 0x8B];
const MDF: &[u8] = b"MDF     ";

/// A format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogFormat {
    Candump,
    Asc,
    Trc,
    Blf,
    SavvyCan,
    PythonCan,
}

/// A frame that was logged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Logged {
    /// Its line, or in a binary file the number of its record, from 1.
    pub line: usize,
    /// Since 1970, or since the log's beginning if the log does not state the day \[ns\].
    pub at_ns: u64,
    /// Index of its channel.
    pub channel: usize,
    /// `None` for kinds of frames that this bus does not have: extended, remote, CAN FD, errors.
    pub frame: Option<Frame>,
}

/// A log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BusLog {
    pub format: LogFormat,
    pub frames: Vec<Logged>,
    /// Names of the channels.
    pub channels: Vec<String>,
    /// When the log began, since 1970 \[ns\]; 0 if it does not say.
    pub started_ns: u64,
    /// What was left out, with its place.
    pub remarks: Vec<String>,
}

/// A place of a log that is no frame.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {problem}; fix: {fix}")]
pub struct LogError {
    pub line: usize,
    pub problem: String,
    pub fix: &'static str,
}

impl fmt::Display for LogFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Candump => "candump",
            Self::Asc => "Vector ASC",
            Self::Trc => "PEAK TRC",
            Self::Blf => "Vector BLF",
            Self::SavvyCan => "a table of SavvyCAN",
            Self::PythonCan => "a table of python-can",
        })
    }
}

const FORMATS: &str = "give a log of candump, Vector ASC or BLF, PEAK TRC, or a table of SavvyCAN or \
                       python-can";
const NOT_MDF: &str = "export the bus log as BLF or ASC, for example with `python -m can.logconvert \
                       in.mf4 out.blf`";

impl BusLog {
    fn new(format: LogFormat) -> Self {
        Self {
            format,
            frames: Vec::new(),
            channels: Vec::new(),
            started_ns: 0,
            remarks: Vec::new(),
        }
    }

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

    /// The index of a channel's name.
    fn channel(&mut self, name: &str) -> usize {
        let known = self.channels.iter().position(|known| known == name);
        known.unwrap_or_else(|| {
            self.channels.push(name.to_owned());
            self.channels.len() - 1
        })
    }

    fn push(&mut self, line: usize, at_ns: u64, channel: &str, frame: Option<Frame>) {
        let channel = self.channel(channel);
        self.frames.push(Logged { line, at_ns, channel, frame });
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

/// The lines of a text with their numbers, without the blanks around them and without empty ones.
struct Lines<'a> {
    rest: &'a [u8],
    line: usize,
}

/// A line, and whether its end is there.
struct TextLine<'a> {
    line: usize,
    text: &'a str,
    is_ended: bool,
}

impl<'a> Lines<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes), line: 0 }
    }

    /// The next line; an error if it is no UTF-8.
    fn next(&mut self) -> Result<Option<TextLine<'a>>, LogError> {
        loop {
            if self.rest.is_empty() {
                return Ok(None);
            }
            self.line += 1;
            let end = self.rest.iter().position(|byte| *byte == b'\n');
            let (line, rest) = match end {
                Some(end) => (&self.rest[..end], &self.rest[end + 1..]),
                None => (self.rest, &[][..]),
            };
            self.rest = rest;
            let text = std::str::from_utf8(line).map(str::trim).map_err(|_| LogError {
                line: self.line,
                problem: "this is no UTF-8 text".into(),
                fix: "give the log as the tool wrote it",
            })?;
            if !text.is_empty() {
                return Ok(Some(TextLine { line: self.line, text, is_ended: end.is_some() }));
            }
        }
    }

    /// Hands every line to `take`. A last line that is cut off is left out with a remark.
    fn for_each(
        mut self,
        log: &mut BusLog,
        form: &'static str,
        mut take: impl FnMut(&mut BusLog, usize, &str) -> Result<(), String>,
    ) -> Result<(), LogError> {
        while let Some(TextLine { line, text, is_ended }) = self.next()? {
            match take(log, line, text) {
                Ok(()) => {}
                Err(_) if !is_ended && !log.frames.is_empty() => {
                    log.remarks.push(format!(
                        "line {line}, the last, is cut off and left out: `{}`",
                        text.escape_debug()
                    ));
                }
                Err(problem) => return Err(LogError { line, problem, fix: form }),
            }
        }
        Ok(())
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
