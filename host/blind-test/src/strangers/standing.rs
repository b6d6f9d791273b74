//! Where forms act on instrument and vessel from the beginning of a trial.

use std::f64::consts::{PI, TAU};

use cathforce_reference_solver::{
    BRANCHES, Curve, Fall, Flow, Memory, Problem, Relaxing, Section, Station,
};
use nalgebra::{Rotation3, Vector3};

use super::form::Form;
use super::path::arcs_m;
use super::rig::StrangeRig;
use crate::rigs::lumen;
use crate::world::scale;

/// Pieces into which what changes along the instrument is cut \[m\].
const PIECE_M: f64 = 5e-3;
/// Arc behind the pre-curved tip over which a stored curvature ends \[m\].
const STORED_M: f64 = 0.12;
/// Of the branches of a relaxation that resembles a power law: share of the ratio, times its time. The
/// shares fall by a power of 0.3 over the two decades.
const FRACTIONAL: [(f64, f64); BRANCHES] = [(0.52, 0.1), (0.3, 1.0), (0.18, 10.0)];
/// Blood \[kg/m³\], and the drag of a rod across it at Reynolds numbers of some hundreds \[1\].
const BLOOD_KG_PER_M3: f64 = 1060.0;
const DRAG_COEFFICIENT: f64 = 1.2;
/// Radius of the vessel at which a flow is fastest \[m\].
const FLOW_RADIUS_M: f64 = 3e-3;
/// Room that a narrowing leaves beside the instrument at the least \[m\].
const ROOM_M: f64 = 2e-4;

/// The problem of a reality, without what changes over a trial.
pub fn standing(rig: &StrangeRig, forms: &[Form]) -> Problem {
    let mut problem = Problem { numerics: rig.numerics, ..rig.real.problem() };
    let mut branches = rig.real.branches.clone();
    for form in forms {
        on_wall(form, &mut problem);
        on_instrument(form, &mut problem);
        on_vessel(form, &problem, &mut branches);
    }
    problem.lumen = lumen(&branches, rig.real.blend_m);
    problem
}

fn on_wall(form: &Form, problem: &mut Problem) {
    let (wall, beyond) = (&mut problem.wall, &mut problem.beyond);
    let mut stiffen = |factor: f64| {
        wall.line_stiffness_n_per_m2 *= factor;
        wall.end_stiffness_n_per_m *= factor;
    };
    match *form {
        Form::Dahl { factor, tangential_ratio } => {
            wall.friction_coefficient *= factor;
            wall.tangential_ratio = tangential_ratio;
        }
        Form::Presliding { tangential_ratio } => wall.tangential_ratio = tangential_ratio,
        Form::Lugre { excess, speed_m_per_s, time_s } => {
            beyond.memory = Memory { excess, speed_m_per_s, fall: Fall::Gaussian, time_s };
        }
        Form::PowerOfSpeed { excess, speed_m_per_s, exponent } => {
            // As fast as a step resolves without chattering.
            let time_s = 2.0 * crate::motion::STEP_S;
            let fall = Fall::Power { exponent };
            beyond.memory = Memory { excess, speed_m_per_s, fall, time_s };
        }
        Form::PowerOfLoad { excess, load_n_per_m, exponent } => {
            beyond.light_friction = excess;
            beyond.light_load_n_per_m = load_n_per_m;
            beyond.light_power = exponent;
        }
        Form::Yielding { factor, per_m } => {
            stiffen(factor);
            beyond.stiffening_per_m = -per_m;
        }
        Form::Toe { per_m, toe } => {
            stiffen(toe);
            beyond.stiffening_per_m = per_m;
        }
        Form::FractionalWall { ratio, time_s } => beyond.relaxing = fractional(ratio, time_s),
        Form::SquareFlow { velocity_m_per_s, pulse, frequency_hz } => {
            beyond.flow = Flow {
                density_kg_per_m3: BLOOD_KG_PER_M3,
                coefficient: DRAG_COEFFICIENT,
                width_m: 2.0 * problem.rod.radius_m,
                velocity_m_per_s,
                pulse_ratio: pulse,
                frequency_hz,
                phase_rad: 0.0,
                lumen_radius_m: FLOW_RADIUS_M,
            };
        }
        _ => {}
    }
}

fn fractional(ratio: f64, time_s: f64) -> [Relaxing; BRANCHES] {
    FRACTIONAL.map(|(share, times)| Relaxing { ratio: share * ratio, time_s: times * time_s })
}

fn on_instrument(form: &Form, problem: &mut Problem) {
    let Problem { rod, beyond, entry, tip_load, .. } = problem;
    match *form {
        Form::Graded { shaft, tip, over_m } => {
            rod.sections = pieces(&rod.sections, over_m);
            let mut at_m = 0.0;
            for section in &mut rod.sections {
                let middle_m = (at_m + 0.5 * section.length_m).min(over_m);
                at_m += section.length_m;
                scale(section, tip + (shaft - tip) * middle_m / over_m);
            }
        }
        Form::Helical { per_m, turns_per_m, phase_rad } => {
            let count = (STORED_M / PIECE_M).round() as usize;
            rod.curves.extend((0..count).map(|k| {
                let at_m = PIECE_M * (k as f64 + 0.5);
                let angle = phase_rad + TAU * turns_per_m * at_m;
                let (up_per_m, side_per_m) = (per_m * angle.cos(), per_m * angle.sin());
                Curve { length_m: PIECE_M, up_per_m, side_per_m }
            }));
        }
        Form::TurnedTip { factor, turn_rad } => {
            let (sin, cos) = turn_rad.sin_cos();
            for curve in &mut rod.curves {
                let (up, side) = (curve.up_per_m, curve.side_per_m);
                curve.up_per_m = factor * (cos * up - sin * side);
                curve.side_per_m = factor * (sin * up + cos * side);
            }
        }
        Form::Filled { shaft, tip } => {
            let last = rod.sections.len() - 1;
            for (k, section) in rod.sections.iter_mut().enumerate() {
                section.mass_kg_per_m *= if k == last { shaft } else { tip };
            }
        }
        Form::StandardSolid { ratio, time_s } => {
            beyond.relaxing_bends[0] = Relaxing { ratio, time_s };
        }
        Form::FractionalBend { ratio, time_s } => {
            beyond.relaxing_bends = fractional(ratio, time_s);
        }
        Form::Kink { behind_m, length_m, factor, bent_rad } => {
            rod.sections = kinked(&rod.sections, behind_m, length_m, factor);
            let curved_m = rod.curves.iter().map(|curve| curve.length_m).sum::<f64>();
            let gap_m = (behind_m - curved_m).max(0.0);
            let straight = Curve { length_m: gap_m, up_per_m: 0.0, side_per_m: 0.0 };
            let bent = Curve { length_m, up_per_m: 0.0, side_per_m: bent_rad / length_m };
            rod.curves.extend([straight, bent]);
        }
        Form::SkewGuide { length_m, skew_rad, side_rad } => {
            let side = entry.direction.cross(&entry.up);
            let turn = Rotation3::new(side * skew_rad + entry.up * side_rad);
            entry.direction = turn * entry.direction;
            entry.up = turn * entry.up;
            entry.position_m += entry.direction * length_m;
        }
        Form::TipPull { force_n } => tip_load.force_n += force_n,
        _ => {}
    }
}

/// The same sections, the first `over_m` of them cut into pieces.
fn pieces(sections: &[Section], over_m: f64) -> Vec<Section> {
    let (mut cut, mut at_m) = (Vec::new(), 0.0);
    for section in sections {
        let mut left_m = section.length_m;
        while at_m < over_m && left_m > PIECE_M {
            cut.push(Section { length_m: PIECE_M, ..*section });
            at_m += PIECE_M;
            left_m -= PIECE_M;
        }
        cut.push(Section { length_m: left_m, ..*section });
        at_m += left_m;
    }
    cut
}

/// The same sections, softer over a short piece.
fn kinked(sections: &[Section], behind_m: f64, length_m: f64, factor: f64) -> Vec<Section> {
    let (mut cut, mut at_m) = (Vec::new(), 0.0);
    for section in sections {
        let end_m = at_m + section.length_m;
        let edges = [behind_m, behind_m + length_m].map(|edge_m| edge_m.clamp(at_m, end_m));
        for (low_m, high_m) in [(at_m, edges[0]), (edges[0], edges[1]), (edges[1], end_m)] {
            let mut own = Section { length_m: high_m - low_m, ..*section };
            if low_m >= behind_m && high_m <= behind_m + length_m {
                scale(&mut own, factor);
            }
            if own.length_m > 0.0 {
                cut.push(own);
            }
        }
        at_m = end_m;
    }
    cut
}

fn on_vessel(form: &Form, problem: &Problem, branches: &mut [Vec<Station>]) {
    let entry_m = problem.entry.position_m;
    match *form {
        Form::BentPhantom { offset_m, tilt_rad, sag_per_m } => {
            let turn = Rotation3::new(tilt_rad);
            for station in branches.iter_mut().flatten() {
                let off_m = station.position_m - entry_m;
                let sag_m = sag_per_m * off_m.norm_squared();
                station.position_m = entry_m + turn * off_m + offset_m + sag_m;
            }
        }
        Form::OneSided { arc_m, share, half_m, angle_rad } => {
            narrow(branches, problem, |arc, room_m, along| {
                let x = ((arc - arc_m) / half_m).clamp(-1.0, 1.0);
                let depth_m = share * room_m * (0.5 + 0.5 * (PI * x).cos());
                let (one, other) = across(along);
                let aside = one * angle_rad.cos() + other * angle_rad.sin();
                // The wall of that side comes nearer by the whole depth, the other one stays.
                (0.5 * depth_m, aside * (0.5 * depth_m))
            });
        }
        Form::Tilted { arc_m, share, steep_m, gentle_m } => {
            narrow(branches, problem, |arc, room_m, _| {
                let off = arc - arc_m;
                let x = off / if off < 0.0 { steep_m } else { gentle_m };
                (0.5 * share * room_m / x.cosh(), Vector3::zeros())
            });
        }
        _ => {}
    }
}

/// Takes from the radius of the trunk, and of every branch behind it, what `of` tells, and moves the centre
/// line aside: of arc length, room for the instrument \[m\] and direction.
fn narrow(
    branches: &mut [Vec<Station>],
    problem: &Problem,
    of: impl Fn(f64, f64, Vector3<f64>) -> (f64, Vector3<f64>),
) {
    let mut trunk_m = 0.0;
    for (number, stations) in branches.iter_mut().enumerate() {
        let arcs = arcs_m(stations);
        let from_m = if number == 0 { 0.0 } else { trunk_m };
        if number == 0 {
            trunk_m = arcs.last().copied().unwrap_or_default();
        }
        let ways: Vec<Vector3<f64>> = (0..stations.len())
            .map(|k| {
                let (low, high) = (k.saturating_sub(1), (k + 1).min(stations.len() - 1));
                (stations[high].position_m - stations[low].position_m).normalize()
            })
            .collect();
        for ((station, arc), along) in stations.iter_mut().zip(arcs).zip(ways) {
            // Across the whole lumen: a wall that comes nearer by all of it touches the instrument on
            // both sides.
            let room_m = 2.0 * (station.radius_m - problem.rod.radius_m) - ROOM_M;
            let (less_m, aside_m) = of(from_m + arc, room_m.max(0.0), along);
            station.radius_m -= less_m;
            station.position_m += aside_m;
        }
    }
}

/// Two directions across another.
fn across(along: Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let one = along.cross(&Vector3::z()).try_normalize(1e-6).unwrap_or(Vector3::y());
    (one, along.cross(&one))
}
