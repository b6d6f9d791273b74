//! Snaps: the instrument jumping from one equilibrium to another.
//!
//! **Definition.** The force jumps where the mean of the [`MEAN_S`] after an instant differs
//! from the mean of the [`MEAN_S`] before it, in Euclidean norm, by more than
//!
//! > max([`NOISE_FACTOR`] × noise of one axis, [`PEAK_SHARE`] × largest norm of the trial)
//!
//! while the drive neither starts nor reverses: its mean speed over [`DRIVE_S`] after the
//! instant is not larger than the one before it by [`FEED_CHANGE_M_PER_S`] or
//! [`TURN_CHANGE_RAD_PER_S`], and does not have the other sign. Friction of a stiff instrument changes
//! sign as fast when the drive reverses or starts; that is no snap, and its error counts. When the
//! drive stops, friction holds the force, so a jump then is a snap.
//!
//! If samples are farther apart than that, up to twice as far, one sample on either side is used; a
//! slower sensor shows no snaps.
//!
//! Jumps closer than [`MERGE_S`] are one snap; its time is that of the largest jump. Snaps that are left out
//! of a score are those of the *measured* force alone, so that a jump of the estimate counts as an error.
//! The same definition and threshold, applied to the estimate, gives the model's snaps.
//!
//! In the practice bundles, feeding changes the force by up to 90 mN in that window, the tip
//! jumping off a dividing wall or the hook springing open by 100–750 mN.

use serde::Serialize;

/// Length of either mean \[s\].
pub const MEAN_S: f64 = 0.016;
/// Smallest jump, in standard deviations of one axis.
pub const NOISE_FACTOR: f64 = 10.0;
/// Smallest jump, as a share of the largest force of the trial.
pub const PEAK_SHARE: f64 = 0.15;
/// Jumps closer than this are one snap \[s\].
pub const MERGE_S: f64 = 0.05;

/// Time before and after a jump in which the drive neither starts nor reverses \[s\].
pub const DRIVE_S: f64 = 0.2;
/// A larger change of the feed's speed is a change of motion \[m/s\].
pub const FEED_CHANGE_M_PER_S: f64 = 2e-3;
/// A larger change of the rotation's speed is a change of motion \[rad/s\].
pub const TURN_CHANGE_RAD_PER_S: f64 = 0.1;

/// One snap.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Snap {
    /// Time of the largest jump \[s\].
    pub t_s: f64,
    /// First and last instant at which the force jumps \[s\].
    pub span_s: [f64; 2],
    /// Drive-side insertion at `t_s` \[m\].
    pub insertion_m: f64,
    /// Largest jump \[N\].
    pub jump_n: f64,
}

/// A force at one instant, for the detector.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    pub t_s: f64,
    pub insertion_m: f64,
    pub rotation_rad: f64,
    pub force_n: [f64; 3],
}

/// The smallest jump that is a snap \[N\], from one axis' noise and the trial's peak.
pub fn threshold_n(noise_n: f64, peak_n: f64) -> f64 {
    (NOISE_FACTOR * noise_n).max(PEAK_SHARE * peak_n)
}

/// Finds snaps in samples sorted by time.
pub fn find(samples: &[Sample], threshold_n: f64) -> Vec<Snap> {
    let mut snaps: Vec<Snap> = Vec::new();
    for (i, sample) in samples.iter().enumerate() {
        let Some(jump_n) = jump_at(samples, i) else { continue };
        if jump_n <= threshold_n || !no_start_nor_reversal(samples, i) {
            continue;
        }
        let t_s = sample.t_s;
        let fresh = Snap { t_s, span_s: [t_s; 2], insertion_m: sample.insertion_m, jump_n };
        match snaps.last_mut() {
            Some(last) if t_s - last.span_s[1] <= MERGE_S => {
                let span_s = [last.span_s[0], t_s];
                if jump_n > last.jump_n {
                    *last = fresh;
                }
                last.span_s = span_s;
            }
            _ => snaps.push(fresh),
        }
    }
    snaps
}

/// Norm of the difference of the means before and after sample `i` \[N\]; `None` at the ends.
fn jump_at(samples: &[Sample], i: usize) -> Option<f64> {
    let t_s = samples[i].t_s;
    let (first, last) = (samples.first()?.t_s, samples.last()?.t_s);
    if t_s - first < MEAN_S || last - t_s < MEAN_S {
        return None;
    }
    // The slack of a microsecond allows for times that are rounded decimals.
    let within = |nearest: &Sample| MEAN_S.max((t_s - nearest.t_s).abs().min(2.0 * MEAN_S)) + 1e-6;
    let (earlier, later) = (&samples[..i], &samples[i + 1..]);
    let (before_s, after_s) = (within(earlier.last()?), within(later.first()?));
    let before = mean(earlier.iter().rev().take_while(|s| t_s - s.t_s <= before_s))?;
    let after = mean(later.iter().take_while(|s| s.t_s - t_s <= after_s))?;
    Some(norm(std::array::from_fn(|k| after[k] - before[k])))
}

/// Whether the drive moves after sample `i` as before, or slower.
fn no_start_nor_reversal(samples: &[Sample], i: usize) -> bool {
    let now = &samples[i];
    let first = samples.partition_point(|s| s.t_s < now.t_s - DRIVE_S);
    let last = samples.partition_point(|s| s.t_s <= now.t_s + DRIVE_S).saturating_sub(1);
    let changes = |position: fn(&Sample) -> f64, limit: f64| {
        let speed = |from: usize, to: usize| {
            let (from, to) = (&samples[from], &samples[to]);
            (position(to) - position(from)) / (to.t_s - from.t_s)
        };
        // At the ends of the trial a speed is NaN, which counts as no change.
        let (before, after) = (speed(first, i), speed(i, last));
        after.abs() - before.abs() > limit
            || (before * after < 0.0 && (after - before).abs() > limit)
    };
    !changes(|s| s.insertion_m, FEED_CHANGE_M_PER_S)
        && !changes(|s| s.rotation_rad, TURN_CHANGE_RAD_PER_S)
}

fn mean<'a>(samples: impl Iterator<Item = &'a Sample>) -> Option<[f64; 3]> {
    let (mut sum, mut count) = ([0.0; 3], 0_u32);
    for sample in samples {
        for (total, x) in sum.iter_mut().zip(sample.force_n) {
            *total += x;
        }
        count += 1;
    }
    (count > 0).then(|| sum.map(|x| x / f64::from(count)))
}

/// Euclidean norm.
pub(crate) fn norm(x: [f64; 3]) -> f64 {
    (x[0] * x[0] + x[1] * x[1] + x[2] * x[2]).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp_with_jump(jump_n: f64) -> Vec<Sample> {
        (0..500)
            .map(|i| {
                let t_s = f64::from(i) * 0.004;
                let step = if t_s >= 1.0 { jump_n } else { 0.0 };
                // 0.5 N/s is faster than any feed of the practice bundles.
                let force_n = [0.5 * t_s, -step, 0.0];
                Sample { t_s, insertion_m: 0.013 * t_s, rotation_rad: 0.0, force_n }
            })
            .collect()
    }

    #[test]
    fn a_jump_is_found_once_at_its_time_and_insertion() {
        let snaps = find(&ramp_with_jump(0.2), 0.1);
        assert_eq!(snaps.len(), 1, "{snaps:?}");
        assert!((snaps[0].t_s - 1.0).abs() < 0.0041, "within one sample: {snaps:?}");
        assert!((snaps[0].insertion_m - 0.013).abs() < 1e-4);
        assert!((snaps[0].jump_n - 0.2).abs() < 0.02);
    }

    #[test]
    fn a_ramp_and_a_small_jump_are_none() {
        assert!(find(&ramp_with_jump(0.0), 0.1).is_empty());
        assert!(find(&ramp_with_jump(0.05), 0.1).is_empty());
    }

    #[test]
    fn a_jump_at_a_reversal_or_when_rotation_starts_is_none() {
        let mut reversal = ramp_with_jump(0.2);
        for s in reversal.iter_mut().filter(|s| s.t_s > 0.96) {
            s.insertion_m = 0.013 * (1.92 - s.t_s);
        }
        assert!(find(&reversal, 0.1).is_empty());
        let mut rotation = ramp_with_jump(0.2);
        for s in rotation.iter_mut().filter(|s| s.t_s > 0.96) {
            s.rotation_rad = s.t_s - 0.96;
        }
        assert!(find(&rotation, 0.1).is_empty());
        let mut earlier = ramp_with_jump(0.2);
        for s in earlier.iter_mut().filter(|s| s.t_s > 0.5) {
            s.insertion_m = 0.013 * (1.0 - s.t_s);
        }
        assert_eq!(find(&earlier, 0.1).len(), 1, "half a second before is another event");
    }

    #[test]
    fn a_jump_while_the_drive_stops_is_one() {
        let mut stop = ramp_with_jump(0.2);
        for s in stop.iter_mut().filter(|s| s.t_s > 1.02) {
            s.insertion_m = 0.013 * 1.02;
        }
        assert_eq!(find(&stop, 0.1).len(), 1);
    }

    #[test]
    fn the_threshold_is_the_larger_of_noise_and_peak() {
        assert_eq!(threshold_n(0.01, 0.4), 0.1);
        assert_eq!(threshold_n(0.001, 0.4), PEAK_SHARE * 0.4);
    }

    #[test]
    fn short_or_empty_trials_have_no_snap() {
        assert!(find(&[], 0.1).is_empty());
        assert!(find(&ramp_with_jump(0.2)[..3], 0.1).is_empty());
    }
}
