//! The trials of a transmission on a grid: input, output, load, and what noise leaves in them.

use cathforce_bundle::bundle::{TransmissionTrial, columns};

use super::effects::MOST_SLACK;
use crate::data::clock::{Clock, usual_step_s};
use crate::drive::misread::misread;
use crate::drive::motion::evenly;
use crate::drive::noise::{Noise, step_of};
use crate::signal::{Gaussian, slope};

/// Grid points of all trials together, about: longer records are taken on a coarser grid.
const MOST_POINTS: f64 = 60_000.0;
/// Grid points between two samples.
pub const STRIDE: usize = 4;
/// Smoothing of both outputs, measured and predicted, in grid points. It keeps corners, and two steps of it make a
/// shift in time no low pass: between two grid points the kernel is shifted, not what it smooths.
const OUTPUT_SD: f64 = 2.0;
/// Noise of independent points that passes it: (2 √π sd)^(−1/2).
const PASSED: f64 = 0.375_6;

/// The rows of a trial that were read right.
pub struct Rows {
    pub number: u32,
    pub clock: Clock,
    pub data: TransmissionTrial,
    pub remarks: Vec<String>,
}

impl Rows {
    pub fn of(number: u32, t_s: &[f64], data: &TransmissionTrial) -> Self {
        let names = columns::of_transmission(data.input_kind, data.output_kind);
        let mut remarks = Vec::new();
        let mut left_out = vec![false; t_s.len()];
        for (name, column) in [(names[0], &data.input), (names[1], &data.output)] {
            let rows = misread(column);
            let Some(&first) = rows.first() else { continue };
            remarks.push(format!(
                "trial {number:03}: {name} of {} rows, the first at {:.3} s, jumps away and is back in the \
                 next: misread, not used",
                rows.len(),
                t_s[first]
            ));
            rows.into_iter().for_each(|row| left_out[row] = true);
        }
        let kept = |column: &[f64]| -> Vec<f64> {
            column.iter().zip(&left_out).filter(|(_, out)| !**out).map(|(x, _)| *x).collect()
        };
        let data = TransmissionTrial {
            input: kept(&data.input),
            output: kept(&data.output),
            load: data.load.as_deref().map(kept),
            bend_rad: data.bend_rad.as_deref().map(kept),
            ..*data
        };
        Self { number, clock: Clock::of(&kept(t_s)), data, remarks }
    }

    pub fn duration_s(&self) -> f64 {
        let t_s = &self.clock.t_s;
        t_s.last().zip(t_s.first()).map_or(0.0, |(last, first)| last - first)
    }
}

/// Between two grid points \[s\], of all trials.
pub fn grid_s(rows: &[Rows]) -> f64 {
    let usual = rows.iter().map(|own| usual_step_s(&own.clock.t_s)).fold(f64::INFINITY, f64::min);
    let all: f64 = rows.iter().map(Rows::duration_s).sum();
    usual.max(all / MOST_POINTS)
}

/// A trial on the grid.
pub struct Motion {
    pub grid_s: f64,
    pub input: Vec<f64>,
    pub speed: Vec<f64>,
    pub load: Vec<f64>,
    pub bend_rad: Option<Vec<f64>>,
    /// Grid points of the samples.
    pub at: Vec<usize>,
    /// Whether each grid point follows a reversal closely.
    pub turning: Vec<bool>,
    kernel: Gaussian,
}

/// What was measured of it.
pub struct Measured {
    /// At every grid point, smoothed.
    pub output: Vec<f64>,
    /// Of the smoothed output and of the input.
    pub output_noise: f64,
    pub input_noise: f64,
}

impl Motion {
    /// `range`: of the input over all trials; `stated`: noise of a row of input and output.
    pub fn of(
        rows: &Rows,
        grid_s: f64,
        range: [f64; 2],
        stated: [Option<f64>; 2],
    ) -> (Self, Measured) {
        let t_s = &rows.clock.t_s[..];
        let on_grid = |column: &[f64]| evenly(t_s, column, grid_s);
        let kernel = Gaussian::new(OUTPUT_SD);
        let input = on_grid(&rows.data.input);
        let output = kernel.smooth(&on_grid(&rows.data.output));
        let noise = |column: &[f64], stated: Option<f64>| {
            let own = Noise::of(t_s, column).or_stated(stated);
            let smooth = kernel.smooth(&kernel.smooth(&on_grid(column)));
            let of_steps = step_of(column).map_or(0.0, |step| of_steps(&smooth, step, &kernel));
            (PASSED * own).max(of_steps)
        };
        let input_noise = noise(&rows.data.input, stated[0]);
        let output_noise = noise(&rows.data.output, stated[1]);
        let smooth = kernel.smooth(&input);
        let speed = slope(&smooth, grid_s);
        let travel = range[1] - range[0];
        let points = input.len();
        let reach = kernel.reach() + 1;
        let jumps: Vec<[usize; 2]> = rows
            .clock
            .spans_s()
            .map(|span| span.map(|t| ((t - t_s[0]) / grid_s) as usize))
            .collect();
        let settled = settled(&smooth, travel, &jumps);
        let near_jump = |i: usize| {
            jumps.iter().any(|&[from, to]| from.saturating_sub(reach) <= i && i <= to + reach)
        };
        let at: Vec<usize> = (reach..points.saturating_sub(reach))
            .step_by(STRIDE)
            .filter(|&i| settled[i] && !near_jump(i))
            .collect();
        let turning = turning(&smooth, TURNING * travel);
        let load = rows.data.load.as_deref().map(on_grid).unwrap_or_default();
        let bend_rad = rows.data.bend_rad.as_deref().map(on_grid);
        let motion = Self { grid_s, input, speed, load, bend_rad, at, turning, kernel };
        (motion, Measured { output, output_noise, input_noise })
    }

    /// A series at the samples, read `shift_s` later.
    pub fn read(&self, series: &[f64], shift_s: f64) -> Vec<f64> {
        let shift = shift_s / self.grid_s;
        let (whole, last) = (shift.round(), series.len().saturating_sub(1) as f64);
        let share = shift - whole;
        let kernel = match share.abs() > 0.0 {
            true => &Gaussian::centred(OUTPUT_SD, share),
            false => &self.kernel,
        };
        let moved = |i: usize| (i as f64 + whole).clamp(0.0, last) as usize;
        self.at.iter().map(|&i| kernel.at(series, moved(i))).collect()
    }
}

/// What steps of a sensor leave in a smoothed series, root mean square where it moves.
fn of_steps(smooth: &[f64], step: f64, kernel: &Gaussian) -> f64 {
    let off: Vec<f64> = smooth.iter().map(|x| (x / step).round() * step - x).collect();
    let passed = kernel.smooth(&off);
    let moving = smooth.windows(2).zip(&passed).filter(|(pair, _)| pair[1] != pair[0]);
    let (sum, count) = moving.fold((0.0, 0_usize), |(sum, n), (_, d)| (sum + d * d, n + 1));
    if count > 0 { (sum / count as f64).sqrt() } else { 0.0 }
}

/// Whether the input has covered enough since the trial began, or since the clock jumped, that it does not matter
/// where the transmission was in its slack. A trial that never covers as much is settled where it has covered most of
/// its own range.
fn settled(input: &[f64], travel: f64, jumps: &[[usize; 2]]) -> Vec<bool> {
    /// Share of its own range.
    const OWN: f64 = 0.9;

    let range = |values: &[f64]| {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        values.iter().copied().fold(f64::NEG_INFINITY, f64::max) - low
    };
    let mut settled = vec![false; input.len()];
    let mut from = 0;
    let ends = jumps.iter().map(|[_, to]| (*to).min(input.len())).chain([input.len()]);
    for end in ends {
        let own = &input[from.min(end)..end];
        let enough = (MOST_SLACK * travel).min(OWN * range(own));
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for (i, x) in own.iter().enumerate() {
            (low, high) = (low.min(*x), high.max(*x));
            settled[from + i] = high - low >= enough && enough > 0.0;
        }
        from = end;
    }
    settled
}

/// Motion after a reversal that counts as turning round, over the travel.
const TURNING: f64 = 0.1;

/// Whether the input has moved less than `least` since it turned round last.
fn turning(input: &[f64], least: f64) -> Vec<bool> {
    /// A motion back by less is no reversal, over `least`.
    const TREMBLE: f64 = 0.02;

    let Some(&first) = input.first() else { return Vec::new() };
    let (mut extreme, mut turned_at, mut rises) = (first, first, true);
    let at = |&x: &f64| {
        let beyond = if rises { x - extreme } else { extreme - x };
        if beyond > 0.0 {
            extreme = x;
        } else if -beyond > TREMBLE * least {
            (turned_at, extreme, rises) = (extreme, x, !rises);
        }
        (x - turned_at).abs() < least
    };
    input.iter().map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trial_is_settled_once_it_has_covered_the_largest_slack() {
        let there_and_back: Vec<f64> =
            (0..100).chain((0..100).rev()).map(|i| 0.01 * f64::from(i)).collect();
        let own = settled(&there_and_back, 1.0, &[]);
        assert_eq!(own.iter().position(|own| *own), Some(20));
        let small: Vec<f64> = there_and_back.iter().map(|x| 0.1 * x).collect();
        let own = settled(&small, 1.0, &[]);
        assert!(!own[80] && own[95], "nine tenths of its own range");
        let jumped = settled(&there_and_back, 1.0, &[[100, 101]]);
        assert!(jumped[99] && !jumped[110] && jumped[125]);
        assert!(!settled(&[0.5; 50], 1.0, &[])[40], "it never moves");
    }

    #[test]
    fn what_follows_a_reversal_is_turning() {
        let path: Vec<f64> = (0..100).chain((0..100).rev()).map(|i| 0.01 * f64::from(i)).collect();
        let own = turning(&path, 0.1);
        assert!(!own[95] && own[105] && !own[120]);
    }
}
