//! Rows that are too far apart for accelerations: such a trial is taken quasi-statically, without inertia.

use super::error::DriveError;
use super::misread::Rows;
use super::motion::evenly;
use crate::data::clock::usual_step_s;

/// Rows farther apart than this say nothing about accelerations \[s\]; a clock may go 2 % slow.
const LONGEST_STEP_S: f64 = 2.04e-2;
/// Share of the command that inertia may take in rows that are too seldom for accelerations: little more than
/// what a floor hides friction from.
const SLOW_SHARE_OF_INERTIA: f64 = 0.03;

/// Whether rows say nothing about accelerations.
pub(super) fn is_too_seldom(t_s: &[f64]) -> bool {
    usual_step_s(t_s) > LONGEST_STEP_S
}

/// Leaves the inertia out of a trial whose rows are too seldom for it, where it takes next to nothing.
pub(super) fn without_inertia(rows: &mut Rows) -> Result<(), DriveError> {
    if !is_too_seldom(&rows.clock.t_s) {
        return Ok(());
    }
    let step_s = usual_step_s(&rows.clock.t_s);
    // A motion that is faster than the rows shows as larger accelerations than it has.
    let position = evenly(&rows.clock.t_s, &rows.data.position, step_s);
    let bends = position.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]) / step_s.powi(2));
    let bends: Vec<f64> = bends.collect();
    let rms = |values: &[f64]| {
        (values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64).sqrt()
    };
    let inertial = rows.driven.inertia * rms(&bends);
    let share = inertial / rms(&rows.driven.command).max(f64::MIN_POSITIVE);
    if share > SLOW_SHARE_OF_INERTIA {
        return Err(DriveError::TooSeldom {
            trial: rows.number,
            step_s,
            share,
            most: SLOW_SHARE_OF_INERTIA,
        });
    }
    rows.driven.inertia = 0.0;
    rows.remarks.push(format!(
        "trial {:03}: a row every {step_s:.3} s tells no acceleration, and inertia takes {:.1} % of the \
         command: the trial is taken quasi-statically, without inertia",
        rows.number,
        100.0 * share
    ));
    Ok(())
}
