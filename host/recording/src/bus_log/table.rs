//! The tables of SavvyCAN and python-can.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use cathforce_bus::Frame;

use super::log::{BusLog, Lines, LogError, LogFormat};
use super::numbers::{bytes, frame, number, time_ns};

const FORM: &str = "write the line as the tool does, with as many fields as the heading";
const SECOND_NS: u64 = 1_000_000_000;
const MICROSECOND_NS: u64 = 1000;

pub(super) fn is_savvycan(heading: &str) -> bool {
    heading.to_ascii_lowercase().starts_with("time stamp,id,extended,")
}

pub(super) fn is_python_can(heading: &str) -> bool {
    heading.starts_with("timestamp,arbitration_id,")
}

/// Reads a table, whose first line names its columns.
pub(super) fn read(lines: Lines<'_>, format: LogFormat) -> Result<BusLog, LogError> {
    let mut log = BusLog::new(format);
    let mut names: Option<Vec<String>> = None;
    lines.for_each(&mut log, FORM, |log, line, text| {
        let fields = text.split(',').map(str::trim).collect::<Vec<_>>();
        let Some(names) = &names else {
            names = Some(fields.iter().map(|name| name.to_ascii_lowercase()).collect());
            return Ok(());
        };
        let field = |name: &str| {
            let at = names.iter().position(|own| own == name);
            at.and_then(|at| fields.get(at).copied())
                .ok_or_else(|| format!("there is no field {name}"))
        };
        let (at_ns, channel, frame) = match format {
            LogFormat::SavvyCan => savvycan(&field, fields.get(6..).unwrap_or_default())?,
            _ => python_can(&field)?,
        };
        log.push(line, at_ns, channel, frame);
        Ok(())
    })?;
    if format == LogFormat::PythonCan {
        log.started_ns = log.frames.first().map_or(0, |frame| frame.at_ns);
    }
    Ok(log)
}

type Row<'a> = Result<(u64, &'a str, Option<Frame>), String>;

/// `Time Stamp,ID,Extended,Dir,Bus,LEN,D1,…`: microseconds, hexadecimal without a prefix.
fn savvycan<'a>(field: &impl Fn(&str) -> Result<&'a str, String>, data: &[&str]) -> Row<'a> {
    let time = field("time stamp")?;
    let at_ns =
        time_ns(time, MICROSECOND_NS).ok_or_else(|| format!("`{time}` is no time in µs"))?;
    let (id, channel) = (field("id")?, field("bus").unwrap_or("0"));
    let raw = number(id, 16).ok_or_else(|| format!("`{id}` is no identifier"))?;
    let length = field("len")?;
    let length = length.parse::<usize>().map_err(|_| format!("`{length}` is no length"))?;
    let is_extended = is_true(field("extended")?)?;
    if length > 8 {
        return Ok((at_ns, channel, None));
    }
    let data = data.get(..length).ok_or_else(|| format!("the frame has not its {length} bytes"))?;
    let data = bytes(data.iter().copied(), 16).ok_or("a byte is no number")?;
    Ok((at_ns, channel, Some(frame(raw, is_extended, &data)?)))
}

/// `timestamp,arbitration_id,extended,remote,error,dlc,data`: seconds, and the bytes in base 64.
fn python_can<'a>(field: &impl Fn(&str) -> Result<&'a str, String>) -> Row<'a> {
    let time = field("timestamp")?;
    let at_ns = time_ns(time, SECOND_NS).ok_or_else(|| format!("`{time}` is no time in s"))?;
    let id = field("arbitration_id")?;
    let raw = id.strip_prefix("0x").and_then(|hex| number(hex, 16));
    let raw = raw.ok_or_else(|| format!("`{id}` is no identifier"))?;
    let is_extended = is_true(field("extended")?)?;
    for kind in ["remote", "error"] {
        if is_true(field(kind)?)? {
            return Ok((at_ns, "0", None));
        }
    }
    let data = field("data")?;
    let bytes = STANDARD.decode(data).map_err(|_| format!("`{data}` are no bytes in base 64"))?;
    if bytes.len() > 8 {
        return Ok((at_ns, "0", None));
    }
    let length = field("dlc")?;
    if length.parse() != Ok(bytes.len()) {
        return Err(format!("the frame has {} bytes, not its {length}", bytes.len()));
    }
    Ok((at_ns, "0", Some(frame(raw, is_extended, &bytes)?)))
}

fn is_true(text: &str) -> Result<bool, String> {
    match text.to_ascii_lowercase().as_str() {
        "true" | "1" => Ok(true),
        "false" | "0" => Ok(false),
        _ => Err(format!("`{text}` is neither true nor false")),
    }
}

#[cfg(test)]
mod tests {
    use cathforce_bus::EXTENDED;

    use super::*;

    #[test]
    fn both_tables_are_read() {
        let frame = Frame::new(0x123, &[1, 0xFF]);
        let savvycan = "Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8\n\
                        1500,00000123,false,Rx,1,2,01,FF,\n2500,18FF50E5,true,Rx,1,1,00,\n";
        let log = BusLog::read(savvycan.as_bytes()).unwrap();
        let extended = Frame::new(EXTENDED | 0x18FF_50E5, &[0]);
        assert_eq!(
            (log.format, log.frames[0].frame, log.frames[1].frame),
            (LogFormat::SavvyCan, frame, extended)
        );
        assert_eq!(
            (log.frames[0].at_ns, log.channels.as_slice()),
            (1_500_000, &["1".to_owned()][..])
        );
        let python = "timestamp,arbitration_id,extended,remote,error,dlc,data\n\
                      1700000000.5,0x123,0,0,0,2,Af8=\n1700000000.6,0x123,0,1,0,2,\n\
                      1700000000.7,0x18FF50E5,1,0,0,1,AA==\n";
        let log = BusLog::read(python.as_bytes()).unwrap();
        assert_eq!(
            (log.format, log.frames[0].frame, log.frames[1].frame),
            (LogFormat::PythonCan, frame, None)
        );
        assert_eq!(log.frames[2].frame, extended);
        assert_eq!(log.started_ns, 1_700_000_000_500_000_000);
        let wrong = python.replace(",2,Af8=", ",3,Af8=");
        let error = BusLog::read(wrong.as_bytes()).unwrap_err();
        assert!(error.line == 2 && error.problem.contains("2 bytes, not its 3"), "{error}");
    }
}
