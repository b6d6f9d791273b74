//! Refuses bundles that cannot be diagnosed, and trials whose motion no drive can have made.

use cathforce_bundle::bundle::Rush;
use cathforce_bundle::{Bundle, ImageBuildError, LumenBuildError};

use super::prepare::TURN_BEFORE_SCORE_RAD;
use crate::data::clock::usual_step_s;
use crate::plant::BROKEN_DOWN;

/// Why a bundle cannot be diagnosed.
#[derive(Debug, thiserror::Error)]
pub enum CatheterError {
    #[error(transparent)]
    Vessel(#[from] LumenBuildError),
    #[error(transparent)]
    Description(#[from] Box<ImageBuildError>),
    #[error("there are no trials, so there is nothing to compare\n  fix: add trials/000.csv")]
    NoTrials,
    #[error(
        "no trial measures a force, a tip or a shape, so there is nothing to compare with\n  fix: add \
         the columns fx_N, fy_N, fz_N, or tip_x_m, tip_y_m, tip_z_m"
    )]
    NothingMeasured,
    #[error(
        "trial {number:03} inserts {insertion_m} m of an instrument of {length_m} m, which cannot \
         be\n  fix: give insertion_m in metres, from the entry plane on; or correct length_m in \
         rig.toml"
    )]
    TooDeep { number: u32, insertion_m: f64, length_m: f64 },
    #[error(
        "trial {number:03} has a row every {} s, too few to know the motion of the drive \
         between rows\n  fix: give t_s in seconds, and at least {FEWEST_ROWS_PER_S} rows a second",
        crate::rounding::shortest(*.step_s, 3)
    )]
    TooSlow { number: u32, step_s: f64 },
    #[error(
        "trial {number:03}: {rush}\n  fix: give t_s in seconds, insertions in metres, rotations in \
         radians that go on from turn to turn; cut the trial where an encoder jumps"
    )]
    Rush { number: u32, rush: Rush },
    #[error(
        "trial {number:03}: the measured tip is some {excess_mm:.0} mm farther from the entry than \
         the instrument reaches, which cannot be\n  fix: count insertion_m from the entry \
         plane on, not from where the trial began; give the tip in metres in the vessel's frame"
    )]
    TipTooFar { number: u32, excess_mm: f64 },
    #[error(
        "no trial holds anything that can be compared: the drive neither feeds {} mm nor turns by \
         {TURN_BEFORE_SCORE_RAD} rad, or every sample lies near a snap\n  fix: record longer trials",
        1e3 * cathforce_recording::FEED_BEFORE_SCORE_M
    )]
    NothingCompared,
    #[error(
        "the nominal model of rig.toml breaks down on trial {0:03}: its forces grow beyond all \
         numbers\n  fix: {BROKEN_DOWN}"
    )]
    Nominal(u32),
}

/// Encoders that are read less often say too little about the motion.
const FEWEST_ROWS_PER_S: f64 = 10.0;
/// Steps between rows may be longer by this share: a clock may go 2 % slow, and times are rounded.
const SLOW_CLOCK: f64 = 1.02;

/// Refuses trials that no drive can have made.
pub(super) fn check(bundle: &Bundle) -> Result<(), CatheterError> {
    let length_m = bundle.catheter().map_or(f64::INFINITY, |rig| rig.instrument.length_m);
    for trial in &bundle.trials {
        let number = trial.number;
        let insertions = trial.catheter().into_iter().flat_map(|data| data.insertion_m.iter());
        let insertion_m = insertions.copied().fold(0.0, f64::max);
        if insertion_m > length_m {
            return Err(CatheterError::TooDeep { number, insertion_m, length_m });
        }
        let step_s = usual_step_s(&trial.t_s);
        if step_s > SLOW_CLOCK / FEWEST_ROWS_PER_S {
            return Err(CatheterError::TooSlow { number, step_s });
        }
        if let Some(rush) = trial.rush() {
            return Err(CatheterError::Rush { number, rush });
        }
        check_tip(bundle, trial)?;
    }
    Ok(())
}

/// A tip that lies farther from the entry than the inserted length and these allow is not measured
/// in the same frame, or the insertion counts from elsewhere: what a drive may lose or gain, as a
/// share and as a length \[m\].
const TIP_MARGIN_SHARE: f64 = 0.15;
const TIP_MARGIN_M: f64 = 5e-3;

/// The straight way is the shortest: no tip is farther from the entry than the instrument is long.
fn check_tip(bundle: &Bundle, trial: &cathforce_bundle::Trial) -> Result<(), CatheterError> {
    let (Some(rig), Some(data)) = (bundle.catheter(), trial.catheter()) else { return Ok(()) };
    let noise_m = bundle.rig.sensor.tip_noise_sd_m.unwrap_or_default();
    let entry_m = rig.entry.position_m;
    let rows = data.tip_m.iter().flatten().zip(&data.insertion_m);
    let excess = |(tip, insertion_m): (&Option<[f64; 3]>, &f64)| {
        let tip = (*tip)?;
        let square: f64 = (0..3).map(|k| (tip[k] - entry_m[k]).powi(2)).sum();
        Some(square.sqrt() - (1.0 + TIP_MARGIN_SHARE) * insertion_m)
    };
    let mut excess: Vec<f64> = rows.filter_map(excess).collect();
    excess.sort_by(f64::total_cmp);
    // A few rows may be anything.
    let most = excess.get(excess.len() * 9 / 10).copied().unwrap_or_default();
    if most > TIP_MARGIN_M + 5.0 * noise_m {
        return Err(CatheterError::TipTooFar { number: trial.number, excess_mm: 1e3 * most });
    }
    Ok(())
}
