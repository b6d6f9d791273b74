//! Results of all cases, as a table and as numbers.

use std::fmt::Write as _;
use std::num::NonZero;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

use anyhow::{Context, anyhow};
use cathforce_reference_solver::{Effort, Numerics, Problem, SolveError, run};
use serde::Serialize;

use crate::{Case, Kind, Record, Score, compare, play_on_device};

/// Result of one case.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub case: &'static str,
    pub kind: Kind,
    /// The device's model.
    pub device: Score,
    /// The reference with half as many nodes and steps twice as long, which shows its own discretisation
    /// error.
    pub coarser_reference: Score,
}

/// The worst of each kind: RMS error of the drive's axial force outside snaps over its peak.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Accuracy {
    pub feed: f64,
    pub reversal: f64,
    /// Rotation by less than makes the tip snap.
    pub rotation: f64,
    /// Rotation until the tip whips round in a bend, before and after that.
    pub whip: f64,
    /// Rotation until the tip jumps off a dividing wall, before and after that.
    pub snap: f64,
    /// Largest difference in the time of a snap \[s\]; infinite if a snap is missed.
    pub snap_s: f64,
}

impl Accuracy {
    /// From the rows of all cases.
    pub fn of(rows: &[Row]) -> Self {
        let worst = |kind: Kind| {
            let rows = rows.iter().filter(|row| row.kind == kind);
            rows.map(|row| row.device.outside_snaps.drive_force_share).fold(0.0, larger)
        };
        Self {
            feed: worst(Kind::Feed),
            reversal: worst(Kind::Reversal),
            rotation: worst(Kind::Rotation),
            whip: worst(Kind::Whip),
            snap: worst(Kind::Snap),
            snap_s: rows
                .iter()
                .flat_map(|row| &row.device.snaps)
                .map(|snap| snap.other_s.map_or(f64::INFINITY, |s| (s - snap.reference_s).abs()))
                .fold(0.0, larger),
        }
    }
}

/// The larger of two numbers; NaN if either is NaN.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// The reference's solution of a case, one record a step.
pub fn solve(case: &Case) -> Result<(Vec<Record>, Effort), SolveError> {
    solve_with(case, case.problem.numerics)
}

fn solve_with(case: &Case, numerics: Numerics) -> Result<(Vec<Record>, Effort), SolveError> {
    let problem = Problem { numerics, ..case.problem.clone() };
    let (samples, effort) = run(&problem, &case.schedule)?;
    let records = samples.iter().map(|s| Record {
        t_s: s.t_s,
        insertion_m: s.drive.insertion_m,
        rotation_rad: s.drive.rotation_rad,
        drive_force_n: s.drive_force_n,
        drive_torque_n_m: s.drive_torque_n_m,
        force_on_vessel_n: s.force_on_vessel_n,
        moment_on_vessel_n_m: s.moment_on_vessel_n_m,
        tip_m: s.tip_m,
        unresolved: false,
    });
    Ok((records.collect(), effort))
}

/// Measures one case.
pub fn measure(case: &Case) -> anyhow::Result<Row> {
    let (reference, _) = solve(case)?;
    let numerics = case.problem.numerics;
    let coarser =
        Numerics { spacing_m: 2.0 * numerics.spacing_m, step_s: 2.0 * numerics.step_s, ..numerics };
    let (coarse, _) = solve_with(case, coarser)?;
    let device = play_on_device(case)?;
    Ok(Row {
        case: case.name,
        kind: case.kind,
        device: compare(&reference, &device, case.scored_from_s),
        coarser_reference: compare(&reference, &coarse, case.scored_from_s),
    })
}

/// Measures cases on all processors; the rows are in the order of the cases.
pub fn measure_all(cases: &[Case]) -> anyhow::Result<Vec<Row>> {
    let next = AtomicUsize::new(0);
    let rows: Vec<Mutex<Option<anyhow::Result<Row>>>> =
        cases.iter().map(|_| Mutex::new(None)).collect();
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, NonZero::get) {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(case) = cases.get(index) else { return };
                    let row = measure(case).context(case.name);
                    *rows[index].lock().unwrap_or_else(PoisonError::into_inner) = Some(row);
                }
            });
        }
    });
    let rows = rows.into_iter().map(|row| row.into_inner().unwrap_or_else(PoisonError::into_inner));
    rows.map(|row| row.unwrap_or_else(|| Err(anyhow!("a case was not measured")))).collect()
}

/// The rows as a Markdown table.
pub fn table(rows: &[Row]) -> String {
    let mut text = String::from(
        "| case | peak drive force | drive force error | of peak | drive torque error, of peak | \
         force on vessel error, of peak | its moment | tip error | snaps: late by | \
         reference's own error |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for row in rows {
        let (score, outside) = (&row.device, &row.device.outside_snaps);
        let own = &row.coarser_reference.outside_snaps;
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "| {} | {:.1} mN | {:.2} mN | {:.1} % | {} | {:.1} % | {} | {:.3} mm | {} | {:.2} % |",
            row.case,
            1e3 * score.peak_drive_force_n,
            1e3 * outside.drive_force_n,
            100.0 * outside.drive_force_share,
            percent(outside.drive_torque_share),
            100.0 * outside.force_share,
            percent(outside.moment_share),
            1e3 * outside.tip_m,
            lateness(score),
            100.0 * own.drive_force_share,
        );
    }
    text
}

fn percent(share: Option<f64>) -> String {
    share.map_or("–".into(), |share| format!("{:.1} %", 100.0 * share))
}

fn lateness(score: &Score) -> String {
    let mut parts: Vec<String> = score
        .snaps
        .iter()
        .map(|snap| match snap.other_s {
            Some(other_s) => format!("{:.0} ms", 1e3 * (other_s - snap.reference_s)),
            None => "missed".into(),
        })
        .collect();
    if !score.extra_snaps_s.is_empty() {
        parts.push(format!("{} more", score.extra_snaps_s.len()));
    }
    if parts.is_empty() { "–".into() } else { parts.join(", ") }
}
