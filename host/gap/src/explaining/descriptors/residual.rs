//! A held-out residual, and sums over several of them.

use crate::plant::STANDING_M_PER_S;

/// What is smaller, as a correlation or as a share, is not told.
pub const TOLD: f64 = 0.5;
/// Fewest samples of a mean.
pub const FEWEST: usize = 10;

/// A held-out residual, in the order of trials and times.
#[derive(Clone, Copy, Debug)]
pub struct Residual {
    pub trial: usize,
    pub t_s: f64,
    pub arc_m: f64,
    pub speed_m_per_s: f64,
    /// Unit of the channel.
    pub predicted: f64,
    /// Measured less predicted.
    pub error: f64,
}

impl Residual {
    pub fn measured(&self) -> f64 {
        self.predicted + self.error
    }

    /// 1 forward, −1 backward, 0 at rest.
    pub fn direction(&self) -> f64 {
        if self.speed_m_per_s.abs() > STANDING_M_PER_S { self.speed_m_per_s.signum() } else { 0.0 }
    }
}

pub fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0_usize), |(sum, count), x| (sum + x, count + 1));
    sum / count.max(1) as f64
}

/// Stretches without a gap of time, of one trial.
pub fn runs(own: &[Residual]) -> Vec<&[Residual]> {
    /// Usual steps from which on a step is a gap.
    const GAP: f64 = 3.0;
    let steps = own.windows(2).filter(|pair| pair[0].trial == pair[1].trial);
    let mut steps: Vec<f64> = steps.map(|pair| pair[1].t_s - pair[0].t_s).collect();
    steps.sort_by(f64::total_cmp);
    let usual_s = steps.get(steps.len() / 2).copied().unwrap_or_default();
    let together =
        |a: &Residual, b: &Residual| a.trial == b.trial && b.t_s - a.t_s <= GAP * usual_s;
    own.chunk_by(together).collect()
}

/// Sum of squares that y = c + a x(t) leaves, of pairs (t, y).
pub fn left_by_line(series: &[(f64, f64)], x: &dyn Fn(f64) -> f64) -> f64 {
    let centre = (mean(series.iter().map(|(t, _)| x(*t))), mean(series.iter().map(|(_, e)| *e)));
    let (mut xx, mut ee, mut xe) = (0.0, 0.0, 0.0);
    for (t, e) in series {
        let (a, b) = (x(*t) - centre.0, e - centre.1);
        xx += a * a;
        ee += b * b;
        xe += a * b;
    }
    if xx > 0.0 { ee - xe * xe / xx } else { ee }
}
