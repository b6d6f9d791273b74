//! Recordings as columns.

use std::path::PathBuf;

use cathforce_bus::{Direction, Id, Process};
use cathforce_config::image;
use cathforce_recording::{
    Column, NodePass, Recording, Track, decode, frame_name, replay, tick_columns, trial_time_s,
};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::arrays::shaped;
use crate::errors::InputError;

/// Reads a recording whole: ``{"info": …, "ticks": columns, "nodes": columns, "measured": columns,
/// "frames": columns}``, each table as ``{column: array or list}``.
#[pyfunction]
pub fn read_recording<'py>(py: Python<'py>, recording: PathBuf) -> PyResult<Bound<'py, PyDict>> {
    let refused = |error: &dyn std::fmt::Display| InputError::new_err(error.to_string());
    let read = py.detach(|| {
        let recording = Recording::open(&recording).map_err(|error| refused(&error))?;
        let entry_m = image::decode(&recording.image)
            .map_err(|error| refused(&error))?
            .model
            .description()
            .entry
            .position_m;
        let (from_bus, passes) = decode(&recording.frames, recording.master());
        // What the bus carries in turns, or not at all, is known from a replay, bit by bit.
        let track = match recording.info.lock_step {
            true => replay(&recording).map_err(|error| refused(&error))?.1,
            false => Track { ticks: from_bus.clone(), shapes: passes },
        };
        Ok::<_, PyErr>((recording, entry_m, from_bus, track))
    })?;
    let (recording, entry_m, from_bus, track) = read;
    let ticks = PyDict::new(py);
    for (name, column) in tick_columns(&recording, &track.ticks, entry_m) {
        ticks.set_item(name, array(py, column)?)?;
    }
    let moment = |k: usize| track.ticks.iter().map(|t| known(t.moment_n_m.map(|m| m[k]))).collect();
    for (k, name) in ["mx_N_m", "my_N_m", "mz_N_m"].into_iter().enumerate() {
        ticks.set_item(name, plain(py, moment(k))?)?;
    }
    let digest = from_bus.iter().map(|t| t.digest.map_or(f64::NAN, f64::from)).collect();
    ticks.set_item("digest", plain(py, digest)?)?;
    let commands = commands(&recording, from_bus.len());
    ticks.set_item("command", commands)?;

    let all = PyDict::new(py);
    all.set_item("info", info(py, &recording)?)?;
    all.set_item("ticks", ticks)?;
    all.set_item("nodes", nodes(py, &recording, &track.shapes, entry_m)?)?;
    all.set_item("measured", measured(py, &recording)?)?;
    all.set_item("frames", frames(py, &recording)?)?;
    Ok(all)
}

fn known(value: Option<f32>) -> f64 {
    value.map_or(f64::NAN, f64::from)
}

fn plain(py: Python<'_>, column: Vec<f64>) -> PyResult<Py<PyAny>> {
    let rows = column.len();
    shaped(py, column, &[rows])
}

/// A column as numpy has it: what is not known is NaN, or, of whole numbers and flags, −1.
fn array(py: Python<'_>, column: Column) -> PyResult<Py<PyAny>> {
    Ok(match column {
        Column::Integer(rows) => {
            let rows: Vec<i32> = rows.into_iter().map(|row| row.unwrap_or(-1)).collect();
            let length = rows.len();
            shaped(py, rows, &[length])?
        }
        Column::Flag(rows) => {
            let rows: Vec<i8> = rows.into_iter().map(|row| row.map_or(-1, i8::from)).collect();
            let length = rows.len();
            shaped(py, rows, &[length])?
        }
        Column::Long(rows) => {
            let length = rows.len();
            shaped(py, rows, &[length])?
        }
        Column::Single(rows) => plain(py, rows.into_iter().map(known).collect())?,
        Column::Double(rows) => plain(py, rows)?,
        Column::Text(rows) => rows.into_pyobject(py)?.into_any().unbind(),
    })
}

/// The command that each tick took, or nothing. In lock step a SYNC frame grants a tick, which takes the frames
/// before it.
fn commands(recording: &Recording, ticks: usize) -> Vec<&'static str> {
    let mut all = vec![""; ticks];
    let mut tick = 0;
    for frame in recording.frames.iter().filter(|f| f.direction == Direction::ToDevice) {
        let Some((id, &payload)) =
            Id::from_raw(frame.frame.id()).zip(frame.frame.data().first_chunk())
        else {
            continue;
        };
        match Process::decode(id, payload) {
            Some(Process::Sync(_)) => tick += 1,
            Some(Process::Command(command)) => {
                if let Some(place) = all.get_mut(tick) {
                    *place = match command {
                        cathforce_bus::Command::SelfTest => "self_test",
                        cathforce_bus::Command::Arm => "arm",
                        cathforce_bus::Command::Disarm => "disarm",
                        cathforce_bus::Command::ClearFault { .. } => "clear_fault",
                    };
                }
            }
            _ => {}
        }
    }
    all
}

fn info<'py>(py: Python<'py>, recording: &Recording) -> PyResult<Bound<'py, PyDict>> {
    let info = PyDict::new(py);
    let of = &recording.info;
    info.set_item("rig", &of.rig)?;
    info.set_item("trial", &of.trial)?;
    info.set_item("link", &of.link)?;
    info.set_item("board", &of.board)?;
    info.set_item("host_version", &of.host_version)?;
    info.set_item("firmware_version", &of.firmware_version)?;
    info.set_item("lock_step", of.lock_step)?;
    info.set_item("tick_s", of.tick_s)?;
    info.set_item("complete", recording.cut.is_none() && recording.result.is_some())?;
    info.set_item("rig_toml", &recording.rig_toml)?;
    Ok(info)
}

fn nodes<'py>(
    py: Python<'py>,
    recording: &Recording,
    shapes: &[NodePass],
    entry_m: [f32; 3],
) -> PyResult<Bound<'py, PyDict>> {
    let rows = || shapes.iter().flat_map(|pass| pass.nodes.iter().map(move |node| (pass, node)));
    let table = PyDict::new(py);
    let t_s = rows().map(|(pass, _)| trial_time_s(recording, pass.at_ns)).collect();
    table.set_item("t_s", plain(py, t_s)?)?;
    let node: Vec<i64> = rows().map(|(_, node)| node.node.into()).collect();
    let length = node.len();
    table.set_item("node", shaped(py, node, &[length])?)?;
    for (k, name) in ["x_m", "y_m", "z_m"].into_iter().enumerate() {
        let axis = rows().map(|(_, node)| f64::from(entry_m[k] + node.position_m[k])).collect();
        table.set_item(name, plain(py, axis)?)?;
    }
    for (k, name) in ["fx_N", "fy_N", "fz_N"].into_iter().enumerate() {
        let axis = rows().map(|(_, node)| f64::from(node.force_n[k])).collect();
        table.set_item(name, plain(py, axis)?)?;
    }
    Ok(table)
}

/// The trial that was played; a channel that was never measured has no column.
fn measured<'py>(py: Python<'py>, recording: &Recording) -> PyResult<Bound<'py, PyDict>> {
    let rows = &recording.trial.rows;
    let table = PyDict::new(py);
    let put = |name: &str, column: Vec<f64>| {
        if column.iter().any(|value| !value.is_nan()) {
            table.set_item(name, plain(py, column)?)?;
        }
        Ok::<_, PyErr>(())
    };
    put("t_s", rows.iter().map(|row| row.t_s).collect())?;
    put("insertion_m", rows.iter().map(|row| row.insertion_m).collect())?;
    put("rotation_rad", rows.iter().map(|row| row.rotation_rad).collect())?;
    let vector = |of: Option<[f64; 3]>, k: usize| of.map_or(f64::NAN, |v| v[k]);
    for (k, name) in ["fx_N", "fy_N", "fz_N"].into_iter().enumerate() {
        put(name, rows.iter().map(|row| vector(row.force_n, k)).collect())?;
    }
    put("drive_fx_N", rows.iter().map(|row| row.drive_force_n.unwrap_or(f64::NAN)).collect())?;
    for (k, name) in ["tip_x_m", "tip_y_m", "tip_z_m"].into_iter().enumerate() {
        put(name, rows.iter().map(|row| vector(row.tip_m, k)).collect())?;
    }
    let wire = |of: fn(&cathforce_recording::MeasuredDrive) -> f64| {
        rows.iter().map(|row| row.guidewire.as_ref().map_or(f64::NAN, of)).collect()
    };
    put("guidewire_insertion_m", wire(|wire| wire.insertion_m))?;
    put("guidewire_rotation_rad", wire(|wire| wire.rotation_rad))?;
    put("guidewire_drive_fx_N", wire(|wire| wire.drive_force_n.unwrap_or(f64::NAN)))?;
    for k in 0..4 {
        let name = format!("tendon_{}_m", k + 1);
        put(&name, rows.iter().map(|row| row.tendons_m[k].unwrap_or(f64::NAN)).collect())?;
    }
    Ok(table)
}

fn frames<'py>(py: Python<'py>, recording: &Recording) -> PyResult<Bound<'py, PyDict>> {
    let all = &recording.frames;
    let table = PyDict::new(py);
    let at: Vec<i64> = all.iter().map(|frame| frame.at_ns as i64).collect();
    let length = at.len();
    table.set_item("at_ns", shaped(py, at, &[length])?)?;
    let to_device: Vec<bool> =
        all.iter().map(|frame| frame.direction == Direction::ToDevice).collect();
    table.set_item("to_device", shaped(py, to_device, &[length])?)?;
    let id: Vec<i64> = all.iter().map(|frame| frame.frame.id().into()).collect();
    table.set_item("id", shaped(py, id, &[length])?)?;
    table.set_item("name", all.iter().map(frame_name).collect::<Vec<_>>())?;
    let data = all.iter().map(|frame| PyBytes::new(py, frame.frame.data()));
    table.set_item("data", data.collect::<Vec<_>>())?;
    Ok(table)
}
