//! The wanted numbers of a bag as a table with a row for each time.

use cathforce_bundle::bundle::columns;

use super::decoded::Received;
use super::error::RosError;
use super::message::Message;
use super::signal::Pick;
use super::times::Times;
use crate::import::error::ImportError;

/// A number of the bag that columns are made of.
pub(super) struct Signal {
    /// As the user names it.
    pub(super) name: String,
    pub(super) topic: usize,
    pub(super) pick: Pick,
    /// Whether it gives a position of a drive, without which there is no row.
    pub(super) is_motion: bool,
}

/// The values of the signals at one time.
pub(super) struct Row {
    /// Since 1970 \[ns\].
    ns: i64,
    values: Vec<Option<f64>>,
}

/// A row for each time, sorted.
pub(super) fn rows(
    messages: &[Received],
    signals: &[Signal],
    times: &Times,
) -> Result<Vec<Row>, RosError> {
    let mut rows = Vec::new();
    for one in messages {
        let decoded = &one.decoded;
        for (at, signal) in signals.iter().enumerate().filter(|(_, s)| s.topic == one.topic) {
            let Some(value) = signal.pick.value(&decoded.message) else { continue };
            if !value.is_finite() {
                let seconds = one.logged_ns as f64 * 1e-9;
                let problem = format!("{} is {value} at {seconds:.3} s since 1970", signal.name);
                return Err(RosError::new(problem, "record it again, or leave the column out"));
            }
            let stamp_ns = match (&decoded.message, signal.pick.frame()) {
                (Message::Frames(frames), Some(child)) => {
                    frames.iter().find(|frame| frame.child == child).and_then(|f| f.stamp_ns)
                }
                _ => decoded.stamp_ns,
            };
            let mut values = vec![None; signals.len()];
            values[at] = Some(value);
            rows.push(Row { ns: times.ns(one, stamp_ns), values });
        }
    }
    rows.sort_by_key(|row| row.ns);
    // Values of one time share a row, unless a signal has two: the reader takes their mean.
    let mut joined: Vec<Row> = Vec::new();
    for row in rows {
        let free = joined.last_mut().filter(|last| {
            let mut pairs = last.values.iter().zip(&row.values);
            last.ns == row.ns && pairs.all(|(before, new)| before.is_none() || new.is_none())
        });
        match free {
            Some(last) => {
                for (value, new) in last.values.iter_mut().zip(row.values) {
                    *value = value.or(new);
                }
            }
            None => joined.push(row),
        }
    }
    Ok(joined)
}

/// Keeps the rows between the first and the last at which all drives are known. Returns the time that they
/// span \[s\] and how many were left out; `None` if there is no such time.
pub(super) fn cut_to_motion(rows: &mut Vec<Row>, signals: &[Signal]) -> Option<(f64, usize)> {
    let (mut first_ns, mut last_ns) = (rows.first()?.ns, rows.last()?.ns);
    for at in (0..signals.len()).filter(|at| signals[*at].is_motion) {
        let mut own = rows.iter().filter(|row| row.values[at].is_some()).map(|row| row.ns);
        let first = own.next()?;
        first_ns = first_ns.max(first);
        last_ns = last_ns.min(own.next_back().unwrap_or(first));
    }
    let before = rows.len();
    rows.retain(|row| (first_ns..=last_ns).contains(&row.ns));
    let span_s = rows.last()?.ns.saturating_sub(rows.first()?.ns) as f64 * 1e-9;
    Some((span_s, before - rows.len()))
}

/// The table that the reader of any table takes, with the time since its first row.
pub(super) fn table(signals: &[Signal], rows: &[Row]) -> String {
    let quoted = |name: &str| format!("\"{}\"", name.replace('"', "\"\""));
    let heading = signals.iter().map(|signal| quoted(&signal.name));
    let mut text =
        std::iter::once(columns::TIME.to_owned()).chain(heading).collect::<Vec<_>>().join(",");
    for row in rows {
        text.push('\n');
        text += &since_first_s(rows, row).to_string();
        for value in &row.values {
            text.push(',');
            text += &value.map_or(String::new(), |value| value.to_string());
        }
    }
    text.push('\n');
    text
}

fn since_first_s(rows: &[Row], row: &Row) -> f64 {
    rows.first().map_or(0.0, |first| row.ns.saturating_sub(first.ns) as f64 * 1e-9)
}

/// An error of the table's reader, which names a line that nobody has seen, with the time of its row.
pub(super) fn of_table(error: &ImportError, rows: &[Row]) -> RosError {
    let row = usize::try_from(error.line).ok().and_then(|line| line.checked_sub(2));
    let at = row.and_then(|row| rows.get(row)).map(|row| since_first_s(rows, row));
    let problem = match at {
        Some(t_s) => format!("{t_s:.3} s after its beginning: {}", error.problem),
        None => error.problem.clone(),
    };
    RosError::new(problem, error.fix.clone())
}
