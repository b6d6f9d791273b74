//! Position, velocity and acceleration of a drive from its measured position.

use crate::signal::{Gaussian, slope};

/// The finest grid on which trials are differentiated \[s\].
pub const GRID_S: f64 = 1e-3;
/// Grid points between two rows at most: of rows that are far apart, the grid is coarser.
const POINTS_A_ROW: f64 = 20.0;
/// Smoothing before differentiation, in grid points. With [`OUTPUT_SD`] the bandwidth is 30 Hz.
const POSITION_SD: f64 = 2.0;
/// Smoothing of what is compared.
const OUTPUT_SD: f64 = 4.0;
/// Least smoothing of both together, in steps between rows. Between two rows a position is taken
/// for a straight line, which adds accelerations at the rate of the rows as large as the true ones;
/// so much leaves 1e-3 of them.
const LEAST_SD_ROWS: f64 = 0.6;

/// Standard deviation of a filter in points of what it smooths, at least.
const LEAST_SD_POINTS: f64 = 2.0;
/// Points of all trials together at which a command is predicted, about: a minute of rows at 1 kHz.
const MOST_POINTS: usize = 60_000;

/// A drive rests where it moves by less than this share of the travel, or than so many standard
/// deviations of the position's noise, in this time \[s\].
const REST_SHARE: f64 = 2e-5;
const REST_NOISE: f64 = 8.0;
const REST_S: f64 = 0.1;

/// A motion on a uniform grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    pub dt_s: f64,
    pub position_m: Vec<f64>,
    pub velocity_m_per_s: Vec<f64>,
    pub acceleration_m_per_s2: Vec<f64>,
}

impl Motion {
    /// From positions on the grid of the filters, smoothed and differentiated.
    pub fn of(position_m: &[f64], filters: &Filters) -> Self {
        let position_m = filters.position.smooth(position_m);
        let velocity_m_per_s = slope(&position_m, filters.grid_s);
        let acceleration_m_per_s2 = slope(&velocity_m_per_s, filters.grid_s);
        Self { dt_s: filters.grid_s, position_m, velocity_m_per_s, acceleration_m_per_s2 }
    }

    /// Where the drive turns round within so many grid points.
    pub fn turns(&self, around: usize) -> Vec<bool> {
        let mut turns = vec![false; self.velocity_m_per_s.len()];
        for (i, pair) in self.velocity_m_per_s.windows(2).enumerate() {
            if pair[0] * pair[1] <= 0.0 {
                let end = (i + 2 + around).min(turns.len());
                turns[i.saturating_sub(around)..end].fill(true);
            }
        }
        turns
    }

    /// Where the drive moves by less than a share of `travel_m`, or than the position's `noise_m`, for
    /// [`REST_S`], and as far around as filters `reach`.
    pub fn rests(&self, travel_m: f64, noise_m: f64, reach: usize) -> Vec<bool> {
        let still_m = (REST_SHARE * travel_m).max(REST_NOISE * noise_m);
        let window = (REST_S / self.dt_s) as usize;
        let mut rests = vec![false; self.position_m.len()];
        for (i, around) in self.position_m.windows(window).enumerate() {
            let low = around.iter().copied().fold(f64::INFINITY, f64::min);
            let high = around.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            if high - low < still_m {
                let end = (i + window + reach).min(rests.len());
                rests[i.saturating_sub(reach)..end].fill(true);
            }
        }
        rests
    }
}

/// A column every `step_s`, from its rows at times of their own.
pub fn evenly(t_s: &[f64], column: &[f64], step_s: f64) -> Vec<f64> {
    let (Some(&first), Some(&last)) = (t_s.first(), t_s.last()) else { return Vec::new() };
    let points = ((last - first) / step_s).floor() as usize + 1;
    let mut after = 0;
    let at = |i: usize| {
        let t = first + i as f64 * step_s;
        while after + 1 < t_s.len() && t_s[after] < t {
            after += 1;
        }
        let before = after.saturating_sub(1);
        let span = t_s[after] - t_s[before];
        let share = if span > 0.0 { ((t - t_s[before]) / span).clamp(0.0, 1.0) } else { 0.0 };
        column[before] + share * (column[after] - column[before])
    };
    (0..points).map(at).collect()
}

/// The filters that measured and predicted commands both pass.
#[derive(Clone, Debug)]
pub struct Filters {
    /// Between two grid points \[s\], the same for all trials.
    pub grid_s: f64,
    position: Gaussian,
    output: Gaussian,
    /// Of the latter, in grid points.
    output_sd: f64,
    /// Of both together, in grid points.
    whole_sd: f64,
}

impl Filters {
    /// For rows so far apart at most, at least so many times as wide as the narrowest ones.
    pub fn new(step_s: f64, wider: f64) -> Self {
        let coarser = (step_s / (POINTS_A_ROW * GRID_S)).floor().max(1.0);
        let grid_s = coarser * GRID_S;
        let least = LEAST_SD_ROWS * step_s / grid_s;
        let whole_sd = POSITION_SD.hypot(OUTPUT_SD);
        let wider = (least / whole_sd).max(wider);
        let [position, output] = [POSITION_SD, OUTPUT_SD].map(|sd| Gaussian::new(wider * sd));
        Self { grid_s, position, output, output_sd: wider * OUTPUT_SD, whole_sd: wider * whole_sd }
    }

    /// Frequency from which on less than half the power passes \[Hz\]: √(ln 2)/(2π) over the standard
    /// deviation in time.
    pub fn bandwidth_hz(&self) -> f64 {
        0.1325 / (self.whole_sd * self.grid_s)
    }

    /// Standard deviation of all smoothing \[s\].
    pub fn spread_s(&self) -> f64 {
        self.whole_sd * self.grid_s
    }

    /// A measured command, smoothed as the position was before its derivatives were taken, and
    /// as predictions are.
    pub fn measured(&self, command_n: &[f64]) -> Vec<f64> {
        self.output.smooth(&self.position.smooth(command_n))
    }

    /// A column on the grid, from its rows at times of their own.
    pub fn on_grid(&self, t_s: &[f64], column: &[f64]) -> Vec<f64> {
        evenly(t_s, column, self.grid_s)
    }

    /// A series, smoothed as the position is before its derivatives are taken.
    pub fn as_position(&self, series: &[f64]) -> Vec<f64> {
        self.position.smooth(series)
    }

    /// A predicted command at some grid points, read `shift_s` later. Between grid points the
    /// filter is shifted, not what it smooths: a straight line between two points has a kink where
    /// there is no shift, and two steps to either side of it are one smoothing more.
    pub fn predicted(&self, command_n: &[f64], at: &[usize], shift_s: f64) -> Vec<f64> {
        self.predicted_of(command_n, 1, at, shift_s)
    }

    /// The same of a command at every n-th grid point.
    pub fn predicted_of(
        &self,
        command_n: &[f64],
        every: usize,
        at: &[usize],
        shift_s: f64,
    ) -> Vec<f64> {
        let last = command_n.len().saturating_sub(1) as f64;
        let output = |behind: usize| {
            let shift = (behind as f64 + shift_s / self.grid_s) / every as f64;
            let whole = shift.round();
            (whole, Gaussian::centred(self.output_sd / every as f64, shift - whole))
        };
        // One for each place between two points of the command.
        let outputs: Vec<(f64, Gaussian)> = (0..every).map(output).collect();
        let read = |&i: &usize| {
            let (whole, output) = &outputs[i % every];
            output.at(command_n, ((i / every) as f64 + whole).clamp(0.0, last) as usize)
        };
        at.iter().map(read).collect()
    }

    /// Grid points between two points of a command that is predicted, of records with so many grid points. Where the
    /// standard deviation of a Gaussian filter is two points or more, fewer points change what it reads by no more than
    /// the tails that are cut off at four standard deviations, 6.3e-5 of a signal's size.
    pub fn every(&self, points: usize) -> usize {
        let most = (self.output_sd / LEAST_SD_POINTS) as usize;
        points.div_ceil(MOST_POINTS).clamp(1, most.max(1))
    }

    /// Grid points at either end, and around a jump of the clock, that are not compared.
    pub fn reach(&self) -> usize {
        self.position.reach() + self.output.reach() + 2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_between_rows_is_no_acceleration() {
        let t_s: Vec<f64> = (0..200).map(|i| f64::from(i) * 0.01).collect();
        let position_m: Vec<f64> = t_s.iter().map(|t| 0.5 * t * t).collect();
        let filters = Filters::new(0.01, 1.0);
        let motion = Motion::of(&filters.on_grid(&t_s, &position_m), &filters);
        let at: Vec<usize> = (500..1500).collect();
        let seen = filters.predicted(&motion.acceleration_m_per_s2, &at, 0.0);
        let worst = seen.iter().map(|a| (a - 1.0).abs()).fold(0.0, f64::max);
        assert!(worst < 3e-3, "{worst}");
    }

    #[test]
    fn what_is_predicted_at_fewer_points_is_read_alike_wherever_it_is_read() {
        let filters = Filters::new(1e-3, 1.0);
        assert_eq!([1, 60_000, 60_001, 1_000_000].map(|n| filters.every(n)), [1, 1, 2, 2]);
        let wave = |i: usize| (0.1 * i as f64).sin();
        let fine: Vec<f64> = (0..900).map(wave).collect();
        let at: Vec<usize> = (100..800).step_by(3).collect();
        for (every, shift_s) in [(2, 0.0), (2, 3.3e-3), (2, -4.7e-3)] {
            let coarse: Vec<f64> = fine.iter().copied().step_by(every).collect();
            let read = filters.predicted_of(&coarse, every, &at, shift_s);
            let exact = filters.predicted(&fine, &at, shift_s);
            let worst = read.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst < 6.3e-5, "{worst}");
        }
    }

    #[test]
    fn a_shift_smooths_nothing() {
        let filters = Filters::new(1e-3, 1.0);
        let wave: Vec<f64> = (0..400).map(|i| (0.3 * f64::from(i)).sin()).collect();
        let size = |shift_s: f64| {
            let at: Vec<usize> = (100..300).collect();
            let read = filters.predicted(&wave, &at, shift_s);
            read.iter().map(|x| x * x).sum::<f64>()
        };
        assert!((size(5e-4) / size(0.0) - 1.0).abs() < 1e-2);
    }
}
