//! Attribution of the model's errors: one limit of the device is lifted at a time.

use std::fmt::Write as _;

use cathforce_bundle::SolverDefaults;
use cathforce_mechanics::{Drag, MAX_LINKS, MOST_LINKS};
use cathforce_reference_solver::Integrator;

use crate::{Case, Choices, Links, Record, compare, play, play_on_device, solve};

type Player = fn(&Case) -> anyhow::Result<Vec<Record>>;

/// Plays a case with the device's choices except for one of the solver's.
fn solver(case: &Case, change: fn(&mut SolverDefaults)) -> anyhow::Result<Vec<Record>> {
    let mut choices = Choices::default();
    change(&mut choices.solver);
    play::<f32, MAX_LINKS>(case, &choices)
}

/// The limits by name, and the model without each.
const LIFTED: [(&str, Player); 12] = [
    ("as on the device", play_on_device),
    ("double precision", |case| play::<f64, MAX_LINKS>(case, &Choices::default())),
    ("twice the links", |case| {
        let links = Links::Of(2 * MAX_LINKS);
        play::<f32, MOST_LINKS>(case, &Choices { links, ..Choices::default() })
    }),
    ("wall stored on half the grid", |case| {
        let choices = Choices { cell_m: 0.5 * Choices::default().cell_m, ..Choices::default() };
        play::<f32, MAX_LINKS>(case, &choices)
    }),
    ("two solves a tick", |case| solver(case, |s| s.solves = 2)),
    ("two half ticks", |case| solver(case, |s| s.substeps = 2)),
    ("the reference's drag", |case| {
        let mut choices = Choices::default();
        choices.solver.drag = Drag::constant(case.problem.drag_n_s_per_m2);
        play::<f32, MAX_LINKS>(case, &choices)
    }),
    ("no damping of the wall", |case| solver(case, |s| s.wall_damping_s = 0.0)),
    ("onset within 1 µm", |case| solver(case, |s| s.onset_m = 1e-6)),
    ("predictor gain 0.25", |case| solver(case, |s| s.predictor_gain = 0.25)),
    ("all but the links", |case| {
        let mut choices = Choices { cell_m: 0.5 * Choices::default().cell_m, ..Choices::default() };
        let solver = &mut choices.solver;
        solver.drag = Drag::constant(case.problem.drag_n_s_per_m2);
        (solver.solves, solver.substeps) = (2, 2);
        (solver.wall_damping_s, solver.onset_m) = (0.0, 1e-6);
        play::<f64, MAX_LINKS>(case, &choices)
    }),
    ("the reference, implicit Euler", reference_by_euler),
];

/// The reference with another integrator, which shows how well a case is determined at all: after a
/// snap, the rest position depends on how the tip swings.
fn reference_by_euler(case: &Case) -> anyhow::Result<Vec<Record>> {
    let mut case = case.clone();
    case.problem.numerics.integrator = Integrator::Euler;
    Ok(solve(&case)?.0)
}

/// A table of the errors of a case, one row a limit.
pub fn causes(case: &Case) -> anyhow::Result<String> {
    let (reference, _) = solve(case)?;
    let mut text = format!(
        "| {} | drive force error, of peak | force on vessel error, of peak | tip error | \
         first snap late by |\n| --- | --- | --- | --- | --- |\n",
        case.name
    );
    for (name, player) in LIFTED {
        let score = compare(&reference, &player(case)?, case.scored_from_s);
        let outside = &score.outside_snaps;
        let late = score.snaps.first().and_then(|snap| Some(snap.other_s? - snap.reference_s));
        let late = late.map_or("–".into(), |late_s| format!("{:.0} ms", 1e3 * late_s));
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "| {name} | {:.2} % | {:.2} % | {:.3} mm | {late} |",
            100.0 * outside.drive_force_share,
            100.0 * outside.force_share,
            1e3 * outside.tip_m,
        );
    }
    Ok(text)
}
