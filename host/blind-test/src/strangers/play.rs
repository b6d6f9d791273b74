//! Simulates one trial of a stranger.

use std::cell::OnceCell;

use cathforce_reference_solver::{Problem, Schedule, Simulation, SolveError};
use nalgebra::Vector3;

use super::form::Form;
use super::moving::Moving;
use super::rig::StrangeRig;
use super::sensing::{Met, Sensing};
use super::standing::standing;
use super::train::Train;
use crate::motion::STEP_S;
use crate::play::{Row, Trial};
use crate::train::Load;
use crate::world::Moment;

/// Plays a motion on a rig with forms; `trial`: its number.
pub fn play(
    rig: &StrangeRig,
    forms: &[Form],
    schedule: &Schedule,
    trial: usize,
) -> Result<Trial, SolveError> {
    let rows = (schedule.end_s() / STEP_S).round() as usize;
    let parts = (STEP_S / rig.numerics.step_s).round() as usize;
    let standing = standing(rig, forms);
    let torsion_n_m2 = standing.rod.sections.last().map_or(1.0, |shaft| shaft.torsion_n_m2);
    let (mut moving, mut train) = (Moving::new(forms), Train::new(forms, schedule));
    let mut sensing = Sensing::new(forms, trial);
    // Each is made when its row comes, and stays where the simulation can see it.
    let problems: Vec<OnceCell<Problem>> =
        (0..if moving.is_moving() { rows + 1 } else { 0 }).map(|_| OnceCell::new()).collect();
    let first = match problems.first() {
        Some(place) => {
            let own = moving.at(&standing, &moment(schedule, 0), STEP_S, Vector3::zeros());
            place.get_or_init(|| own)
        }
        None => &standing,
    };
    let mut simulation = Simulation::settled(first, train.drive())?;
    let start = train.drive();
    let mut trial = Vec::with_capacity(rows);
    for row in 1..=rows {
        if let Some(place) = problems.get(row) {
            let force_n = simulation.sample().force_on_vessel_n;
            let own = moving.at(&standing, &moment(schedule, row), STEP_S, force_n);
            simulation = simulation.released(place.get_or_init(|| own));
        }
        let before = train.drive();
        for part in 1..=parts {
            let t_s = STEP_S * (row - 1) as f64 + rig.numerics.step_s * part as f64;
            let felt = simulation.sample();
            let twist_rad_per_m = felt.drive_torque_n_m / torsion_n_m2;
            let load = Load { force_n: felt.drive_force_n, twist_rad_per_m };
            let drive = train.advance(schedule, t_s, load);
            simulation.step(rig.numerics.step_s, drive)?;
        }
        let (sample, drive) = (simulation.sample(), train.drive());
        let met = Met {
            t_s: STEP_S * row as f64,
            dt_s: STEP_S,
            fed_m: drive.insertion_m - start.insertion_m,
            feed_m: drive.insertion_m - before.insertion_m,
        };
        trial.push(Row {
            t_s: met.t_s,
            encoder: schedule.at(met.t_s),
            force_n: sensing.read(&met, sample.force_on_vessel_n),
            drive_force_n: sensing.behind(&met, sample.drive_force_n),
            tip_m: sample.tip_m,
            shape_m: Vec::new(),
        });
    }
    Ok(trial)
}

fn moment(schedule: &Schedule, row: usize) -> Moment {
    let t_s = STEP_S * row as f64;
    let (before, now) = (schedule.at(t_s - STEP_S), schedule.at(t_s));
    Moment {
        t_s,
        drive: now,
        feed_m_per_s: (now.insertion_m - before.insertion_m) / STEP_S,
        spin_rad_per_s: (now.rotation_rad - before.rotation_rad) / STEP_S,
    }
}
