//! Ticks and nodes as CSV.

use std::io;

use super::columns::tick_columns;
use crate::analysis::estimates::trial_time_s;
use crate::decoding::tick::{NodePass, TickEstimate};
use crate::reading::reader::Recording;

/// Ticks whose columns are in memory at a time: a minute.
const CHUNK: usize = 60_000;

/// Writes one row a tick, with the columns of [`crate::write_ticks_parquet`]. A value that is not known
/// is an empty field.
///
/// `entry_m`: position of the entry, vessel frame \[m\].
pub fn write_ticks_csv(
    recording: &Recording,
    ticks: &[TickEstimate],
    entry_m: [f32; 3],
    out: impl io::Write,
) -> io::Result<()> {
    ticks_csv(recording, ticks, entry_m, out).map_err(io_error)
}

/// Keeps the kind of an I/O error, so that a closed pipe is still known as one.
pub(crate) fn io_error(error: csv::Error) -> io::Error {
    let text = error.to_string();
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        _ => io::Error::other(text),
    }
}

fn ticks_csv(
    recording: &Recording,
    ticks: &[TickEstimate],
    entry_m: [f32; 3],
    out: impl io::Write,
) -> csv::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    csv.write_record(tick_columns(recording, &[], entry_m).iter().map(|(name, _)| *name))?;
    for ticks in ticks.chunks(CHUNK) {
        let columns = tick_columns(recording, ticks, entry_m);
        for row in 0..ticks.len() {
            csv.write_record(columns.iter().map(|(_, column)| column.text(row)))?;
        }
    }
    Ok(csv.flush()?)
}

/// One row a node and shape; positions from the entry, vessel frame.
pub fn write_nodes_csv(
    recording: &Recording,
    shapes: &[NodePass],
    out: impl io::Write,
) -> io::Result<()> {
    nodes_csv(recording, shapes, out).map_err(io_error)
}

fn nodes_csv(recording: &Recording, shapes: &[NodePass], out: impl io::Write) -> csv::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    csv.write_record(["t_s", "node", "x_m", "y_m", "z_m", "fx_N", "fy_N", "fz_N"])?;
    for shape in shapes {
        let t_s = format!("{:.6}", trial_time_s(recording, shape.at_ns));
        for node in &shape.nodes {
            let numbers = node.position_m.into_iter().chain(node.force_n).map(|x| x.to_string());
            let row = [t_s.clone(), node.node.to_string()].into_iter().chain(numbers);
            csv.write_record(row)?;
        }
    }
    Ok(csv.flush()?)
}
