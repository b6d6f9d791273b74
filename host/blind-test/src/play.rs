//! One trial of a reality: what the encoders tell, and what the sensors would read without noise.

use cathforce_reference_solver::{Drive, Problem, Schedule, Simulation, SolveError};
use nalgebra::Vector3;

use crate::change::Change;
use crate::motion::{STEP_S, schedule};
use crate::rigs::Rig;
use crate::sensor::Sensor;
use crate::train::{Load, Train};
use crate::world::{self, Moment};

/// Rows between two with a shape: two a second.
const SHAPE_EVERY: usize = 125;

/// One row of a trial.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    pub t_s: f64,
    /// What the encoders tell.
    pub encoder: Drive,
    pub force_n: Vector3<f64>,
    pub drive_force_n: f64,
    pub tip_m: Vector3<f64>,
    /// Points of the centre line, from the tip to the entry, twice a second; else none \[m\].
    pub shape_m: Vec<Vector3<f64>>,
}

/// One trial, without noise.
pub type Trial = Vec<Row>;

/// Plays one of [`crate::TRIALS`] motions on a rig with changes.
pub fn play(rig: &Rig, changes: &[Change], trial: usize) -> Result<Trial, SolveError> {
    play_along(rig, changes, &schedule(trial, rig.start_m))
}

/// Plays any motion on a rig with changes.
pub fn play_along(rig: &Rig, changes: &[Change], schedule: &Schedule) -> Result<Trial, SolveError> {
    let steps = (schedule.end_s() / STEP_S).round() as usize;
    let standing = world::standing(rig, changes);
    let moments = if world::is_changing(changes) { steps + 1 } else { 1 };
    let problems: Vec<Problem> =
        (0..moments).map(|k| world::at(&standing, changes, &moment(schedule, k))).collect();
    let mut train = Train::new(changes, schedule);
    let mut sensor = Sensor::new(changes);
    let mut simulation = Simulation::settled(&problems[0], train.drive())?;
    let mut rows = Vec::with_capacity(steps);
    let start = train.drive();
    for k in 1..=steps {
        if let Some(problem) = problems.get(k) {
            simulation = simulation.released(problem);
        }
        let t_s = STEP_S * k as f64;
        let before = train.drive();
        let felt = simulation.sample();
        let torsion_n_m2 = standing.rod.sections.last().map_or(1.0, |shaft| shaft.torsion_n_m2);
        let twist_rad_per_m = felt.drive_torque_n_m / torsion_n_m2;
        let load = Load { force_n: felt.drive_force_n, twist_rad_per_m };
        let drive = train.advance(schedule, t_s, load);
        let sample = simulation.step(STEP_S, drive)?.clone();
        let tip_m = sample.tip_m;
        let fed_m = drive.insertion_m - start.insertion_m;
        let feed_m = drive.insertion_m - before.insertion_m;
        rows.push(Row {
            t_s,
            encoder: schedule.at(t_s),
            force_n: sensor.read(t_s, STEP_S, fed_m, sample.force_on_vessel_n),
            drive_force_n: sensor.behind(sample.drive_force_n, feed_m, STEP_S),
            tip_m,
            shape_m: if k % SHAPE_EVERY == 0 { shape_m(rig, &simulation) } else { Vec::new() },
        });
    }
    Ok(rows)
}

/// The centre line, to the entry of the nominal rig also where a guide reaches farther in.
fn shape_m(rig: &Rig, simulation: &Simulation) -> Vec<Vector3<f64>> {
    let mut line = simulation.centre_line_m();
    let entry_m = rig.problem().entry.position_m;
    if line.last().is_some_and(|end| (end - entry_m).norm() > 1e-6) {
        line.push(entry_m);
    }
    line
}

fn moment(schedule: &Schedule, step: usize) -> Moment {
    let t_s = STEP_S * step as f64;
    let (before, after) = (schedule.at(t_s - 0.5 * STEP_S), schedule.at(t_s + 0.5 * STEP_S));
    Moment {
        t_s,
        drive: schedule.at(t_s),
        feed_m_per_s: (after.insertion_m - before.insertion_m) / STEP_S,
        spin_rad_per_s: (after.rotation_rad - before.rotation_rad) / STEP_S,
    }
}
