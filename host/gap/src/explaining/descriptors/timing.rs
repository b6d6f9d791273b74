//! What comes early or late, against what is larger or smaller.
//!
//! Another order of contacts, or an event that is early or late, leaves a large RMS where every size is
//! right. Each run of a phase is shifted in time as a whole, and scaled as a whole instead:
//!
//! > min over τ of Σ (y(t) − f(t − τ))²,   min over a, b of Σ (y(t) − a f(t) − b)²

use super::residual::{FEWEST, Residual, left_by_line, runs};

/// The most that an event is looked for away from where it was predicted, and the step \[s\].
const FARTHEST_S: f64 = 0.6;
const STEP_S: f64 = 0.02;
/// Between samples farther apart a prediction is not known \[s\].
const GAP_S: f64 = 0.15;
/// Least share of a run that a shift must leave comparable.
const COMPARED: f64 = 0.8;

/// What a shift in time removes of the squared errors, and what another size does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// How much later things come than predicted; of all runs the root mean square, each counted by
    /// what its shift removes, with the sign of their mean.
    pub shift_s: f64,
    pub share: f64,
    /// What a factor and an offset for each run remove.
    pub size_share: f64,
}

impl Timing {
    /// Of a phase of a channel; `channel`: all of it. `None` without a run.
    pub fn of(own: &[Residual], channel: &[Residual]) -> Option<Self> {
        let (mut before, mut shifted, mut sized) = (0.0, 0.0, 0.0);
        let (mut mean, mut square) = (0.0, 0.0);
        for run in runs(own).into_iter().filter(|run| run.len() >= FEWEST) {
            let trial: Vec<&Residual> =
                channel.iter().filter(|other| other.trial == run[0].trial).collect();
            let energy: f64 = run.iter().map(|residual| residual.error.powi(2)).sum();
            let (shift_s, left) = best_shift(run, &trial);
            before += energy;
            shifted += energy * (1.0 - left);
            let series: Vec<(f64, f64)> = run.iter().map(|r| (r.predicted, r.measured())).collect();
            sized += energy - left_by_line(&series, &|predicted| predicted);
            mean += energy * (1.0 - left) * shift_s;
            square += energy * (1.0 - left) * shift_s.powi(2);
        }
        if before <= 0.0 {
            return None;
        }
        let shift_s = if shifted > 0.0 { (square / shifted).sqrt().copysign(mean) } else { 0.0 };
        Some(Self { shift_s, share: shifted / before, size_share: sized / before })
    }
}

/// The shift that leaves least of a run's squared errors, and the share that it leaves.
fn best_shift(run: &[Residual], trial: &[&Residual]) -> (f64, f64) {
    let steps = (FARTHEST_S / STEP_S).round() as i32;
    let mut best = (0.0, 1.0);
    for step in -steps..=steps {
        let shift_s = f64::from(step) * STEP_S;
        let (mut before, mut after, mut compared) = (0.0, 0.0, 0_usize);
        for residual in run {
            let Some(predicted) = predicted_at(trial, residual.t_s - shift_s) else { continue };
            before += residual.error.powi(2);
            after += (residual.measured() - predicted).powi(2);
            compared += 1;
        }
        if compared as f64 >= COMPARED * run.len() as f64 && after < best.1 * before {
            best = (shift_s, after / before);
        }
    }
    best
}

/// What was predicted of a trial at an instant, between two samples that are near each other.
fn predicted_at(trial: &[&Residual], t_s: f64) -> Option<f64> {
    let after = trial.partition_point(|residual| residual.t_s < t_s);
    let b = trial.get(after)?;
    if b.t_s == t_s {
        return Some(b.predicted);
    }
    let a = trial.get(after.checked_sub(1)?)?;
    let width_s = b.t_s - a.t_s;
    let between = (b.predicted - a.predicted) * (t_s - a.t_s) / width_s;
    (width_s < GAP_S).then_some(a.predicted + between)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::toy::noise;

    const SAMPLE_S: f64 = 0.02;

    /// Two trials of 8 s in which a force of 30 mN comes on within 0.1 s, at 3 s as predicted.
    fn made(measured: impl Fn(usize, f64) -> f64) -> Vec<Residual> {
        let of = |k: usize| {
            let (trial, t_s) = (k / 400, SAMPLE_S * (k % 400) as f64);
            let error = measured(trial, t_s) - onset(t_s, 3.0) + 5e-4 * noise(k);
            Residual {
                trial,
                t_s,
                arc_m: 0.01 * t_s,
                speed_m_per_s: 0.01,
                predicted: onset(t_s, 3.0),
                error,
            }
        };
        (0..800).map(of).collect()
    }

    fn onset(t_s: f64, at_s: f64) -> f64 {
        0.03 * ((t_s - at_s) / 0.1).clamp(0.0, 1.0)
    }

    #[test]
    fn an_event_that_is_late_is_a_matter_of_time() {
        let all = made(|_, t_s| onset(t_s, 3.24));
        let own = Timing::of(&all, &all).unwrap();
        assert!((own.shift_s - 0.24).abs() < 1e-9, "{own:?}");
        assert!(own.share > 0.9 && own.size_share < 0.3, "{own:?}");
        let early = made(|_, t_s| onset(t_s, 2.8));
        let own = Timing::of(&early, &early).unwrap();
        assert!((own.shift_s + 0.2).abs() < 1e-9 && own.share > 0.9, "{own:?}");
    }

    #[test]
    fn what_is_larger_is_a_matter_of_size() {
        let all = made(|_, t_s| 1.5 * onset(t_s, 3.0) + 0.002);
        let own = Timing::of(&all, &all).unwrap();
        assert!(own.size_share > 0.9 && own.share < 0.2, "{own:?}");
    }

    #[test]
    fn of_a_phase_predictions_of_the_others_are_known() {
        let all = made(|_, t_s| onset(t_s, 3.3));
        // The phase begins after the event was predicted.
        let phase: Vec<Residual> =
            all.iter().filter(|r| (3.2..4.0).contains(&r.t_s)).copied().collect();
        let own = Timing::of(&phase, &all).unwrap();
        assert!((own.shift_s - 0.3).abs() < 1e-9 && own.share > 0.9, "{own:?}");
    }

    #[test]
    fn what_was_not_compared_is_no_prediction() {
        let all = made(|_, t_s| onset(t_s, 3.3));
        let kept: Vec<Residual> =
            all.iter().filter(|r| !(2.9..3.15).contains(&r.t_s)).copied().collect();
        let trial: Vec<&Residual> = kept.iter().filter(|r| r.trial == 0).collect();
        assert_eq!(predicted_at(&trial, 3.0), None);
        assert!(predicted_at(&trial, 2.5).is_some());
        assert_eq!(Timing::of(&all[..FEWEST - 1], &all), None);
    }
}
