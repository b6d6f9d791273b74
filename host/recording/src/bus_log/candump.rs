//! Logs of `candump -l`, and what `candump -t a` prints.

use cathforce_bus::Frame;

use super::log::{BusLog, Lines, LogError, LogFormat};
use super::numbers::{byte, bytes, number, time_ns};

const FORM: &str = "a line is `(1700000000.000000) can0 100#0102030405060708`, as `candump -l` \
                    writes it";
const SECOND_NS: u64 = 1_000_000_000;

pub(super) fn is_line(line: &str) -> bool {
    line.starts_with('(') || parse(line).is_ok()
}

/// Reads a log; empty lines are passed over, any other line that is no frame is an error.
pub(super) fn read(lines: Lines<'_>) -> Result<BusLog, LogError> {
    let mut log = BusLog::new(LogFormat::Candump);
    lines.for_each(&mut log, FORM, |log, line, text| {
        let (at_ns, interface, frame) = parse(text)?;
        log.push(line, at_ns, interface, frame);
        Ok(())
    })?;
    log.started_ns = log.frames.first().map_or(0, |frame| frame.at_ns);
    Ok(log)
}

/// Time \[ns\], interface and frame of a line.
fn parse(line: &str) -> Result<(u64, &str, Option<Frame>), String> {
    let mut words = line.split_ascii_whitespace().peekable();
    let time = words.next().unwrap_or_default();
    let at_ns = parse_time(time).ok_or_else(|| format!("`{time}` is no time in brackets"))?;
    let (Some(interface), Some(frame)) = (words.next(), words.next()) else {
        return Err("interface or frame is missing".into());
    };
    if let Some(length) = words.peek().and_then(|word| word.strip_prefix('[')) {
        let length = length.trim_end_matches(']').parse::<usize>();
        let length = length.map_err(|_| format!("`{line}` has no length in brackets"))?;
        words.next();
        return Ok((at_ns, interface, spaced(frame, length, words)?));
    }
    match (words.next(), words.next()) {
        (None | Some("T" | "R"), None) => {}
        (Some(more), _) | (None, Some(more)) => return Err(format!("`{more}` follows the frame")),
    }
    Ok((at_ns, interface, parse_frame(frame).ok_or_else(|| format!("`{frame}` is no frame"))?))
}

/// `123  [2]  01 02`, as candump prints on a terminal.
fn spaced<'a>(
    id: &str,
    length: usize,
    words: impl Iterator<Item = &'a str>,
) -> Result<Option<Frame>, String> {
    let wrong = || format!("`{id}` is no frame");
    let raw = number(id, 16).ok_or_else(wrong)?;
    let mut words = words.take_while(|word| !word.starts_with('\'')).peekable();
    if !matches!(id.len(), 3 | 8) || words.peek() == Some(&"remote") || length > 8 {
        return Ok(None);
    }
    let data = bytes(words, 16).filter(|data| data.len() == length).ok_or_else(wrong)?;
    super::numbers::frame(raw, id.len() == 8, &data).map(Some).map_err(|_| wrong())
}

fn parse_time(text: &str) -> Option<u64> {
    let time = text.strip_prefix('(')?.strip_suffix(')')?;
    let (_, part) = time.split_once('.')?;
    if part.is_empty() || part.len() > 9 {
        return None;
    }
    time_ns(time, SECOND_NS)
}

fn parse_frame(text: &str) -> Option<Option<Frame>> {
    let (id, data) = text.split_once('#')?;
    let raw = number(id, 16).filter(|_| matches!(id.len(), 3 | 8))?;
    if data.starts_with('#') || data.starts_with('R') {
        return Some(None);
    }
    let pair = |pair: &[u8]| {
        let text = std::str::from_utf8(pair).ok().filter(|pair| pair.len() == 2)?;
        byte(text, 16)
    };
    let bytes = data.as_bytes().chunks(2).map(pair).collect::<Option<Vec<_>>>();
    let bytes = bytes.filter(|bytes| bytes.len() <= 8)?;
    // Errors of the bus have identifiers of more than 29 bits.
    Some(super::numbers::frame(raw, id.len() == 8, &bytes).ok())
}

#[cfg(test)]
mod tests {
    use cathforce_bus::EXTENDED;

    use super::*;

    #[test]
    fn both_notations_of_candump_are_read() {
        let text = " (1.5)  can0  123   [2]  01 FF   '..'\n(1.6) vcan1 123#01FF R\n\
                    (1.7) can0 12345678 [0]\n(1.8) can0 123 [2] remote request\n";
        let log = BusLog::read(text.as_bytes()).unwrap();
        let frame = Frame::new(0x123, &[1, 0xFF]);
        let frames = log.frames.iter().map(|logged| logged.frame).collect::<Vec<_>>();
        let extended = Frame::new(EXTENDED | 0x1234_5678, &[]);
        assert_eq!(frames, [frame, frame, extended, None]);
        assert_eq!(log.channels, ["can0", "vcan1"]);
        assert_eq!((log.started_ns, log.frames[1].line), (1_500_000_000, 2));
    }

    #[test]
    fn a_last_line_that_is_cut_off_is_left_out_and_said() {
        let log = BusLog::read(b"(1.5) can0 100#01\n(1.6) can0 100#010").unwrap();
        assert_eq!(log.frames.len(), 1);
        assert!(log.remarks[0].contains("line 2, the last") && log.remarks[0].contains("100#010"));
        assert!(BusLog::read(b"(1.5) can0 100#010\n(1.6) can0 100#01\n").is_err());
    }
}
