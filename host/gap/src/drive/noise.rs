//! What a position that is not read exactly leaves open in the acceleration, and the noise of the
//! command itself.
//!
//! White noise, steps of the encoder and a trembling clock look alike in fourth differences, which
//! a motion hardly has: those of white noise of 1 have a standard deviation of √70. They are taken at
//! even times, where a row that came late shows as one that was read wrong.

use super::motion::{Filters, GRID_S, Motion, evenly};

/// Share of the differences that are looked at: the largest ones are jerks and jumps of the clock.
const LOOKED_AT: f64 = 0.9;
/// That quantile of the size of normally distributed numbers.
const NORMAL: f64 = 1.645;

/// Standard deviation of the acceleration as it is compared \[m/s²\]. `position_m`: one a row.
pub fn acceleration_m_per_s2(t_s: &[f64], position_m: &[f64]) -> f64 {
    white(t_s, position_m) * gain_per_s2() * narrowed(t_s)
}

/// Standard deviation of the command's noise as it is compared \[N\], of the one of a row, which
/// is taken from the rows where nobody `stated` it.
pub fn command_n(t_s: &[f64], command_n: &[f64], stated: Option<f64>) -> f64 {
    let mut impulse = vec![0.0; 4 * Filters::new().reach() + 1];
    let middle = impulse.len() / 2;
    impulse[middle] = 1.0;
    let gain = Filters::new().measured(&impulse).iter().map(|x| x * x).sum::<f64>().sqrt();
    stated.unwrap_or_else(|| white(t_s, command_n)) * gain * narrowed(t_s)
}

/// Rows farther apart than the grid have their noise in a narrower band.
fn narrowed(t_s: &[f64]) -> f64 {
    (step_s(t_s) / GRID_S).max(1.0).sqrt()
}

fn step_s(t_s: &[f64]) -> f64 {
    (t_s[t_s.len() - 1] - t_s[0]) / (t_s.len() - 1) as f64
}

/// White noise of a series at these times, in its unit.
pub fn white(t_s: &[f64], series: &[f64]) -> f64 {
    let series = evenly(t_s, series, step_s(t_s));
    let fourth = |w: &[f64]| (w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4]).abs();
    let mut sizes: Vec<f64> = series.windows(5).map(fourth).collect();
    sizes.sort_by(f64::total_cmp);
    let at = (LOOKED_AT * sizes.len() as f64) as usize;
    sizes.get(at).copied().unwrap_or_default() / (NORMAL * 70.0_f64.sqrt())
}

/// Standard deviation of the filtered second derivative of white noise of 1 on the grid \[1/s²\].
fn gain_per_s2() -> f64 {
    let filters = Filters::new();
    let reach = filters.reach();
    let mut impulse = vec![0.0; 4 * reach + 1];
    impulse[2 * reach] = 1.0;
    let motion = Motion::of(&impulse);
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
        let found = white(&t_s, &steps) / (q / 12.0_f64.sqrt());
        assert!((found - 1.0).abs() < 0.2, "{found}");
        assert!(white(&t_s, &smooth) < 1e-3 * white(&t_s, &steps));
        // As it is played through the pipeline.
        let filters = Filters::new();
        let read = |x: &[f64]| {
            let at: Vec<usize> = (100..x.len() - 100).collect();
            filters.predicted(&Motion::of(x).acceleration_m_per_s2, &at, 0.0)
        };
        let errors: Vec<f64> = read(&steps).iter().zip(read(&smooth)).map(|(a, b)| a - b).collect();
        let sd = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
        let ratio = acceleration_m_per_s2(&t_s, &steps) / sd;
        assert!((0.6..1.7).contains(&ratio), "{ratio}");
    }
    #[test]
    fn a_clock_that_trembles_is_noise_of_the_position() {
        let (rows, speed_m_per_s, tremble_s) = (4000, 0.1, 3e-4);
        let steady: Vec<f64> = (0..rows).map(|i| f64::from(i) * 1e-3).collect();
        let position: Vec<f64> = steady.iter().map(|t| speed_m_per_s * t).collect();
        let shaken = |(i, t): (usize, &f64)| t + tremble_s * if i % 3 == 0 { 1.0 } else { -0.5 };
        let t_s: Vec<f64> = steady.iter().enumerate().map(shaken).collect();
        assert!(white(&steady, &position) < 1e-12);
        let found = white(&t_s, &position) / (speed_m_per_s * tremble_s);
        assert!((0.3..3.0).contains(&found), "{found}");
    }
}
