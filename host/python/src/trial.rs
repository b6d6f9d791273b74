//! The trials of a bundle, as columns.

use std::path::PathBuf;

use cathforce_bundle::Bundle;
use cathforce_bundle::bundle::{Trial, TrialData, VectorColumn, columns};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::shaped;
use crate::errors::of_bundle;

/// Named columns of real numbers, NaN where nothing was measured.
type Columns = Vec<(String, Vec<f64>)>;

fn gaps(column: &[Option<f64>]) -> Vec<f64> {
    column.iter().map(|value| value.unwrap_or(f64::NAN)).collect()
}

fn vectors(names: [String; 3], column: &VectorColumn) -> Columns {
    let axis = |k: usize| column.iter().map(|v| v.map_or(f64::NAN, |v| v[k])).collect();
    names.into_iter().enumerate().map(|(k, name)| (name, axis(k))).collect()
}

fn columns_of(trial: &Trial) -> Columns {
    let mut all: Columns = vec![(columns::TIME.into(), trial.t_s.clone())];
    let mut add = |name: &str, column: Vec<f64>| all.push((name.into(), column));
    match &trial.data {
        TrialData::Catheter(data) => {
            add(columns::INSERTION, data.insertion_m.clone());
            add(columns::ROTATION, data.rotation_rad.clone());
            if let Some(wire) = &data.guidewire {
                add(columns::GUIDEWIRE_INSERTION, wire.insertion_m.clone());
                add(columns::GUIDEWIRE_ROTATION, wire.rotation_rad.clone());
                if let Some(force) = &wire.drive_force_n {
                    add(columns::GUIDEWIRE_DRIVE_FORCE, gaps(force));
                }
            }
            for (name, column) in columns::TENDONS.iter().zip(&data.tendons_m) {
                add(name, column.clone());
            }
            if let Some(force) = &data.drive_force_n {
                add(columns::DRIVE_FORCE, gaps(force));
            }
            if let Some(force) = &data.force_n {
                all.extend(vectors(columns::FORCE.map(str::to_owned), force));
            }
            if let Some(tip) = &data.tip_m {
                all.extend(vectors(columns::TIP.map(str::to_owned), tip));
            }
            for (k, point) in data.shape_m.iter().enumerate() {
                all.extend(vectors(columns::shape_point(k), point));
            }
        }
        TrialData::Drive(data) => {
            let [position, setpoint, load] = columns::of_axis(data.axis);
            add(position, data.position.clone());
            add(columns::of_command(data.kind, data.axis), data.command.clone());
            if let Some(column) = &data.setpoint {
                add(setpoint, gaps(column));
            }
            if let Some(column) = &data.load {
                add(load, column.clone());
            }
        }
        TrialData::Transmission(data) => {
            let [input, output, load] = columns::of_transmission(data.input_kind, data.output_kind);
            add(input, data.input.clone());
            add(output, data.output.clone());
            if let Some(column) = &data.load {
                add(load, column.clone());
            }
            if let Some(column) = &data.bend_rad {
                add(columns::BEND, column.clone());
            }
        }
    }
    all
}

/// Checks a bundle whole, and returns its rig's name, its trials as ``{number: {column: array}}``, the branches
/// of its centre line as ``{name: array (stations, 5)}`` of ``s_m, x_m, y_m, z_m, radius_m``, and its warnings.
#[pyfunction]
#[expect(clippy::type_complexity, reason = "taken apart in Python at once")]
pub fn read_trials<'py>(
    py: Python<'py>,
    bundle: PathBuf,
) -> PyResult<(String, Bound<'py, PyDict>, Bound<'py, PyDict>, Vec<String>)> {
    let bundle = py.detach(|| Bundle::open(&bundle)).map_err(|error| of_bundle(&error))?;
    let trials = PyDict::new(py);
    for trial in &bundle.trials {
        let frame = PyDict::new(py);
        for (name, column) in columns_of(trial) {
            let rows = column.len();
            frame.set_item(name, shaped(py, column, &[rows])?)?;
        }
        trials.set_item(trial.number, frame)?;
    }
    let branches = PyDict::new(py);
    for branch in &bundle.centreline {
        let numbers = branch.stations.iter().flat_map(|station| {
            let [x, y, z] = station.position_m.into();
            [station.s_m, x, y, z, station.radius_m]
        });
        let numbers: Vec<f64> = numbers.collect();
        branches.set_item(&branch.name, shaped(py, numbers, &[branch.stations.len(), 5])?)?;
    }
    let warnings = bundle.warnings.iter().map(ToString::to_string).collect();
    Ok((bundle.rig.name, trials, branches, warnings))
}
