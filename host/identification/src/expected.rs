//! Features as a noisy sensor gives them, and noise whose parts are independent.
//!
//! The largest of many noisy samples lies above the largest true one, and features share samples: all
//! displacements of a release are from its first one. Simulated features are therefore the mean over noisy
//! repeats of the simulated record, and the differences to the measured ones are multiplied by L⁻¹, where
//! L Lᵀ is the covariance that the noise gives them.

use nalgebra::{DMatrix, DVector};

use crate::hysteresis::PulledTip;
use crate::noise::Noise;
use crate::replay::between;
use crate::rod::{Releases, RodValues};
use crate::search::{Experiment, Measured};
use crate::tendon::{LoopRecord, TendonValues};
use crate::weight_release::{ReleaseFeatures, release_features};
use cathforce_mechanics::Lumen;
use rayon::prelude::*;

/// Noisy repeats. Their mean is off by a tenth of a standard deviation, by the same for all values of the
/// parameters; standard deviations are known to one part in √(2·100) = 14.
const REPEATS: usize = 100;

/// The same noise for every record.
pub(crate) struct Repeats(Vec<Vec<f64>>);

impl Repeats {
    /// Noise of a standard deviation for records of so many samples at most.
    pub fn new(noise_m: f64, samples: usize, seed: u64) -> Self {
        let mut noise = Noise::of_seed(seed);
        let zero = vec![0.0; samples];
        Self((0..REPEATS).map(|_| noise.on(&zero, noise_m)).collect())
    }

    fn features<const N: usize>(
        &self,
        record: &[f64],
        features: impl Fn(&[f64]) -> Option<[f64; N]>,
    ) -> Option<Vec<[f64; N]>> {
        let noisy = |noise: &Vec<f64>| -> Vec<f64> {
            record.iter().zip(noise).map(|(own, noise)| own + noise).collect()
        };
        let all: Vec<[f64; N]> = self.0.iter().filter_map(|own| features(&noisy(own))).collect();
        (2 * all.len() >= REPEATS).then_some(all)
    }

    /// The mean of features; `None` where fewer than half of the repeats have some.
    pub fn mean<const N: usize>(
        &self,
        record: &[f64],
        features: impl Fn(&[f64]) -> Option<[f64; N]>,
    ) -> Option<[f64; N]> {
        let all = self.features(record, features)?;
        Some(std::array::from_fn(|k| all.iter().map(|own| own[k]).sum::<f64>() / all.len() as f64))
    }

    /// The lower triangle L of the covariance L Lᵀ of features. `sd`: their standard deviations, which may
    /// hold more than this noise.
    pub fn triangle<const N: usize>(
        &self,
        record: &[f64],
        sd: &[f64],
        features: impl Fn(&[f64]) -> Option<[f64; N]>,
    ) -> Option<DMatrix<f64>> {
        let all = self.features(record, features)?;
        let table = DMatrix::from_fn(all.len(), N, |i, k| all[i][k]);
        let mean = table.row_mean();
        let centred = DMatrix::from_fn(all.len(), N, |i, k| table[(i, k)] - mean[k]);
        let mut covariance = centred.tr_mul(&centred) / (all.len() as f64 - 1.0);
        for (k, sd) in sd.iter().enumerate().take(N) {
            covariance[(k, k)] = covariance[(k, k)].max(sd * sd);
        }
        Some(covariance.cholesky()?.unpack())
    }
}

/// Features times L⁻¹, block by block.
pub(crate) fn whitened(features: &[f64], triangles: &[DMatrix<f64>]) -> Option<Vec<f64>> {
    let mut rest = features;
    let mut all = Vec::with_capacity(features.len());
    for own in triangles {
        let (block, others) = rest.split_at_checked(own.nrows())?;
        rest = others;
        let solved = own.solve_lower_triangular(&DVector::from_column_slice(block))?;
        all.extend(solved.iter());
    }
    rest.is_empty().then_some(all)
}

/// Measured features times L⁻¹, of standard deviation 1.
pub(crate) fn whitened_measured(
    measured: &Measured,
    triangles: &[DMatrix<f64>],
) -> Option<Measured> {
    let features = whitened(&measured.features, triangles)?;
    Some(Measured { sd: vec![1.0; features.len()], features })
}

/// An experiment whose features are multiplied by L⁻¹.
pub(crate) struct Whitened<'a> {
    pub experiment: &'a dyn Experiment,
    pub triangles: &'a [DMatrix<f64>],
}

impl Experiment for Whitened<'_> {
    fn features(&self, values: &[f64], fine: bool) -> Option<Vec<f64>> {
        whitened(&self.experiment.features(values, fine)?, self.triangles)
    }
}

/// Six features of a release.
pub(crate) fn of_release(position_m: &[f64], step_s: f64) -> Option<[f64; 6]> {
    release_features(position_m, step_s).ok().map(ReleaseFeatures::to_array)
}

/// Releases, sampled as the measured ones by a noisy sensor.
pub(crate) struct NoisyReleases<'a> {
    pub releases: Releases<'a>,
    pub samples: usize,
    pub repeats: &'a Repeats,
}

impl Experiment for NoisyReleases<'_> {
    fn features(&self, values: &[f64], fine: bool) -> Option<Vec<f64>> {
        let values = RodValues::of_array(values.try_into().ok()?);
        let Releases { setup, coarse, fine: finer } = &self.releases;
        let (problem, rest) = if fine { finer } else { coarse };
        let mut all = Vec::new();
        for own in setup.releases(&values, problem, rest).ok()? {
            let at = |k: usize| between(&own.position_m, k as f64 * setup.sample_s / own.step_s);
            let record: Vec<f64> = (0..self.samples).map(at).collect();
            all.extend(self.repeats.mean(&record, |own| of_release(own, setup.sample_s))?);
        }
        Some(all)
    }
}

/// Recorded loops of a tendon, whose drives are played to a coarse and to a fine chain of links, and read by
/// a noisy sensor.
pub(crate) struct NoisyLoops<'a> {
    pub records: &'a [LoopRecord],
    /// Between samples of each record \[s\].
    pub steps_s: &'a [f64],
    pub coarse: &'a PulledTip,
    pub fine: &'a PulledTip,
    pub lumen: &'a Lumen<'a>,
    pub repeats: &'a Repeats,
}

impl Experiment for NoisyLoops<'_> {
    fn features(&self, values: &[f64], fine: bool) -> Option<Vec<f64>> {
        let values = TendonValues::of_array(values.try_into().ok()?);
        let rest = if fine { self.fine } else { self.coarse };
        let one = |(own, step_s): (&LoopRecord, &f64)| {
            let again = own.replayed(*step_s, &values, rest, self.lumen).ok()?;
            self.repeats.mean(&again.tip_m, |tip_m| again.features_of(tip_m))
        };
        let all: Option<Vec<[f64; 5]>> =
            self.records.par_iter().zip(self.steps_s).map(one).collect();
        Some(all?.concat())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_that_share_a_sample_become_independent() {
        let repeats = Repeats::new(0.1, 3, 1);
        // The first sample, and the others less it.
        let features = |own: &[f64]| Some([own[0], own[1] - own[0], own[2] - own[0]]);
        let record = [1.0, 2.0, 3.0];
        let own = repeats.triangle(&record, &[0.0; 3], features).unwrap();
        // The noise of each sample is 0.1: the determinant of the covariance is 10⁻⁶.
        assert!((own.determinant() / 1e-3 - 1.0).abs() < 0.3, "{own}");
        let white: Vec<Vec<f64>> = repeats
            .features(&record, features)
            .unwrap()
            .iter()
            .map(|each| whitened(each, std::slice::from_ref(&own)).unwrap())
            .collect();
        let mean = |k: usize| white.iter().map(|own| own[k]).sum::<f64>() / 100.0;
        let product = |a: usize, b: usize| {
            white.iter().map(|own| (own[a] - mean(a)) * (own[b] - mean(b))).sum::<f64>() / 99.0
        };
        assert!((product(1, 1) - 1.0).abs() < 1e-9 && product(0, 1).abs() < 1e-9);
        assert_eq!(whitened(&[1.0; 4], std::slice::from_ref(&own)), None);
    }

    #[test]
    fn the_largest_noisy_sample_lies_above_the_largest_true_one() {
        let repeats = Repeats::new(1.0, 20, 2);
        let largest = |own: &[f64]| Some([own.iter().copied().fold(f64::MIN, f64::max)]);
        // Of twenty normal numbers it is 1.87 in the mean.
        let [mean] = repeats.mean(&[5.0; 20], largest).unwrap();
        assert!((mean - 6.87).abs() < 0.2, "{mean}");
    }
}
