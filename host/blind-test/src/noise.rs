//! Normally distributed numbers from a seed.

use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// White noise; the same seed gives the same numbers.
#[derive(Clone, Debug)]
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

    /// Of standard deviation `sd` along every axis.
    pub fn vector(&mut self, sd: f64) -> Vector3<f64> {
        Vector3::new(self.normal(), self.normal(), self.normal()) * sd
    }
}
