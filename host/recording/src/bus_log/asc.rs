//! Vector's ASC, the text of CANoe and CANalyzer.

use super::log::{BusLog, Lines, LogError, LogFormat};
use super::numbers::{bytes, frame, number, time_ns};

const FORM: &str = "a frame's line is `0.001000 1 100 Rx d 8 01 02 03 04 05 06 07 08`";
const SECOND_NS: u64 = 1_000_000_000;

/// Reads a log. Lines that begin with no time are headings and remarks; what is no frame of a classic
/// bus is left without a frame.
pub(super) fn read(lines: Lines<'_>) -> Result<BusLog, LogError> {
    let mut log = BusLog::new(LogFormat::Asc);
    let (mut base, mut is_relative, mut last_ns) = (16, false, 0_u64);
    lines.for_each(&mut log, FORM, |log, line, text| {
        let small = text.to_ascii_lowercase();
        if small.starts_with("base ") {
            base = if small.starts_with("base dec") { 10 } else { 16 };
            is_relative = small.contains("timestamps relative");
            return Ok(());
        }
        let mut words = text.split_ascii_whitespace();
        let Some(time) = words.next().and_then(|word| time_ns(word, SECOND_NS)) else {
            let is_begun = text.bytes().next().is_some_and(|byte| byte.is_ascii_digit());
            return if is_begun {
                Err("the line does not begin with a time".into())
            } else {
                Ok(())
            };
        };
        // In such a log each event has the time since the event before it.
        let at_ns = if is_relative { last_ns.saturating_add(time) } else { time };
        last_ns = at_ns;
        let words = words.collect::<Vec<_>>();
        let [channel, id, rest @ ..] = &words[..] else { return Ok(()) };
        if *channel == "CANFD" {
            log.push(line, at_ns, id, None);
            return Ok(());
        }
        if !channel.bytes().all(|byte| byte.is_ascii_digit()) {
            return Ok(());
        }
        let found = match rest {
            // `ErrorFrame` stands where a frame has its identifier.
            [_, "d" | "D", length, data @ ..] => {
                let short = id.strip_suffix(['x', 'X']);
                let raw = number(short.unwrap_or(id), base)
                    .ok_or_else(|| format!("`{id}` is no identifier"))?;
                // The length is one digit of either base.
                let length =
                    number(length, 16).ok_or_else(|| format!("`{length}` is no length"))?;
                let length = (length as usize).min(8);
                let data = data
                    .get(..length)
                    .ok_or_else(|| format!("the frame has not its {length} bytes"))?;
                let data = bytes(data.iter().copied(), base).ok_or("a byte is no number")?;
                Some(frame(raw, short.is_some(), &data)?)
            }
            [direction, ..] if ["Rx", "Tx", "TxRq", "rx", "tx"].contains(direction) => None,
            _ if *id == "ErrorFrame" => None,
            // Statistics and events of the tool.
            _ => return Ok(()),
        };
        log.push(line, at_ns, channel, found);
        Ok(())
    })?;
    Ok(log)
}

#[cfg(test)]
mod tests {
    use cathforce_bus::{EXTENDED, Frame};

    use super::*;

    const LOG: &str = "date Fri Nov 27 10:15:02.250 am 2026\nbase hex  timestamps absolute\n\
        internal events logged\n// version 9.0.0\nBegin Triggerblock Fri Nov 27 10:15:02.250 am 2026\n\
        \u{20}  0.000000 Start of measurement\n\
        \u{20}  0.001000 1  100             Rx   d 3 01 1a FF  Length = 180000 BitCount = 92\n\
        \u{20}  0.002000 1  18FF50E5x       Rx   d 2 00 11\n\
        \u{20}  0.003000 2  100             Tx   r\n\
        \u{20}  0.004000 1  ErrorFrame\n\
        \u{20}  0.005000 CANFD   1 Rx        100                   0 0 8  8 01 02 03 04 05 06 07 08\n\
        \u{20}  1.000000 1  Statistic: D 3 R 0 XD 1 XR 0 E 1 O 0 B 0.1%\n\
        End TriggerBlock\n";

    #[test]
    fn frames_are_told_from_what_else_the_tool_writes() {
        let log = BusLog::read(LOG.as_bytes()).unwrap();
        assert_eq!(log.format, LogFormat::Asc);
        let found =
            log.frames.iter().map(|logged| (logged.line, logged.at_ns / 1_000_000, logged.frame));
        let frame = Frame::new(0x100, &[1, 0x1A, 0xFF]);
        let extended = Frame::new(EXTENDED | 0x18FF_50E5, &[0, 0x11]);
        let expected =
            [(7, 1, frame), (8, 2, extended), (9, 3, None), (10, 4, None), (11, 5, None)];
        assert_eq!(found.collect::<Vec<_>>(), expected);
        assert_eq!(log.channels, ["1", "2"]);
    }

    #[test]
    fn decimal_numbers_and_relative_times_are_what_the_heading_says() {
        let text =
            "date x\nbase dec  timestamps relative\n0.5 1 256 Rx d 2 10 255\n0.5 1 256 Rx d 0\n";
        let log = BusLog::read(text.as_bytes()).unwrap();
        assert_eq!(log.frames[0].frame, Frame::new(0x100, &[10, 255]));
        assert_eq!(log.frames[1].at_ns, SECOND_NS);
        let short =
            BusLog::read(b"base hex\n0.5 1 100 Rx d 3 01 02\n0.6 1 100 Rx d 0\n").unwrap_err();
        assert!(short.line == 2 && short.problem.contains("has not its 3 bytes"), "{short}");
        let wide = BusLog::read(b"base hex\n0.5 1 900 Rx d 0\n0.6 1 100 Rx d 0\n").unwrap_err();
        assert!(wide.problem.contains("0x900"), "{wide}");
    }
}
