//! PEAK's TRC of versions 1.0 to 2.1.

use cathforce_bus::Frame;

use super::log::{BusLog, Lines, LogError, LogFormat};
use super::numbers::{bytes, frame, number, time_ns};

const FORM: &str = "a frame's line of version 1.1 is `1) 2.2 Rx 0100 8 01 02 03 04 05 06 07 08`; give \
                    the log as PCAN-View wrote it";
const MILLISECOND_NS: u64 = 1_000_000;
/// Days from the beginning of the file's calendar, 30 December 1899, to 1970.
const DAYS_TO_1970: f64 = 25_569.0;
const DAY_S: f64 = 86_400.0;

/// Columns of a frame's line.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Column {
    Number,
    Time,
    /// Rx or Tx, with other words for what is no frame.
    Direction,
    /// DT for a frame of data.
    Kind,
    Bus,
    Id,
    Reserved,
    Length,
}

use Column::{Bus, Direction, Id, Kind, Length, Number, Reserved, Time};

pub(super) fn is_line(line: &str) -> bool {
    line.split_ascii_whitespace().next().is_some_and(|word| {
        word.strip_suffix(')')
            .is_some_and(|number| !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit()))
    })
}

/// Reads a log. The version says how its lines are built; a file without one is of version 1.0.
pub(super) fn read(lines: Lines<'_>) -> Result<BusLog, LogError> {
    let mut log = BusLog::new(LogFormat::Trc);
    let mut columns = columns_of("1.0").unwrap_or_default();
    lines.for_each(&mut log, FORM, |log, line, text| {
        if let Some(heading) = text.strip_prefix(';') {
            let heading = heading.trim();
            if let Some(version) = heading.strip_prefix("$FILEVERSION=") {
                let found = columns_of(version.trim());
                columns =
                    found.ok_or_else(|| format!("version {version} of the format is not known"))?;
            } else if let Some(named) = heading.strip_prefix("$COLUMNS=") {
                columns = named_columns(named)?;
            } else if let Some(start) = heading.strip_prefix("$STARTTIME=") {
                log.started_ns = started_ns(start.trim()).unwrap_or_default();
            }
            return Ok(());
        }
        let (at_ns, channel, frame) = parse(&columns, text)?;
        log.push(line, at_ns.saturating_add(log.started_ns), channel, frame);
        Ok(())
    })?;
    Ok(log)
}

fn columns_of(version: &str) -> Option<Vec<Column>> {
    Some(match version {
        "1.0" => vec![Number, Time, Id, Length],
        "1.1" => vec![Number, Time, Direction, Id, Length],
        "1.2" => vec![Number, Time, Bus, Direction, Id, Length],
        "1.3" => vec![Number, Time, Bus, Direction, Id, Reserved, Length],
        "2.0" => vec![Number, Time, Kind, Id, Direction, Length],
        "2.1" => vec![Number, Time, Kind, Bus, Id, Direction, Reserved, Length],
        _ => return None,
    })
}

/// `N,O,T,B,I,d,R,L,D`: the data come last.
fn named_columns(named: &str) -> Result<Vec<Column>, String> {
    let column = |name: &str| match name.trim() {
        "N" => Some(Number),
        "O" => Some(Time),
        "T" => Some(Kind),
        "B" => Some(Bus),
        "I" => Some(Id),
        "d" => Some(Direction),
        "R" => Some(Reserved),
        "L" | "l" => Some(Length),
        _ => None,
    };
    let names = named.split(',').map(str::trim).filter(|name| *name != "D");
    let columns = names.map(column).collect::<Option<Vec<_>>>();
    let columns =
        columns.filter(|columns| [Time, Id, Length].iter().all(|one| columns.contains(one)));
    columns.ok_or_else(|| format!("the columns `{named}` are not known"))
}

fn started_ns(days: &str) -> Option<u64> {
    let seconds = (days.parse::<f64>().ok()? - DAYS_TO_1970) * DAY_S;
    // A microsecond is what such a number holds.
    (seconds > 0.0 && seconds < 1e10).then(|| (seconds * 1e6).round() as u64 * 1000)
}

fn parse<'a>(columns: &[Column], line: &'a str) -> Result<(u64, &'a str, Option<Frame>), String> {
    let words = line.split_ascii_whitespace().collect::<Vec<_>>();
    let word = |column: Column| {
        let at = columns.iter().position(|one| *one == column)?;
        words.get(at).copied()
    };
    let time = word(Time).unwrap_or_default();
    let at_ns =
        time_ns(time, MILLISECOND_NS).ok_or_else(|| format!("`{time}` is no time in ms"))?;
    let channel = word(Bus).unwrap_or("1");
    let is_frame = word(Direction).is_none_or(|word| matches!(word, "Rx" | "Tx"))
        && word(Kind).is_none_or(|kind| kind == "DT");
    let id = word(Id).unwrap_or_default();
    let data = words.get(columns.len()..).unwrap_or_default();
    if !is_frame || data.first() == Some(&"RTR") {
        return Ok((at_ns, channel, None));
    }
    let raw = number(id, 16).ok_or_else(|| format!("`{id}` is no identifier"))?;
    let length = word(Length).unwrap_or_default();
    let bytes_said = length.parse::<usize>().map_err(|_| format!("`{length}` is no length"))?;
    let data = bytes(data.iter().copied(), 16).ok_or("a byte is no number")?;
    if data.len() != bytes_said {
        return Err(format!("the frame has {} bytes, not its {bytes_said}", data.len()));
    }
    // Identifiers of 11 bits have four digits, those of 29 bits have eight.
    Ok((at_ns, channel, Some(frame(raw, id.len() > 4, &data)?)))
}

#[cfg(test)]
mod tests {
    use cathforce_bus::EXTENDED;

    use super::*;

    #[test]
    fn every_version_gives_the_same_frame() {
        let frame = Frame::new(0x123, &[1, 0xFF]);
        for (version, line) in [
            (None, "1)     2  0123  2  01 FF"),
            (Some("1.1"), "1)   2.0  Rx  0123  2  01 FF"),
            (Some("1.2"), "1)   2.000 1  Rx  0123  2  01 FF"),
            (Some("1.3"), "1)   2.000 1  Rx  0123 -  2  01 FF"),
            (Some("2.0"), "1  2.000 DT  0123 Rx 2  01 FF"),
            (Some("2.1"), "1  2.000 DT 1  0123 Rx -  2  01 FF"),
        ] {
            let heading =
                version.map_or(String::new(), |version| format!(";$FILEVERSION={version}\n"));
            let text = format!("{heading};   Start time: 27.11.2026\n{line}\n");
            let log = BusLog::read(text.as_bytes())
                .unwrap_or_else(|error| panic!("{version:?}: {error}"));
            assert_eq!((log.format, log.frames.len()), (LogFormat::Trc, 1));
            assert_eq!(
                (log.frames[0].frame, log.frames[0].at_ns),
                (frame, 2 * MILLISECOND_NS),
                "{version:?}"
            );
        }
    }

    #[test]
    fn other_kinds_of_frames_and_the_time_of_day_are_understood() {
        let text = ";$FILEVERSION=2.1\n;$STARTTIME=45000.5\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n\
                    1 0.5 DT 2 18FF50E5 Rx - 1 00\n2 0.6 RR 2 0123 Rx - 8\n3 0.7 ST 2 - Rx - 4 00 00 00 08\n\
                    4 0.8 DT 2 0123 Tx - 1 07\n";
        let log = BusLog::read(text.as_bytes()).unwrap();
        let frames = log.frames.iter().map(|logged| logged.frame).collect::<Vec<_>>();
        let extended = Frame::new(EXTENDED | 0x18FF_50E5, &[0]);
        assert_eq!(frames, [extended, None, None, Frame::new(0x123, &[7])]);
        // Noon of 15 March 2023, by the calendar.
        assert_eq!(log.started_ns, 1_678_881_600_000_000_000);
        assert_eq!(log.frames[3].at_ns - log.started_ns, 800_000);
        let other = BusLog::read(b";$FILEVERSION=9.9\n1) 2 0123 0\n").unwrap_err();
        assert!(other.line == 1 && other.problem.contains("9.9"), "{other}");
        let short = BusLog::read(b";\n1) 2 0123 3 01 02\n2) 3 0123 0\n").unwrap_err();
        assert!(short.line == 2 && short.problem.contains("2 bytes, not its 3"), "{short}");
    }
}
