//! What a position that is not read exactly leaves open in the acceleration, and the noise of the
//! command itself.
//!
//! White noise, steps of the encoder and a trembling clock look alike in fourth differences, which
//! a motion hardly has: those of white noise of 1 have a standard deviation of √70, and 2k-th ones
//! of √(4k over 2k). They are taken at even times, where a row that came late shows as one that was
//! read wrong.
//!
//! Where rows are few, fourth differences are those of the motion. Eighth ones tell: white noise is
//! as large in them, what a motion has is less.

use super::motion::{Filters, GRID_S, Motion, evenly};
use crate::data::clock::{jumps, usual_step_s};

/// Share of the differences that are looked at: the largest ones are jerks and jumps of the clock.
const LOOKED_AT: f64 = 0.9;
/// That quantile of the size of normally distributed numbers.
const NORMAL: f64 = 1.645;
/// Weights of fourth and eighth differences, and the square root of the sum of their squares.
const FOURTH: ([f64; 5], f64) = ([1.0, -4.0, 6.0, -4.0, 1.0], 8.366_600_265);
const EIGHTH: ([f64; 9], f64) =
    ([1.0, -8.0, 28.0, -56.0, 70.0, -56.0, 28.0, -8.0, 1.0], 113.446_022_4);
/// Noise in eighth differences, as a share of that in fourth ones, from which on it is white.
const WHITE: f64 = 0.7;

/// What the rows of a series say of its noise, in its unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// It is no more than this.
    pub most: f64,
    /// It is this much, and no motion is taken for it.
    pub is_white: bool,
}

impl Noise {
    /// Of a series at these times. Rows that are closer than the grid are taken on the grid, as
    /// they are compared: steps of an encoder that most rows do not see are no noise of rows.
    pub fn of(t_s: &[f64], series: &[f64]) -> Self {
        let step_s = usual_step_s(t_s).max(GRID_S);
        let (mut from, mut pieces) = (0, Vec::new());
        for to in jumps(t_s).iter().map(|jump| jump.row + 1).chain([t_s.len()]) {
            pieces.push(evenly(&t_s[from..to], &series[from..to], step_s));
            from = to;
        }
        let (fourth, eighth) = (in_differences(&pieces, &FOURTH), in_differences(&pieces, &EIGHTH));
        let is_white = eighth >= WHITE * fourth;
        Self { most: if is_white { fourth } else { eighth }, is_white }
    }

    /// With what rig.toml states: it knows better than rows in which a motion hides the noise.
    pub fn or_stated(self, stated: Option<f64>) -> f64 {
        let stated = stated.filter(|_| !self.is_white).unwrap_or(f64::INFINITY);
        self.most.min(stated)
    }
}

/// White noise that has differences as large as these.
fn in_differences<const N: usize>(pieces: &[Vec<f64>], (weights, size): &([f64; N], f64)) -> f64 {
    let difference = |w: &[f64]| w.iter().zip(weights).map(|(x, k)| k * x).sum::<f64>().abs();
    let mut sizes: Vec<f64> = pieces.iter().flat_map(|p| p.windows(N).map(difference)).collect();
    sizes.sort_by(f64::total_cmp);
    let at = (LOOKED_AT * sizes.len() as f64) as usize;
    sizes.get(at).copied().unwrap_or_default() / (NORMAL * size)
}

/// Factor by which noise of the position is larger in the acceleration than rows show it: steps of
/// an encoder that moves slowly are less white than differences take them for. Strokes with rests
/// in between, read in steps of 10 µm, have 1.13.
const SLOW: f64 = 1.25;

/// Standard deviation of the acceleration as it is compared \[m/s²\], of that of a row's position.
pub fn acceleration_m_per_s2(t_s: &[f64], position_m: f64, filters: &Filters) -> f64 {
    SLOW * position_m * gain_per_s2(filters) * narrowed(t_s, filters)
}

/// Widths of the filters that are tried, in those of the narrowest: 30 Hz down to 5 Hz.
const WIDTHS: [f64; 8] = [1.0, 1.3, 1.7, 2.2, 2.8, 3.6, 4.6, 6.0];
/// Share of the command, as it passes the filters, that what the encoder leaves open may be. It is half of
/// what a floor hides friction from (`HIDING` of the plant).
const SMALL_SHARE: f64 = 0.01;

/// The narrowest filters through which the noise of the position is small beside the command; where there are
/// none, those through which it is smallest. A motion that is as fast as the noise passes none of them, so that
/// filters are never wider than the motion allows.
///
/// `rows`: of every trial its times, its command, and its inertia times the noise of a row of its position;
/// `step_s`: between rows.
pub fn filters(rows: &[(&[f64], &[f64], f64)], step_s: f64) -> Filters {
    let share = |filters: &Filters| {
        let (mut noise, mut command, mut points) = (0.0, 0.0, 0.0);
        for (t_s, commanded, inertial) in rows {
            let passed = filters.measured(&filters.on_grid(t_s, commanded));
            let mean = passed.iter().sum::<f64>() / passed.len().max(1) as f64;
            let open = acceleration_m_per_s2(t_s, *inertial, filters);
            noise += open * open * passed.len() as f64;
            command += passed.iter().map(|f| (f - mean).powi(2)).sum::<f64>();
            points += passed.len() as f64;
        }
        if points > 0.0 && command > 0.0 { (noise / command).sqrt() } else { 0.0 }
    };
    let mut best = Filters::new(step_s, WIDTHS[0]);
    let mut least = share(&best);
    for wider in &WIDTHS[1..] {
        if least <= SMALL_SHARE {
            break;
        }
        let filters = Filters::new(step_s, *wider);
        let own = share(&filters);
        if own < least {
            (best, least) = (filters, own);
        }
    }
    best
}

/// The step of an encoder whose every row is a whole number of steps; `None` where rows lie between.
pub fn step_of(position: &[f64]) -> Option<f64> {
    let moved = || position.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let largest = position.iter().map(|x| x.abs()).fold(0.0, f64::max);
    // Less than this is how a number is written.
    let least = 1e-12 * largest;
    let step = moved().filter(|d| *d > least).fold(f64::INFINITY, f64::min);
    let first = position.first()?;
    let is_whole = |x: &f64| {
        let steps = (x - first) / step;
        (steps - steps.round()).abs() < OFF_STEP
    };
    let whole = position.iter().filter(|x| is_whole(x)).count();
    (step.is_finite() && whole as f64 > 0.99 * position.len() as f64).then_some(step)
}

/// Share of a step by which a row that is written with few digits may lie off it.
const OFF_STEP: f64 = 0.1;
/// Times the noise of steps that rows may have, and still are those of steps alone.
const OF_STEPS: f64 = 1.5;

/// What the steps of an encoder leave open in the acceleration along this motion, root mean square: the motion as
/// it was smoothed is read in steps again. Steps that a slow motion takes one by one are no white noise. `None`
/// where rows are not in steps, or have noise beyond them.
pub fn of_steps(position: &[f64], noise: f64, motion: &Motion, filters: &Filters) -> Option<f64> {
    let step = step_of(position).filter(|step| noise < OF_STEPS * step / 12.0_f64.sqrt())?;
    // Smoothed over, the motion has no steps of its own that would agree with those that are put in.
    let smooth = filters.measured(&motion.position_m);
    let read: Vec<f64> = smooth.iter().map(|x| (x / step).round() * step).collect();
    let [read, smooth] = [read, smooth].map(|x| Motion::of(&x, filters).acceleration_m_per_s2);
    let differences: Vec<f64> = read.iter().zip(&smooth).map(|(a, b)| a - b).collect();
    let at: Vec<usize> =
        (filters.reach()..differences.len().saturating_sub(filters.reach())).collect();
    let passed = filters.predicted(&differences, &at, 0.0);
    let moving = passed.iter().filter(|d| d.abs() > 0.0);
    let (sum, count) = moving.fold((0.0, 0_usize), |(sum, n), d| (sum + d * d, n + 1));
    (count > 0).then(|| (sum / count as f64).sqrt())
}

/// Standard deviation of the command's noise as it is compared \[N\], of that of a row.
pub fn command_n(t_s: &[f64], row_n: f64, filters: &Filters) -> f64 {
    let mut impulse = vec![0.0; 4 * filters.reach() + 1];
    let middle = impulse.len() / 2;
    impulse[middle] = 1.0;
    let gain = filters.measured(&impulse).iter().map(|x| x * x).sum::<f64>().sqrt();
    row_n * gain * narrowed(t_s, filters)
}

/// Rows farther apart than the grid have their noise in a narrower band.
fn narrowed(t_s: &[f64], filters: &Filters) -> f64 {
    (usual_step_s(t_s) / filters.grid_s).max(1.0).sqrt()
}

/// Standard deviation of the filtered second derivative of white noise of 1 on the grid \[1/s²\].
fn gain_per_s2(filters: &Filters) -> f64 {
    let reach = filters.reach();
    let mut impulse = vec![0.0; 4 * reach + 1];
    impulse[2 * reach] = 1.0;
    let motion = Motion::of(&impulse, filters);
    let at: Vec<usize> = (0..impulse.len()).collect();
    let response = filters.predicted(&motion.acceleration_m_per_s2, &at, 0.0);
    response.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_of_an_encoder_are_noise_and_a_smooth_motion_is_none() {
        let t_s: Vec<f64> = (0..4000).map(|i| f64::from(i) * 1e-3).collect();
        let smooth: Vec<f64> = t_s.iter().map(|t| 0.1 * (3.0 * t).sin()).collect();
        let q = 1e-5;
        let steps: Vec<f64> = smooth.iter().map(|x| (x / q).round() * q).collect();
        let noise = Noise::of(&t_s, &steps);
        let found = noise.most / (q / 12.0_f64.sqrt());
        assert!((found - 1.0).abs() < 0.2 && noise.is_white, "{found}");
        assert!(Noise::of(&t_s, &smooth).most < 1e-3 * noise.most);
        // As it is played through the pipeline.
        let filters = Filters::new(1e-3, 1.0);
        let read = |x: &[f64]| {
            let at: Vec<usize> = (100..x.len() - 100).collect();
            filters.predicted(&Motion::of(x, &filters).acceleration_m_per_s2, &at, 0.0)
        };
        let errors: Vec<f64> = read(&steps).iter().zip(read(&smooth)).map(|(a, b)| a - b).collect();
        let sd = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
        let ratio = acceleration_m_per_s2(&t_s, noise.most, &filters) / sd;
        assert!((0.6..1.7).contains(&ratio), "{ratio}");
    }

    #[test]
    fn a_motion_that_is_read_seldom_is_not_taken_for_noise() {
        let (sd_m, step_s) = (1e-6, 8e-3);
        let t_s: Vec<f64> = (0..2000).map(|i| f64::from(i) * step_s).collect();
        let read = |i: usize| {
            let noise = sd_m * crate::toy::noise(i);
            0.05 * (20.0 * t_s[i]).sin() + noise
        };
        let rows: Vec<f64> = (0..t_s.len()).map(read).collect();
        let found = Noise::of(&t_s, &rows);
        assert!(!found.is_white);
        assert!((0.8..1.3).contains(&(found.most / sd_m)), "{found:?}");
        assert_eq!(found.or_stated(Some(0.5 * sd_m)), 0.5 * sd_m);
        assert_eq!(found.or_stated(Some(2.0 * sd_m)), found.most);
        // What rows show that are near enough is believed, whatever is stated.
        let white: Vec<f64> = (0..t_s.len()).map(|i| sd_m * crate::toy::noise(i)).collect();
        let found = Noise::of(&t_s, &white);
        assert!((found.or_stated(Some(1e-9)) / sd_m - 1.0).abs() < 0.2, "{found:?}");
    }

    #[test]
    fn a_clock_that_trembles_is_noise_of_the_position() {
        let (rows, speed_m_per_s, tremble_s) = (4000, 0.1, 3e-4);
        let steady: Vec<f64> = (0..rows).map(|i| f64::from(i) * 1e-3).collect();
        let position: Vec<f64> = steady.iter().map(|t| speed_m_per_s * t).collect();
        let shaken = |(i, t): (usize, &f64)| t + tremble_s * if i % 3 == 0 { 1.0 } else { -0.5 };
        let t_s: Vec<f64> = steady.iter().enumerate().map(shaken).collect();
        assert!(Noise::of(&steady, &position).most < 1e-12);
        let found = Noise::of(&t_s, &position).most / (speed_m_per_s * tremble_s);
        assert!((0.3..3.0).contains(&found), "{found}");
    }
}
