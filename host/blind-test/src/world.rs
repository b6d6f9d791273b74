//! Where effects act on the instrument and the vessel: the problem that is solved, at a time.

use cathforce_reference_solver::{Curve, Drive, Problem, Relaxing, Section, Station};
use nalgebra::{Rotation3, Vector3};

use crate::change::Change;
use crate::rigs::{Rig, lumen};

/// The drive at one instant, as the encoders tell.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    pub t_s: f64,
    pub drive: Drive,
    pub feed_m_per_s: f64,
    pub spin_rad_per_s: f64,
}

/// Arc behind the pre-curved tip over which a stored curvature fades, and the pieces that it is
/// cut into \[m\].
const STORED_M: f64 = 0.12;
const STORED_PIECE_M: f64 = 0.01;

/// The problem of a reality, without what changes over a trial.
pub fn standing(rig: &Rig, changes: &[Change]) -> Problem {
    let mut problem = rig.problem();
    let mut branches = rig.branches.clone();
    for change in changes {
        apply_standing(change, &mut problem, &mut branches);
    }
    problem.lumen = lumen(&branches, rig.blend_m);
    problem
}

fn apply_standing(change: &Change, problem: &mut Problem, branches: &mut [Vec<Station>]) {
    let entry_m = problem.entry.position_m;
    match *change {
        Change::Friction { factor } => problem.wall.friction_coefficient *= factor,
        Change::WallStiffness { factor } => {
            problem.wall.line_stiffness_n_per_m2 *= factor;
            problem.wall.end_stiffness_n_per_m *= factor;
        }
        Change::Registration { offset_m, tilt_rad } => {
            let turn = Rotation3::new(tilt_rad);
            for station in branches.iter_mut().flatten() {
                station.position_m = entry_m + turn * (station.position_m - entry_m) + offset_m;
            }
        }
        Change::Narrowing { arc_m, depth_m, sd_m } => {
            let mut arc = 0.0;
            let Some(stations) = branches.first_mut() else { return };
            let mut before = stations.first().map(|s| s.position_m).unwrap_or_default();
            for station in stations {
                arc += (station.position_m - before).norm();
                before = station.position_m;
                let off = (arc - arc_m) / sd_m;
                station.radius_m -= depth_m * (-0.5 * off * off).exp();
            }
        }
        Change::Stiffness { shaft, tip } => {
            let last = problem.rod.sections.len() - 1;
            for (k, section) in problem.rod.sections.iter_mut().enumerate() {
                scale(section, if k == last { shaft } else { tip });
            }
        }
        Change::StoredCurvature { up_per_m, side_per_m } => {
            let count = (STORED_M / STORED_PIECE_M) as usize;
            problem.rod.curves.extend((0..count).map(|k| {
                let fade = 1.0 - 0.5 * (k as f64 + 0.5) / count as f64;
                Curve {
                    length_m: STORED_PIECE_M,
                    up_per_m: up_per_m * fade,
                    side_per_m: side_per_m * fade,
                }
            }));
        }
        Change::Precurve { factor } => {
            // The last piece is the one next to the shaft.
            let count = problem.rod.curves.len();
            for (k, curve) in problem.rod.curves.iter_mut().enumerate() {
                let own = if k + 1 == count { factor } else { 0.5 * (1.0 + factor) };
                curve.up_per_m *= own;
                curve.side_per_m *= own;
            }
        }
        Change::Weight { factor } => problem.gravity_m_per_s2 *= factor,
        Change::Guide { length_m } => {
            problem.entry.position_m += problem.entry.direction * length_m;
        }
        Change::Stiffening { per_m } => problem.beyond.stiffening_per_m = per_m,
        Change::Relaxing { ratio, times_s } => {
            let branches = problem.beyond.relaxing.iter_mut().zip(times_s);
            branches.for_each(|(own, time_s)| *own = Relaxing { ratio: 0.5 * ratio, time_s });
        }
        Change::LightFriction { excess, load_n_per_m } => {
            problem.beyond.light_friction = excess;
            problem.beyond.light_load_n_per_m = load_n_per_m;
        }
        Change::Viscous { time_s } => problem.beyond.bending_viscosity_s = time_s,
        _ => {}
    }
}

pub(crate) fn scale(section: &mut Section, factor: f64) {
    section.bending_n_m2 *= factor;
    section.torsion_n_m2 *= factor;
    section.axial_n *= factor;
}

/// Whether any change makes the problem another one in the course of a trial.
pub fn is_changing(changes: &[Change]) -> bool {
    changes.iter().any(|change| {
        matches!(
            change,
            Change::Stribeck { .. }
                | Change::Breathing { .. }
                | Change::Softening { .. }
                | Change::DirectedFriction { .. }
                | Change::RoughPiece { .. }
                | Change::Stream { .. }
        )
    })
}

/// The problem at one instant of a trial.
pub fn at(standing: &Problem, changes: &[Change], moment: &Moment) -> Problem {
    let mut problem = standing.clone();
    let slide = moment.feed_m_per_s.hypot(moment.spin_rad_per_s * problem.rod.radius_m);
    for change in changes {
        match *change {
            Change::Stribeck { excess, speed_m_per_s } => {
                problem.wall.friction_coefficient *= 1.0 + excess * (-slide / speed_m_per_s).exp();
            }
            Change::Breathing { .. } => {
                problem.lumen = problem.lumen.at(phantom_m(changes, moment.t_s));
            }
            Change::Softening { share, time_s } => {
                let lost = |time: f64| 1.0 - (-moment.t_s / time).exp();
                let factor = 1.0 - share * 0.5 * (lost(0.4 * time_s) + lost(2.5 * time_s));
                problem.rod.sections.iter_mut().for_each(|section| scale(section, factor));
            }
            Change::Stream { along_n_per_m, pulse, period_s } => {
                let beat = 0.5 * (1.0 + breath((moment.t_s / period_s).rem_euclid(1.0)));
                problem.beyond.stream_n_per_m = along_n_per_m * (1.0 + pulse * beat);
            }
            Change::DirectedFriction { factor } if moment.feed_m_per_s < 0.0 => {
                problem.wall.friction_coefficient *= factor;
            }
            Change::RoughPiece { from_m, to_m, factor } => {
                let edge = |at: f64| 0.5 * (1.0 + ((moment.drive.insertion_m - at) / 1e-3).tanh());
                let inside = edge(from_m) - edge(to_m);
                problem.wall.friction_coefficient *= 1.0 + (factor - 1.0) * inside;
            }
            _ => {}
        }
    }
    problem
}

/// Displacement of a breathing phantom \[m\].
fn phantom_m(changes: &[Change], t_s: f64) -> Vector3<f64> {
    let of = |change: &Change| match *change {
        Change::Breathing { amplitude_m, period_s, phase } => {
            amplitude_m * breath((t_s / period_s + phase).rem_euclid(1.0))
        }
        _ => Vector3::zeros(),
    };
    changes.iter().map(of).sum()
}

/// From −1 to 1 within a third of the period, back in half of it, then a pause.
pub(crate) fn breath(share: f64) -> f64 {
    use std::f64::consts::PI;
    match share {
        s if s < 0.33 => -(PI * s / 0.33).cos(),
        s if s < 0.85 => (PI * (s - 0.33) / 0.52).cos(),
        _ => -1.0,
    }
}
