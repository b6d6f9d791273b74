//! Trials whose numbers are possible but suggest another unit.

use std::path::Path;

use super::columns;
use super::types::{CatheterTrial, Encoders, Trial, VectorColumn};
use crate::place::{Place, Warning};
use crate::rig::{CatheterRig, Plant, Rig, RigInstrument};

/// Largest plausible rotation \[rad\]: five turns. The same number of degrees is a twelfth of a turn.
const MOST_TURNED_RAD: f64 = 30.0;
/// A larger force breaks a phantom and buckles the instrument \[N\].
const MOST_FORCE_N: f64 = 50.0;
/// No tendon of a catheter is pulled farther \[m\]; a device takes no more by default.
const MOST_PULLED_M: f64 = 0.05;
/// Nothing in a vessel is farther from its frame's origin \[m\].
const FARTHEST_M: f64 = 3.0;

/// Warns of columns that seem to be in another unit.
pub(crate) fn warn_of_units(file: &Path, trial: &Trial, rig: &Rig, warnings: &mut Vec<Warning>) {
    let mut messages = Vec::new();
    if let (Plant::Catheter(rig), Some(data)) = (&rig.plant, trial.catheter()) {
        messages.extend(encoders(rig, data).into_iter().chain(sensors(data)));
        messages.extend(tendons(data));
        messages.extend(trial.rush().map(|rush| rush.to_string()));
    }
    messages.extend(trial.slow_clock(rig.sensor.force_rate_hz));
    let messages = messages.into_iter();
    warnings.extend(messages.map(|message| Warning {
        file: file.to_path_buf(),
        place: Place::Whole,
        message,
    }));
}

fn encoders(rig: &CatheterRig, data: &CatheterTrial) -> Vec<String> {
    let instruments = std::iter::once(&rig.instrument).chain(&rig.guidewire);
    let drives = instruments.zip(data.encoders());
    drives.flat_map(|(instrument, encoders)| of_drive(instrument, encoders)).collect()
}

fn of_drive(
    instrument: &RigInstrument,
    [(insertion, insertion_m), (rotation, rotation_rad)]: Encoders<'_>,
) -> Vec<String> {
    let mut says = Vec::new();
    let length_m = instrument.length_m;
    let longest = insertion_m.iter().copied().fold(0.0, f64::max);
    if longest > length_m {
        let only = if longest > 20.0 * length_m {
            format!("the instrument is {length_m} m long: millimetres?")
        } else {
            format!("the instrument is only {length_m} m long")
        };
        says.push(format!("{insertion} reaches {longest}, {only}"));
    }
    let turned = largest(rotation_rad.iter().copied());
    if turned > MOST_TURNED_RAD {
        let turns = turned / std::f64::consts::TAU;
        says.push(format!("{rotation} reaches {turned}, some {turns:.0} turns: degrees?"));
    }
    says
}

fn tendons(data: &CatheterTrial) -> impl Iterator<Item = String> + '_ {
    let columns = columns::TENDONS.into_iter().zip(&data.tendons_m);
    columns.filter_map(|(name, at_m)| {
        let pulled = largest(at_m.iter().copied());
        (pulled > MOST_PULLED_M)
            .then(|| format!("{name} reaches {pulled}, more than 0.05 m: millimetres or counts?"))
    })
}

fn sensors(data: &CatheterTrial) -> Vec<String> {
    let of_vector = |column: &VectorColumn| largest(column.iter().flatten().flatten().copied());
    let of_scalar = |column: &Vec<Option<f64>>| largest(column.iter().flatten().copied());
    let mut says = Vec::new();
    if let Some(force) = data.force_n.as_ref().map(of_vector).filter(|f| *f > MOST_FORCE_N) {
        says.push(format!("a force of {force} N would break the phantom: millinewtons?"));
    }
    let wire = data.guidewire.as_ref().and_then(|wire| wire.drive_force_n.as_ref());
    for (name, column) in [
        (columns::DRIVE_FORCE, data.drive_force_n.as_ref()),
        (columns::GUIDEWIRE_DRIVE_FORCE, wire),
    ] {
        if let Some(force) = column.map(of_scalar).filter(|f| *f > MOST_FORCE_N) {
            let buckles = "more than buckles any instrument: millinewtons?";
            says.push(format!("{name} reaches {force:.1}, {buckles}"));
        }
    }
    if let Some(tip) = data.tip_m.as_ref().map(of_vector).filter(|x| *x > FARTHEST_M) {
        says.push(format!("the tip is {tip} m away: millimetres?"));
    }
    let shape = largest(data.shape_m.iter().map(of_vector));
    if shape > FARTHEST_M {
        says.push(format!("a point on the shape is {shape:.1} m away: millimetres?"));
    }
    says
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |most, value| most.max(value.abs()))
}
