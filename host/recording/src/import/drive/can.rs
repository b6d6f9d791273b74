//! A log of the CAN bus of an ODrive, as `candump -l` writes it: the protocol CANSimple.
//!
//! The identifier of a frame is the node's number times 32 plus that of the message. Encoder estimates (0x09) hold
//! position \[turns\] and velocity as two 32-bit floats, currents (0x14) the set-point and the measured one \[A\].

use std::collections::BTreeSet;
use std::f64::consts::TAU;
use std::io::Read;

use cathforce_bundle::bundle::{Axis, CommandKind};

use super::{DriveLog, Rows};
use crate::import::error::{ImportError, read_text};

const ENCODER_ESTIMATES: u32 = 0x09;
const CURRENTS: u32 = 0x14;

/// One float of a frame.
fn float(bytes: &[u8], at: usize) -> Option<f64> {
    let own: [u8; 4] = bytes.get(at..at + 4)?.try_into().ok()?;
    Some(f64::from(f32::from_le_bytes(own)))
}

/// Time, identifier and bytes of a line `(1700000000.123456) can0 029#0011223344556677`.
fn frame(line: &str) -> Option<(f64, u32, Vec<u8>)> {
    let mut words = line.split_whitespace();
    let t_s = words.next()?.strip_prefix('(')?.strip_suffix(')')?.parse().ok()?;
    let (id, data) = words.nth(1)?.split_once('#')?;
    let id = u32::from_str_radix(id, 16).ok()?;
    let byte = |i: usize| u8::from_str_radix(data.get(2 * i..2 * i + 2)?, 16).ok();
    let bytes = (0..data.len() / 2).map(byte).collect::<Option<Vec<u8>>>()?;
    Some((t_s, id, bytes))
}

/// Reads a log of one node. A row is an encoder estimate with the current between those before and after it.
pub fn read_odrive_can(mut log: impl Read, node: Option<u32>) -> Result<DriveLog, ImportError> {
    let text = read_text(&mut log)?;
    let (mut positions, mut currents) = (Vec::new(), Vec::new());
    let (mut nodes, mut broken) = (BTreeSet::new(), 0);
    for (i, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        let line_number = i as u64 + 1;
        let Some((t_s, id, bytes)) = frame(line) else {
            if line_number == 1 {
                let problem = "this is no log of candump";
                let fix = "give the file of `candump -l can0`, whose lines are (TIME) can0 ID#BYTES, or a CSV";
                return Err(ImportError::new(1, problem, fix));
            }
            broken += 1;
            continue;
        };
        let (own, message) = (id >> 5, id & 0x1f);
        if message == ENCODER_ESTIMATES {
            nodes.insert(own);
        }
        if node.is_some_and(|node| node != own) {
            continue;
        }
        match (message, float(&bytes, 0), float(&bytes, 4)) {
            (ENCODER_ESTIMATES, Some(turns), _) => positions.push((t_s, TAU * turns, line_number)),
            (CURRENTS, _, Some(measured)) => currents.push((t_s, measured)),
            _ => {}
        }
    }
    let list = nodes.iter().map(u32::to_string).collect::<Vec<_>>().join(", ");
    if let Some(node) = node.filter(|node| !nodes.contains(node)) {
        let problem = format!("node {node} sends no encoder estimates");
        let fix = match nodes.is_empty() {
            true => "let the ODrive send them: axis0.config.can.encoder_msg_rate_ms".to_owned(),
            false => format!("give --node {list}"),
        };
        return Err(ImportError::new(1, problem, fix));
    }
    if nodes.len() > 1 && node.is_none() {
        let problem = format!("several nodes send encoder estimates: {list}");
        return Err(ImportError::new(1, problem, "say which one: --node N"));
    }
    if positions.is_empty() {
        let fix = "let the ODrive send them: axis0.config.can.encoder_msg_rate_ms";
        return Err(ImportError::new(1, "there are no encoder estimates in the log", fix));
    }
    if currents.is_empty() {
        let fix = "let the ODrive send them: axis0.config.can.iq_msg_rate_ms";
        return Err(ImportError::new(1, "there are no currents in the log", fix));
    }
    let mut rows = Rows::default();
    let mut after = 0;
    for (t_s, position, line) in positions {
        while after < currents.len() && currents[after].0 < t_s {
            after += 1;
        }
        // Before the first current and after the last nobody knows it.
        let (Some(&(late_s, late)), Some(&(early_s, early))) =
            (currents.get(after), after.checked_sub(1).and_then(|k| currents.get(k)))
        else {
            rows.dropped += 1;
            continue;
        };
        let share = (t_s - early_s) / (late_s - early_s).max(f64::MIN_POSITIVE);
        rows.t_s.push(t_s);
        rows.position.push(position);
        rows.command.push(early + share * (late - early));
        rows.lines.push(line);
    }
    let mut understood = vec![format!(
        "a log of the CAN bus of an ODrive, node {}: encoder estimates in turns, currents in amperes",
        node.map_or(list, |node| node.to_string())
    )];
    if broken > 0 {
        understood.push(format!("{broken} lines are no frames and are left out"));
    }
    let mut log = rows.into_log(Axis::Rotary, CommandKind::Current, understood)?;
    for (t_s, _) in &mut log.trials {
        // Times of a bus are in microseconds, and seconds since 1970 have no more digits.
        t_s.iter_mut().for_each(|t| *t = (*t * 1e6).round() * 1e-6);
    }
    Ok(log)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(t_s: f64, id: u32, values: [f32; 2]) -> String {
        let bytes: String =
            values.iter().flat_map(|x| x.to_le_bytes()).map(|byte| format!("{byte:02X}")).collect();
        format!("({t_s:.6}) can0 {id:03X}#{bytes}\n")
    }

    fn log(node: u32) -> String {
        let of = |i: usize| {
            let t_s = 1.7e9 + 0.01 * i as f64;
            line(t_s, node << 5 | 0x09, [0.01 * i as f32, 0.0])
                + &line(t_s + 0.005, node << 5 | 0x14, [0.0, i as f32])
        };
        (0..200).map(of).collect()
    }

    #[test]
    fn estimates_and_currents_of_a_node_become_rows() {
        let own = read_odrive_can(log(3).as_bytes(), None).unwrap();
        let (t_s, data) = &own.trials[0];
        assert_eq!(
            (t_s.len(), data.kind),
            (199, CommandKind::Current),
            "the first has no current before it"
        );
        assert!((data.position[9] - 0.1 * TAU).abs() < 1e-6, "{}", data.position[9]);
        assert!((data.command[9] - 9.5).abs() < 1e-3, "{}", data.command[9]);
        let two = log(3) + &log(4);
        assert!(read_odrive_can(two.as_bytes(), None).unwrap_err().to_string().contains("3, 4"));
        let other = read_odrive_can(log(3).as_bytes(), Some(5)).unwrap_err().to_string();
        assert!(
            other.contains("node 5 sends no encoder estimates") && other.contains("--node 3"),
            "{other}"
        );
        assert!(
            read_odrive_can("a,b\n".as_bytes(), None)
                .unwrap_err()
                .to_string()
                .contains("no log of candump")
        );
        let alone: String = log(3)
            .lines()
            .filter(|line| line.contains("069#"))
            .map(|line| format!("{line}\n"))
            .collect();
        assert!(
            read_odrive_can(alone.as_bytes(), None)
                .unwrap_err()
                .to_string()
                .contains("iq_msg_rate_ms")
        );
    }
}
