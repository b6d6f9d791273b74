//! A recording as a trial bundle: rig, vessel, and the trial with what was measured.

use std::fs;
use std::io;
use std::path::Path;

use cathforce_bundle::bundle::{DriveTrial, TransmissionTrial, columns};
use cathforce_mechanics::MAX_TENDONS;

use super::series::io_error;
use crate::format::trial::Trial;
use crate::reading::reader::Recording;
use crate::writing::atomic::make_folder;

/// Makes the folder of a bundle, which must not exist yet. Its trial has the rows that were played;
/// without rows there is no trial.
///
/// Numbers are written so that they read back exactly.
pub fn write_bundle(recording: &Recording, folder: &Path) -> io::Result<()> {
    make_folder(folder, |folder| {
        fs::write(folder.join("rig.toml"), &recording.rig_toml)?;
        for (name, bytes) in &recording.vessel {
            fs::write(folder.join(name), bytes)?;
        }
        // A trial without rows would make the whole bundle invalid.
        if recording.trial.rows.is_empty() {
            return Ok(());
        }
        fs::create_dir(folder.join("trials"))?;
        let number: u32 = recording.info.trial.parse().unwrap_or(0);
        let file = fs::File::create(folder.join(format!("trials/{number:03}.csv")))?;
        write_trial(&recording.trial, io::BufWriter::new(file))
    })
}

/// Writes the rows of a trial in the columns of a bundle; a channel that was never measured has no column.
pub fn write_trial(trial: &Trial, out: impl io::Write) -> io::Result<()> {
    trial_csv(trial, out).map_err(io_error)
}

fn trial_csv(trial: &Trial, out: impl io::Write) -> csv::Result<()> {
    let any = |there: fn(&crate::Measured) -> bool| trial.rows.iter().any(there);
    let force = any(|row| row.force_n.is_some());
    let drive = any(|row| row.drive_force_n.is_some());
    let tip = any(|row| row.tip_m.is_some());
    let wire = any(|row| row.guidewire.is_some());
    let wire_force = any(|row| row.guidewire.is_some_and(|wire| wire.drive_force_n.is_some()));
    let tendons =
        (0..MAX_TENDONS).rev().find(|&k| trial.rows.iter().any(|row| row.tendons_m[k].is_some()));
    let tendons = tendons.map_or(0, |last| last + 1);
    let points = trial.shapes_m.iter().map(Vec::len).max().unwrap_or(0);

    let mut names = vec![columns::TIME.to_owned()];
    let mut add = |there: bool, more: &[&str]| {
        names.extend(more.iter().filter(|_| there).map(|name| (*name).to_owned()));
    };
    add(true, &[columns::INSERTION, columns::ROTATION]);
    add(force, &columns::FORCE);
    add(drive, &[columns::DRIVE_FORCE]);
    add(tip, &columns::TIP);
    add(wire, &[columns::GUIDEWIRE_INSERTION, columns::GUIDEWIRE_ROTATION]);
    add(wire_force, &[columns::GUIDEWIRE_DRIVE_FORCE]);
    add(true, &columns::TENDONS[..tendons]);
    names.extend((0..points).flat_map(columns::shape_point));

    let mut csv = csv::Writer::from_writer(out);
    csv.write_record(&names)?;
    for (i, row) in trial.rows.iter().enumerate() {
        let mut fields = Vec::with_capacity(names.len());
        let mut put = |there: bool, values: &[Option<f64>]| {
            let text = |x: &Option<f64>| x.map_or(String::new(), |x| x.to_string());
            fields.extend(values.iter().filter(|_| there).map(text));
        };
        let three = |x: Option<[f64; 3]>| x.map_or([None; 3], |x| x.map(Some));
        put(true, &[row.t_s, row.insertion_m, row.rotation_rad].map(Some));
        put(force, &three(row.force_n));
        put(drive, &[row.drive_force_n]);
        put(tip, &three(row.tip_m));
        let at = row.guidewire;
        put(wire, &[at.map(|at| at.insertion_m), at.map(|at| at.rotation_rad)]);
        put(wire_force, &[at.and_then(|at| at.drive_force_n)]);
        put(true, &row.tendons_m[..tendons]);
        let shape = trial.shapes_m.get(i).map_or(&[][..], Vec::as_slice);
        for k in 0..points {
            put(true, &three(shape.get(k).copied()));
        }
        csv.write_record(&fields)?;
    }
    Ok(csv.flush()?)
}

/// Writes a transmission's trial as a bundle has it.
pub fn write_transmission(
    t_s: &[f64],
    data: &TransmissionTrial,
    out: impl io::Write,
) -> io::Result<()> {
    transmission_csv(t_s, data, out).map_err(io_error)
}

fn transmission_csv(t_s: &[f64], data: &TransmissionTrial, out: impl io::Write) -> csv::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    let [input, output, load] = columns::of_transmission(data.input_kind, data.output_kind);
    let optional = [(load, &data.load), (columns::BEND, &data.bend_rad)];
    let there: Vec<(&str, &Vec<f64>)> =
        optional.into_iter().filter_map(|(name, own)| Some((name, own.as_ref()?))).collect();
    let mut names = vec![columns::TIME, input, output];
    names.extend(there.iter().map(|(name, _)| *name));
    csv.write_record(names)?;
    for (i, t_s) in t_s.iter().enumerate() {
        let numbers = [*t_s, data.input[i], data.output[i]];
        let others = there.iter().map(|(_, column)| column[i]);
        csv.write_record(numbers.into_iter().chain(others).map(|x| x.to_string()))?;
    }
    Ok(csv.flush()?)
}

/// Writes the rows of a trial of a drive on its own in the columns of a bundle.
pub fn write_drive(t_s: &[f64], data: &DriveTrial, out: impl io::Write) -> io::Result<()> {
    drive_csv(t_s, data, out).map_err(io_error)
}

fn drive_csv(t_s: &[f64], data: &DriveTrial, out: impl io::Write) -> csv::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    let [position, setpoint, load] = columns::of_axis(data.axis);
    let mut names = vec![columns::TIME, position, columns::of_command(data.kind, data.axis)];
    names.extend(data.setpoint.as_ref().map(|_| setpoint));
    names.extend(data.load.as_ref().map(|_| load));
    csv.write_record(names)?;
    for (i, t_s) in t_s.iter().enumerate() {
        let numbers = [*t_s, data.position[i], data.command[i]].map(|x| x.to_string());
        let there = data.setpoint.as_ref();
        let there = there.map(|column| column[i].map_or(String::new(), |x| x.to_string()));
        let load = data.load.as_ref().map(|column| column[i].to_string());
        csv.write_record(numbers.into_iter().chain(there).chain(load))?;
    }
    Ok(csv.flush()?)
}
