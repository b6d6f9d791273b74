//! Noise of a sensor, from what it measured.

/// Standard deviation of white noise under a slow signal.
///
/// It is estimated from the second differences, whose median a few events do not move. A sensor whose
/// readings have steps is uncertain by at least step/√12, however steady its readings are.
/// `rows`: index of a row and its value; returns the standard deviation in the value's unit, 0 for
/// fewer than three rows.
pub fn white_noise(rows: &[(usize, f64)]) -> f64 {
    /// Median of |x| of a normal distribution, in standard deviations.
    const MEDIAN: f64 = 0.6745;
    let second = |w: &[(usize, f64)]| (w[0].1 - 2.0 * w[1].1 + w[2].1).abs() / 6.0_f64.sqrt();
    let mut differences: Vec<f64> = rows.windows(3).map(second).collect();
    differences.sort_by(f64::total_cmp);
    let white = differences.get(differences.len() / 2).map_or(0.0, |median| median / MEDIAN);
    white.max(smallest_step(rows) / 12.0_f64.sqrt())
}

/// Smallest change from one row to the next, which is the step of a coarse sensor and next to nothing of a
/// fine one. Changes in the last printed digit of the same level are none.
fn smallest_step(rows: &[(usize, f64)]) -> f64 {
    /// Of the largest reading.
    const SAME_LEVEL: f64 = 1e-9;
    let largest = rows.iter().map(|row| row.1.abs()).fold(0.0, f64::max);
    let changes = rows.windows(2).map(|w| (w[1].1 - w[0].1).abs());
    let smallest = changes.filter(|own| *own > SAME_LEVEL * largest).fold(f64::INFINITY, f64::min);
    if smallest.is_finite() && rows.len() > 2 { smallest } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use rand::rngs::StdRng;
    use rand::{Rng, SeedableRng};

    use super::*;

    #[test]
    fn white_noise_is_found_under_a_slow_signal() {
        // Uniform from −1 to 1: standard deviation 1/√3.
        let mut rng = StdRng::seed_from_u64(1);
        let mut noise = || rng.random_range(-1.0..1.0);
        let rows: Vec<(usize, f64)> =
            (0..1000).map(|row| (row, (row as f64 * 0.01).sin() + 0.1 * noise())).collect();
        let found = white_noise(&rows);
        assert!((found / (0.1 / 3.0_f64.sqrt()) - 1.0).abs() < 0.15, "{found}");
    }

    #[test]
    fn readings_in_steps_are_uncertain_by_the_step() {
        let coarse = |row: usize| (row, 0.25 * ((row as f64 * 0.002).sin() / 0.25).round());
        let rows: Vec<(usize, f64)> = (0..1000).map(coarse).collect();
        let found = white_noise(&rows);
        assert!((found / (0.25 / 12.0_f64.sqrt()) - 1.0).abs() < 1e-9, "{found}");
        assert_eq!(white_noise(&[(0, 1.0); 10]), 0.0, "what never changes has no step");
    }
}
