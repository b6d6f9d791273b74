//! White noise of a sensor, and what it makes of the features of a record.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Repeats from which the spread of features is taken: the standard deviation of 200 normal numbers is
/// known to one part in √(2·200) = 20.
const REPEATS: usize = 200;

/// White noise; the same seed gives the same numbers.
#[derive(Clone, Debug)]
pub struct Noise(ChaCha8Rng);

impl Noise {
    /// Noise from a seed.
    pub fn of_seed(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// Of mean 0 and standard deviation 1, by Box and Muller.
    pub fn normal(&mut self) -> f64 {
        let u: f64 = self.0.random_range(f64::MIN_POSITIVE..1.0);
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * self.0.random::<f64>()).cos()
    }

    /// Of a normal distribution that is cut off at `low` and `high`.
    pub fn within(&mut self, mean: f64, sd: f64, low: f64, high: f64) -> f64 {
        /// A distribution of which less than a thousandth lies within is not meant.
        const MOST_DRAWS: usize = 1000;
        let draws = (0..MOST_DRAWS).map(|_| mean + sd * self.normal());
        draws.into_iter().find(|x| (low..=high).contains(x)).unwrap_or(mean.clamp(low, high))
    }

    /// A record as the sensor reads it.
    pub fn on(&mut self, record: &[f64], sd: f64) -> Vec<f64> {
        record.iter().map(|x| x + sd * self.normal()).collect()
    }
}

/// Standard deviations that white noise of standard deviation `sd` on a record gives to its features.
///
/// `features` computes them from a record; `None` from it is left out. Gives `None` where fewer than
/// half of the noisy records have features.
pub fn feature_sd<const N: usize>(
    record: &[f64],
    sd: f64,
    seed: u64,
    features: impl Fn(&[f64]) -> Option<[f64; N]>,
) -> Option<[f64; N]> {
    let mut noise = Noise::of_seed(seed);
    let all: Vec<[f64; N]> = (0..REPEATS).filter_map(|_| features(&noise.on(record, sd))).collect();
    if 2 * all.len() < REPEATS {
        return None;
    }
    let count = all.len() as f64;
    Some(std::array::from_fn(|k| {
        let mean = all.iter().map(|own| own[k]).sum::<f64>() / count;
        let squares = all.iter().map(|own| (own[k] - mean).powi(2)).sum::<f64>();
        (squares / (count - 1.0)).sqrt()
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_spreads_a_mean_by_its_root() {
        let found = feature_sd(&[1.0; 100], 0.5, 3, |own| Some([own.iter().sum::<f64>() / 100.0]));
        assert!((found.unwrap()[0] / 0.05 - 1.0).abs() < 0.2, "{found:?}");
        assert_eq!(feature_sd::<1>(&[1.0], 0.5, 3, |_| None), None);
        let mut noise = Noise::of_seed(5);
        assert!((0..100).all(|_| (-0.1..=0.2).contains(&noise.within(0.0, 1.0, -0.1, 0.2))));
    }
}
