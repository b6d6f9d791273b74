//! The commanded motion of the drive, and where it repeats itself within a trial and between trials.

use cathforce_bundle::bundle::DriveTrial;

use super::motion::Filters;

/// Two runs of a set-point that differ by less than this share of its range are one motion.
const SAME_SETPOINT: f64 = 1e-4;
/// Shortest period that is looked for \[s\].
const SHORTEST_PERIOD_S: f64 = 1.0;

/// A set-point that moves, on the grid.
pub struct Setpoint {
    position_m: Vec<f64>,
    /// Two positions that differ by less are one \[m\].
    tolerance_m: f64,
    grid_s: f64,
}

impl Setpoint {
    pub fn of(t_s: &[f64], data: &DriveTrial, filters: &Filters) -> Option<Self> {
        let setpoint: Option<Vec<f64>> = data.setpoint.as_ref()?.iter().copied().collect();
        let position_m = filters.on_grid(t_s, &setpoint?);
        let low = position_m.iter().copied().fold(f64::INFINITY, f64::min);
        let range_m = position_m.iter().copied().fold(f64::NEG_INFINITY, f64::max) - low;
        (range_m > 0.0).then_some(Self {
            position_m,
            tolerance_m: SAME_SETPOINT * range_m,
            grid_s: filters.grid_s,
        })
    }

    /// Whether two set-points agree, the one `lag` points later, as far as both go.
    fn agrees(&self, other: &Self, lag: usize) -> bool {
        let mut pairs = self.position_m.iter().zip(&other.position_m[lag..]);
        pairs.all(|(a, b)| (a - b).abs() <= self.tolerance_m)
    }

    /// Grid points after which it repeats itself; `None` when it does not at least once.
    pub fn period(&self) -> Option<usize> {
        let shortest = (SHORTEST_PERIOD_S / self.grid_s) as usize;
        (shortest..=self.position_m.len() / 2).find(|&lag| self.agrees(self, lag))
    }

    /// Whether both are runs of one motion, of which one may end a little sooner.
    pub fn is_run(&self, other: &Self) -> bool {
        let [a, b] = [self, other].map(|s| s.position_m.len());
        a.abs_diff(b) <= a.max(b) / 100 && self.agrees(other, 0)
    }
}
