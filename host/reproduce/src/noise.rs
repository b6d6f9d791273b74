//! Random numbers of an experiment, from its seed.

use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Resolution of the ATI Mini-40 in its calibration SI-80-4, which all three publications used, for
/// Fx and Fy and for Fz \[N\]: table 5 of the CathBot thesis.
const RESOLUTION_N: [f64; 3] = [1.0 / 50.0, 1.0 / 50.0, 1.0 / 25.0];

/// White noise; the same seed gives the same numbers.
pub struct Noise(ChaCha8Rng);

impl Noise {
    pub fn of_seed(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// Of standard deviation 1, by Box and Muller.
    pub fn normal(&mut self) -> f64 {
        let u: f64 = self.0.random_range(f64::MIN_POSITIVE..1.0);
        let angle = std::f64::consts::TAU * self.0.random::<f64>();
        (-2.0 * u.ln()).sqrt() * angle.cos()
    }

    /// An angle \[rad\].
    pub fn phase(&mut self) -> f64 {
        std::f64::consts::TAU * self.0.random::<f64>()
    }
}

/// What the sensor reads of `force_n`: noise of half a step of its resolution, then the step.
/// `coarse` is the axis along the sensor's own z.
pub fn sensed(force_n: Vector3<f64>, coarse: usize, noise: &mut Noise) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| {
        let step = RESOLUTION_N[if axis == coarse { 2 } else { 0 }];
        ((force_n[axis] + 0.5 * step * noise.normal()) / step).round() * step
    })
}

/// Centred moving average over `2 half + 1` values, fewer at the ends.
pub fn averaged(values: &[Vector3<f64>], half: usize) -> Vec<Vector3<f64>> {
    let mut sums = vec![Vector3::zeros()];
    for value in values {
        sums.push(sums[sums.len() - 1] + value);
    }
    let mean = |k: usize| {
        let (low, high) = (k.saturating_sub(half), (k + half + 1).min(values.len()));
        (sums[high] - sums[low]) / (high - low) as f64
    };
    (0..values.len()).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sensor_has_steps_and_an_average_finds_what_lies_between_them() {
        let mut noise = Noise::of_seed(1);
        let truth = Vector3::new(0.013, -0.004, 0.027);
        let read: Vec<_> = (0..4001).map(|_| sensed(truth, 2, &mut noise)).collect();
        assert!(read.iter().all(|f| ((f.x * 50.0).round() - f.x * 50.0).abs() < 1e-9));
        // 4001 readings of standard deviation below one step: 0.02 N/√4001 = 0.3 mN, 0.6 mN along z.
        let mean = averaged(&read, 4000)[2000];
        assert!((mean - truth).abs().max() < 2.5e-3, "{mean}");
    }

    #[test]
    fn an_average_keeps_a_straight_line() {
        let line: Vec<_> = (0..50).map(|k| Vector3::x() * f64::from(k)).collect();
        let mean = averaged(&line, 5);
        assert!((6..44).all(|k| (mean[k] - line[k]).norm() < 1e-12));
        assert_eq!(mean[0].x, 2.5);
    }
}
