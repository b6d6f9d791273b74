//! What a log of a bus is, whatever tool wrote it, and the lines of those that are text.

use std::fmt;

use cathforce_bus::Frame;

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
    /// `None` for kinds of frames that this bus does not have: remote, CAN FD, errors.
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

impl BusLog {
    pub(super) fn new(format: LogFormat) -> Self {
        Self {
            format,
            frames: Vec::new(),
            channels: Vec::new(),
            started_ns: 0,
            remarks: Vec::new(),
        }
    }

    /// The index of a channel's name.
    fn channel(&mut self, name: &str) -> usize {
        let known = self.channels.iter().position(|known| known == name);
        known.unwrap_or_else(|| {
            self.channels.push(name.to_owned());
            self.channels.len() - 1
        })
    }

    pub(super) fn push(&mut self, line: usize, at_ns: u64, channel: &str, frame: Option<Frame>) {
        let channel = self.channel(channel);
        self.frames.push(Logged { line, at_ns, channel, frame });
    }
}

/// The lines of a text with their numbers, without the blanks around them and without empty ones.
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    line: usize,
}

/// A line, and whether its end is there.
pub(super) struct TextLine<'a> {
    line: usize,
    text: &'a str,
    is_ended: bool,
}

impl<'a> Lines<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
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
    pub(super) fn for_each(
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
