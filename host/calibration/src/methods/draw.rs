//! Random numbers of a generation. They follow from the seed and the number of the generation alone,
//! so that no state of a generator must be kept to resume.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Draws until a normal number lies within the cube; beyond, it is put onto its side.
const MOST_DRAWS: usize = 100;

pub struct Draw(ChaCha8Rng);

impl Draw {
    pub fn of(seed: u64, generation: usize) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(generation as u64);
        Self(rng)
    }

    /// From 0 to 1.
    pub fn uniform(&mut self) -> f64 {
        self.0.random()
    }

    /// Of mean 0 and standard deviation 1, by Box and Muller.
    pub fn normal(&mut self) -> f64 {
        let u: f64 = self.0.random_range(f64::MIN_POSITIVE..1.0);
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * self.0.random::<f64>()).cos()
    }

    /// A normal number from 0 to 1.
    pub fn within(&mut self, mean: f64, sd: f64) -> f64 {
        let mut last = mean;
        for _ in 0..MOST_DRAWS {
            last = mean + sd * self.normal();
            if (0.0..=1.0).contains(&last) {
                return last;
            }
        }
        last.clamp(0.0, 1.0)
    }
}
