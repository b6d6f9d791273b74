//! Forces and positions of a solved step.

use nalgebra::Vector3;

use crate::balance::{Balance, Iterate, Step};
use crate::contact::Touch;
use crate::drive::Drive;

/// State of the instrument at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    pub t_s: f64,
    pub drive: Drive,
    /// Total force of the instrument on the vessel \[N\].
    pub force_on_vessel_n: Vector3<f64>,
    /// Its moment about the entry \[N·m\].
    pub moment_on_vessel_n_m: Vector3<f64>,
    /// Sum of the normal forces \[N\].
    pub normal_force_n: f64,
    /// Axial force on the instrument behind the guide, positive when pushing \[N\].
    pub drive_force_n: f64,
    /// Torque on the instrument behind the guide about the direction of insertion \[N·m\].
    pub drive_torque_n_m: f64,
    /// End of the centre line \[m\].
    pub tip_m: Vector3<f64>,
    /// Nodes that slide and that stick.
    pub sliding: usize,
    pub sticking: usize,
}

/// The sample of a step that has converged.
pub(crate) fn report(step: &Step, iterate: &Iterate, solution: &Balance, t_s: f64) -> Sample {
    let problem = step.problem;
    let entry = &problem.entry;
    let mut force = Vector3::zeros();
    let mut moment = Vector3::zeros();
    let (mut normal_force_n, mut sliding, mut sticking) = (0.0, 0, 0);
    for (position, reaction) in iterate.positions.iter().zip(&solution.reactions) {
        force -= reaction.force;
        moment -= (position + reaction.arm - entry.position_m).cross(&reaction.force);
        normal_force_n += reaction.normal_force;
        sliding += usize::from(reaction.touch == Touch::Slide);
        sticking += usize::from(reaction.touch == Touch::Stick);
    }
    Sample {
        t_s,
        drive: step.start.drive,
        force_on_vessel_n: force,
        moment_on_vessel_n_m: moment,
        normal_force_n,
        drive_force_n: drive_force(step, solution),
        drive_torque_n_m: -solution.mouth[0].1,
        tip_m: iterate.positions[0],
        sliding,
        sticking,
    }
}

/// Derivative of the elastic energy by the length inside at fixed nodes. It is the compression of the
/// base edge minus the energy per length that bending and torsion carry into the vessel; half of that
/// is taken at the guide's joint and half at the next, since the cell of each grows by half the feed.
fn drive_force(step: &Step, solution: &Balance) -> f64 {
    let count = step.edges.len();
    let h = step.problem.numerics.spacing_m;
    let rest = step.start.base_length(h);
    let tension = solution.base_tension;
    let strain = tension / (step.edges[count - 1].axial * rest);
    let here =
        step.problem.rod.stretch(step.start.drive.insertion_m, step.start.drive.insertion_m + h);
    let taken = |(moment_squared, torque): (f64, f64)| {
        0.5 * (moment_squared / (here.bending * h) + torque * torque / (here.torsion * h))
    };
    let [guide, next] = solution.mouth.map(taken);
    -tension * (1.0 + 0.5 * strain) - 0.5 * (guide + next)
}
