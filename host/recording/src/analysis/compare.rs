//! Compares estimates with the sensor.
//!
//! Both run on the trial's own time: row `t_s` is compared with the estimate of the tick at
//! `t_s`, linearly interpolated between ticks. Nothing is fitted, shifted or subtracted, so
//! every figure contains the sensor's noise, which is stated beside it.
//!
//! Rows are scored after the first [`FEED_BEFORE_SCORE_M`] of feed and farther than [`SNAP_GUARD_S`] from
//! a snap of the *measured* force ([`crate::snap`]). The result states the share of rows that this
//! leaves out, and also the error over the whole trial.

use serde::Serialize;

use super::snap::{self, Sample, Snap, norm};
use crate::format::trial::{Estimate, Measured, Trial};

/// Feed before scoring begins \[m\], because the start state is no equilibrium.
pub const FEED_BEFORE_SCORE_M: f64 = 3e-3;
/// Time left out on either side of a snap \[s\].
pub const SNAP_GUARD_S: f64 = 0.1;
/// A model snap farther than this from a measured one is another snap \[s\].
pub const SNAP_MATCH_S: f64 = 0.2;
/// Widest gap between ticks that is interpolated \[s\]. With a guidewire a drive's load is sent in one
/// tick of 18.
const MAX_GAP_S: f64 = 0.0185;

/// Error of the estimated force against the sensor over some rows.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize)]
pub struct ForceError {
    pub rows: usize,
    /// Root of the mean squared Euclidean norm of the error \[N\].
    pub rms_n: f64,
    /// Median norm of the error \[N\].
    pub median_n: f64,
    /// Largest norm of the error \[N\].
    pub max_n: f64,
    /// Root mean square per axis \[N\].
    pub axis_rms_n: [f64; 3],
    /// Mean (estimated − measured) per axis \[N\].
    pub axis_bias_n: [f64; 3],
    /// Largest norm of the measured force \[N\].
    pub measured_peak_n: f64,
    /// Largest magnitude of the measured force per axis \[N\].
    pub axis_measured_peak_n: [f64; 3],
}

impl ForceError {
    /// `rms_n` over `measured_peak_n`.
    pub fn share_of_peak(&self) -> f64 {
        self.rms_n / self.measured_peak_n
    }
}

/// Error of another channel against the sensor over the scored rows, in the channel's unit.
///
/// The error of a vector is its Euclidean norm.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize)]
pub struct ChannelError {
    pub rows: usize,
    pub rms: f64,
    pub median: f64,
    pub max: f64,
    /// Largest measured magnitude.
    pub measured_peak: f64,
    /// What the sensor's stated noise alone would give as `rms`.
    pub noise_rms: Option<f64>,
}

/// A measured snap and the model's counterpart, if there is one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SnapPair {
    pub measured: Snap,
    pub estimated: Option<Snap>,
}

/// The result of [`compare`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Errors outside snaps and the first millimetres.
    pub scored: ForceError,
    /// Errors of every row that has a force and an estimate.
    pub whole: ForceError,
    /// Share of the rows of `whole` that `scored` leaves out.
    pub excluded_share: f64,
    /// Time at which scoring begins \[s\].
    pub scored_from_s: f64,
    /// What the sensor's stated noise alone would give as `rms_n` \[N\]: √3 × one axis.
    pub noise_rms_n: Option<f64>,
    pub drive_force: Option<ChannelError>,
    /// Error of the guidewire's drive force.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub guidewire_force: Option<ChannelError>,
    pub tip: Option<ChannelError>,
    pub snaps: Vec<SnapPair>,
    /// Snaps of the model that were not measured.
    pub false_snaps: Vec<Snap>,
    /// Ticks that the model did not resolve.
    pub unresolved_ticks: usize,
}

impl Comparison {
    /// Whether a time of the trial is scored.
    pub fn is_scored(&self, t_s: f64) -> bool {
        t_s >= self.scored_from_s && !self.snaps.iter().any(|pair| guards(&pair.measured, t_s))
    }
}

fn guards(snap: &Snap, t_s: f64) -> bool {
    t_s >= snap.span_s[0] - SNAP_GUARD_S && t_s <= snap.span_s[1] + SNAP_GUARD_S
}

/// Compares estimates (sorted by time) with a trial.
///
/// `None` when no row has both a measured force and an estimate.
pub fn compare(estimates: &[Estimate], trial: &Trial) -> Option<Comparison> {
    let rows = pair(estimates, &trial.rows);
    let peak_n = rows.iter().filter_map(|r| r.measured.force_n).map(norm).fold(0.0, f64::max);
    let threshold_n = snap::threshold_n(trial.noise.force_n.unwrap_or(0.0), peak_n);
    let measured_snaps = snap::find(&samples(&rows, |r| r.measured.force_n), threshold_n);
    let mut estimated_snaps =
        snap::find(&samples(&rows, |r| r.measured.force_n.and(r.force_n)), threshold_n);
    let snaps = measured_snaps
        .into_iter()
        .map(|measured| SnapPair {
            estimated: take_nearest(&mut estimated_snaps, measured.t_s),
            measured,
        })
        .collect::<Vec<_>>();

    let mut result = Comparison {
        scored: ForceError::default(),
        whole: force_error(rows.iter())?,
        excluded_share: 0.0,
        scored_from_s: first_scored_time_s(&trial.rows),
        noise_rms_n: trial.noise.force_n.map(|sd| 3.0_f64.sqrt() * sd),
        drive_force: None,
        guidewire_force: None,
        tip: None,
        snaps,
        false_snaps: estimated_snaps,
        unresolved_ticks: estimates.iter().filter(|e| e.unresolved).count(),
    };
    let scored =
        rows.into_iter().filter(|r| result.is_scored(r.measured.t_s)).collect::<Vec<PairedRow>>();
    result.scored = force_error(scored.iter()).unwrap_or_default();
    result.excluded_share = 1.0 - result.scored.rows as f64 / result.whole.rows as f64;
    result.drive_force = channel_error(
        scored.iter().filter_map(|r| {
            let measured = r.measured.drive_force_n?;
            Some(((r.drive_force_n? - measured).abs(), measured.abs()))
        }),
        trial.noise.drive_force_n,
    );
    result.guidewire_force = channel_error(
        scored.iter().filter_map(|r| {
            let measured = r.measured.guidewire?.drive_force_n?;
            Some(((r.guidewire_force_n? - measured).abs(), measured.abs()))
        }),
        trial.noise.drive_force_n,
    );
    result.tip = channel_error(
        scored.iter().filter_map(|r| {
            let measured = r.measured.tip_m?;
            Some((norm(difference(r.tip_m?, measured)), norm(measured)))
        }),
        trial.noise.tip_m.map(|sd| 3.0_f64.sqrt() * sd),
    );
    Some(result)
}

/// One row of the trial with the estimates of the same instant.
struct PairedRow<'a> {
    measured: &'a Measured,
    force_n: Option<[f64; 3]>,
    drive_force_n: Option<f64>,
    guidewire_force_n: Option<f64>,
    tip_m: Option<[f64; 3]>,
}

fn pair<'a>(estimates: &[Estimate], rows: &'a [Measured]) -> Vec<PairedRow<'a>> {
    let forces = series(estimates, |e| Some(e.force_n));
    let drive = series(estimates, |e| e.drive_force_n.map(|x| [x]));
    let wire = series(estimates, |e| e.guidewire_force_n.map(|x| [x]));
    let tips = series(estimates, |e| e.tip_m);
    rows.iter()
        .map(|measured| PairedRow {
            measured,
            force_n: at(&forces, measured.t_s),
            drive_force_n: at(&drive, measured.t_s).map(|[x]| x),
            guidewire_force_n: at(&wire, measured.t_s).map(|[x]| x),
            tip_m: at(&tips, measured.t_s),
        })
        .collect()
}

pub(crate) fn series<const N: usize>(
    estimates: &[Estimate],
    channel: impl Fn(&Estimate) -> Option<[f64; N]>,
) -> Vec<(f64, [f64; N])> {
    estimates.iter().filter_map(|e| Some((e.t_s, channel(e)?))).collect()
}

/// Linear interpolation; `None` outside the series and in its gaps.
pub(crate) fn at<const N: usize>(series: &[(f64, [f64; N])], t_s: f64) -> Option<[f64; N]> {
    let next = series.partition_point(|(t, _)| *t < t_s - 1e-9);
    let &(t1, x1) = series.get(next)?;
    if (t1 - t_s).abs() <= 1e-9 {
        return Some(x1);
    }
    let &(t0, x0) = series.get(next.checked_sub(1)?)?;
    let share = (t_s - t0) / (t1 - t0);
    (t1 - t0 <= MAX_GAP_S).then(|| std::array::from_fn(|k| x0[k] + share * (x1[k] - x0[k])))
}

fn samples(
    rows: &[PairedRow<'_>],
    force_n: impl Fn(&PairedRow<'_>) -> Option<[f64; 3]>,
) -> Vec<Sample> {
    rows.iter()
        .filter_map(|row| {
            let Measured { t_s, insertion_m, rotation_rad, .. } = *row.measured;
            Some(Sample { t_s, insertion_m, rotation_rad, force_n: force_n(row)? })
        })
        .collect()
}

fn take_nearest(snaps: &mut Vec<Snap>, t_s: f64) -> Option<Snap> {
    let distance = |s: &Snap| (s.t_s - t_s).abs();
    let (nearest, _) = snaps
        .iter()
        .enumerate()
        .filter(|(_, s)| distance(s) <= SNAP_MATCH_S)
        .min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)))?;
    Some(snaps.remove(nearest))
}

/// First instant at which the drive has moved far enough from where it began; a trial that
/// never does so is not scored.
fn first_scored_time_s(rows: &[Measured]) -> f64 {
    let Some(first) = rows.first() else { return f64::INFINITY };
    rows.iter()
        .find(|r| (r.insertion_m - first.insertion_m).abs() >= FEED_BEFORE_SCORE_M)
        .map_or(f64::INFINITY, |r| r.t_s)
}

fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] - b[k])
}

fn force_error<'a>(rows: impl Iterator<Item = &'a PairedRow<'a>>) -> Option<ForceError> {
    let mut sum = ForceError::default();
    let mut norms = Vec::new();
    for row in rows {
        let (Some(measured), Some(estimated)) = (row.measured.force_n, row.force_n) else {
            continue;
        };
        let error = difference(estimated, measured);
        for k in 0..3 {
            sum.axis_rms_n[k] += error[k] * error[k];
            sum.axis_bias_n[k] += error[k];
            sum.axis_measured_peak_n[k] = sum.axis_measured_peak_n[k].max(measured[k].abs());
        }
        sum.measured_peak_n = sum.measured_peak_n.max(norm(measured));
        norms.push(norm(error));
    }
    let rows = norms.len();
    let mean = |x: f64| x / rows as f64;
    let squares: f64 = sum.axis_rms_n.iter().sum();
    (rows > 0).then(|| ForceError {
        rows,
        rms_n: mean(squares).sqrt(),
        median_n: median(&mut norms),
        max_n: norms.iter().copied().fold(0.0, f64::max),
        axis_rms_n: sum.axis_rms_n.map(|x| mean(x).sqrt()),
        axis_bias_n: sum.axis_bias_n.map(mean),
        ..sum
    })
}

/// The error of pairs (magnitude of the error, magnitude of the measurement).
fn channel_error(
    pairs: impl Iterator<Item = (f64, f64)>,
    noise_rms: Option<f64>,
) -> Option<ChannelError> {
    let (mut errors, measured): (Vec<f64>, Vec<f64>) = pairs.unzip();
    let rows = errors.len();
    let largest = |x: &[f64]| x.iter().copied().fold(0.0, f64::max);
    (rows > 0).then(|| ChannelError {
        rows,
        rms: (errors.iter().map(|x| x * x).sum::<f64>() / rows as f64).sqrt(),
        max: largest(&errors),
        median: median(&mut errors),
        measured_peak: largest(&measured),
        noise_rms,
    })
}

/// The median of a list that is not empty; reorders the list.
fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::trial::{MeasuredDrive, SensorNoise};

    const SNAP_AT_S: f64 = 2.0;

    fn truth(t_s: f64) -> [f64; 3] {
        let snapped = if t_s >= SNAP_AT_S { 0.3 } else { 0.0 };
        [0.1 * t_s, -snapped, 0.05]
    }

    /// 4 s at 10 mm/s, sensor at 250 Hz, tip at 25 Hz, no noise.
    fn trial() -> Trial {
        let rows = (0..1000)
            .map(|i| {
                let t_s = f64::from(i) * 0.004;
                Measured {
                    t_s,
                    insertion_m: 0.03 + 0.01 * t_s,
                    rotation_rad: 0.0,
                    force_n: Some(truth(t_s)),
                    drive_force_n: Some(0.2 * t_s),
                    tip_m: (i % 10 == 0).then_some([t_s, 0.0, 0.0]),
                    guidewire: Some(MeasuredDrive {
                        insertion_m: 0.05,
                        rotation_rad: 0.0,
                        drive_force_n: (i % 2 == 0).then_some(-0.1 * t_s),
                    }),
                    tendons_m: [None; 4],
                }
            })
            .collect();
        let noise = SensorNoise { force_n: Some(0.01), ..SensorNoise::default() };
        Trial { rows, noise, ..Trial::default() }
    }

    fn estimates(error: impl Fn(f64) -> [f64; 3]) -> Vec<Estimate> {
        (0..4000)
            .map(|i| {
                let t_s = f64::from(i) * 0.001;
                let (force, error) = (truth(t_s), error(t_s));
                Estimate {
                    t_s,
                    force_n: std::array::from_fn(|k| force[k] + error[k]),
                    drive_force_n: (i % 5 == 1).then_some(0.2 * t_s),
                    guidewire_force_n: (i % 6 == 5).then_some(0.02 - 0.1 * t_s),
                    tip_m: Some([t_s, 1e-3, 0.0]),
                    unresolved: false,
                    ..Estimate::default()
                }
            })
            .collect()
    }

    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-9
    }

    #[test]
    fn a_perfect_estimate_has_no_error() {
        let c = compare(&estimates(|_| [0.0; 3]), &trial()).unwrap();
        assert_eq!(c.whole.rows, 1000);
        assert!(c.whole.max_n < 1e-9);
        assert!(near(c.drive_force.unwrap().rms, 0.0), "decimated channel is interpolated");
        assert!(c.false_snaps.is_empty());
    }

    #[test]
    fn errors_are_reported_per_axis_and_as_a_norm() {
        let c = compare(&estimates(|_| [0.03, 0.0, -0.04]), &trial()).unwrap();
        assert!(near(c.scored.rms_n, 0.05));
        assert!(near(c.scored.median_n, 0.05));
        assert!(near(c.scored.axis_rms_n[2], 0.04));
        assert!(near(c.scored.axis_bias_n[2], -0.04));
        assert!(near(c.tip.unwrap().rms, 1e-3));
        assert!(near(c.guidewire_force.unwrap().rms, 0.02), "{:?}", c.guidewire_force);
        assert!(near(c.scored.measured_peak_n, norm(truth(3.996))));
        assert!(near(c.noise_rms_n.unwrap(), 0.01 * 3.0_f64.sqrt()));
    }

    #[test]
    fn an_error_at_a_snap_is_left_out_and_the_share_says_so() {
        let late = |t: f64| if (t - SNAP_AT_S).abs() < 0.05 { [0.0, 0.3, 0.0] } else { [0.0; 3] };
        let c = compare(&estimates(late), &trial()).unwrap();
        assert_eq!(c.snaps.len(), 1);
        assert!(near(c.scored.rms_n, 0.0), "{c:?}");
        assert!(c.whole.rms_n > 0.03);
        // 0.3 s of feed and about 0.22 s around the snap, of 4 s.
        assert!((0.12..0.15).contains(&c.excluded_share), "{}", c.excluded_share);
    }

    #[test]
    fn an_error_before_three_millimetres_of_feed_is_left_out() {
        let early = |t: f64| if t < 0.2999 { [0.05, 0.0, 0.0] } else { [0.0; 3] };
        let c = compare(&estimates(early), &trial()).unwrap();
        assert!(near(c.scored_from_s, 0.3), "{}", c.scored_from_s);
        assert!(near(c.scored.rms_n, 0.0));
        assert!(c.whole.rms_n > 0.0);
    }

    #[test]
    fn a_snap_of_the_model_alone_is_scored_and_listed() {
        let jump = |t: f64| if t >= 3.0 { [0.0, 0.0, 0.2] } else { [0.0; 3] };
        let c = compare(&estimates(jump), &trial()).unwrap();
        assert_eq!(c.false_snaps.len(), 1);
        assert!(c.snaps[0].estimated.is_some());
        assert!(c.scored.max_n > 0.19, "the model's own jump excuses nothing");
    }

    #[test]
    fn missing_ticks_are_not_bridged() {
        let mut gap = estimates(|_| [0.0; 3]);
        gap.retain(|e| !(1.0..1.5).contains(&e.t_s));
        let c = compare(&gap, &trial()).unwrap();
        assert!((874..=876).contains(&c.whole.rows), "{}", c.whole.rows);
    }

    #[test]
    fn nothing_in_common_is_no_comparison() {
        assert_eq!(compare(&[], &trial()), None);
        let mut no_force = trial();
        no_force.rows.iter_mut().for_each(|r| r.force_n = None);
        assert_eq!(compare(&estimates(|_| [0.0; 3]), &no_force), None);
    }
}
