//! Discrete wavelet transform with orthonormal, compactly supported wavelets (Daubechies 1992).
//!
//! One level splits a signal x of an even number of values, continued periodically, into averages a
//! and details d,
//!
//! > a_k = Σ_m h_m x_{2k+m},   d_k = Σ_m g_m x_{2k+m},   g_m = (−1)^m h_{L−1−m}
//!
//! and is undone by its transpose. A signal of any length is first mirrored at its ends, far enough
//! that what is continued periodically does not reach it.

use serde::Serialize;

/// An orthonormal wavelet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Family {
    /// One vanishing moment: steps.
    Haar,
    /// Daubechies' wavelet of extremal phase, four vanishing moments.
    Db4,
    /// Daubechies' least asymmetric wavelet, four vanishing moments.
    Sym4,
}

/// h of each family, from Daubechies 1992, tables 6.1 and 6.3, to double precision. The tests of this
/// file hold them to orthonormality and vanishing moments, which define them.
const HAAR: [f64; 2] = [std::f64::consts::FRAC_1_SQRT_2; 2];
const DB4: [f64; 8] = [
    0.230_377_813_308_855_23,
    0.714_846_570_552_541_5,
    0.630_880_767_929_590_4,
    -0.027_983_769_416_983_85,
    -0.187_034_811_718_881_14,
    0.030_841_381_835_986_965,
    0.032_883_011_666_982_945,
    -0.010_597_401_784_997_278,
];
const SYM4: [f64; 8] = [
    0.032_223_100_604_042_7,
    -0.012_603_967_262_037_833,
    -0.099_219_543_576_847_22,
    0.297_857_795_605_277_36,
    0.803_738_751_805_916_1,
    0.497_618_667_632_015_45,
    -0.029_635_527_645_998_51,
    -0.075_765_714_789_273_33,
];

impl Family {
    /// h, the filter of the averages.
    pub fn filter(self) -> &'static [f64] {
        match self {
            Self::Haar => &HAAR,
            Self::Db4 => &DB4,
            Self::Sym4 => &SYM4,
        }
    }

    /// Its name in options and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Haar => "haar",
            Self::Db4 => "db4",
            Self::Sym4 => "sym4",
        }
    }
}

/// A transformed signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Transform {
    family: Family,
    /// The averages that are left after the last level.
    averages: Vec<f64>,
    /// Of each level, the finest one first.
    pub details: Vec<Vec<f64>>,
    /// Mirrored values before the signal.
    before: usize,
    len: usize,
}

impl Transform {
    /// Transforms a signal on so many levels. An empty signal has no levels.
    pub fn of(values: &[f64], family: Family, levels: usize) -> Self {
        let h = family.filter();
        let levels = if values.is_empty() { 0 } else { levels };
        // A value of the coarsest level depends on so many neighbours.
        let before = (h.len() - 1) * ((1 << levels) - 1);
        let whole = (values.len() + 2 * before).next_multiple_of(1 << levels);
        let mirrored = |i: usize| values[reflected(i as isize - before as isize, values.len())];
        let mut averages: Vec<f64> =
            if values.is_empty() { Vec::new() } else { (0..whole).map(mirrored).collect() };
        let mut details = Vec::new();
        for _ in 0..levels {
            let (next, detail) = split(&averages, h);
            averages = next;
            details.push(detail);
        }
        Self { family, averages, details, before, len: values.len() }
    }

    /// The signal of these coefficients.
    pub fn inverse(&self) -> Vec<f64> {
        let h = self.family.filter();
        let joined = self.details.iter().rev().fold(self.averages.clone(), |averages, detail| {
            let mut joined = vec![0.0; 2 * averages.len()];
            for (k, (a, d)) in averages.iter().zip(detail).enumerate() {
                for m in 0..h.len() {
                    joined[(2 * k + m) % (2 * averages.len())] += h[m] * a + g(h, m) * d;
                }
            }
            joined
        });
        joined[self.before..self.before + self.len].to_vec()
    }

    /// The details of the finest level that belong to the signal, not to what was mirrored.
    pub fn finest(&self) -> &[f64] {
        let Some(finest) = self.details.first() else { return &[] };
        &finest[self.before / 2..(self.before + self.len).div_ceil(2)]
    }
}

/// g of the details.
fn g(h: &[f64], m: usize) -> f64 {
    let mirrored = h[h.len() - 1 - m];
    if m.is_multiple_of(2) { mirrored } else { -mirrored }
}

/// Averages and details of one level.
fn split(x: &[f64], h: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let n = x.len();
    let at = |k: usize| {
        (0..h.len()).fold((0.0, 0.0), |(a, d), m| {
            let value = x[(2 * k + m) % n];
            (a + h[m] * value, d + g(h, m) * value)
        })
    };
    (0..n / 2).map(at).unzip()
}

/// The index that mirroring at both ends leads to; each end counts twice.
fn reflected(i: isize, len: usize) -> usize {
    let period = 2 * len as isize;
    let i = i.rem_euclid(period);
    (if i < len as isize { i } else { period - 1 - i }) as usize
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    const ALL: [Family; 3] = [Family::Haar, Family::Db4, Family::Sym4];

    #[test]
    fn filters_are_orthonormal_and_details_of_polynomials_vanish() {
        for family in ALL {
            let h = family.filter();
            for shift in 0..h.len() / 2 {
                let product: f64 = h.iter().zip(&h[2 * shift..]).map(|(a, b)| a * b).sum();
                let expected = if shift == 0 { 1.0 } else { 0.0 };
                assert!((product - expected).abs() < 1e-11, "{family:?} {shift}: {product}");
            }
            assert!((h.iter().sum::<f64>() - 2.0_f64.sqrt()).abs() < 1e-11, "{family:?}");
            for moment in 0..h.len() as i32 / 2 {
                let sum: f64 = (0..h.len()).map(|m| g(h, m) * (m as f64).powi(moment)).sum();
                assert!(sum.abs() < 1e-8, "{family:?}, moment {moment}: {sum}");
            }
        }
    }

    #[test]
    fn a_least_asymmetric_filter_is_more_symmetric_than_the_other() {
        let asymmetry = |family: Family| {
            let h = family.filter();
            let centre: f64 = h.iter().enumerate().map(|(m, x)| m as f64 * x * x).sum();
            let skew = h.iter().enumerate().map(|(m, x)| (m as f64 - centre).powi(3) * x * x);
            skew.sum::<f64>().abs()
        };
        assert!(asymmetry(Family::Sym4) < asymmetry(Family::Db4));
    }

    #[test]
    fn every_signal_is_reconstructed() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for family in ALL {
            for len in [1, 2, 3, 7, 64, 101] {
                for levels in [0, 1, 3, 5] {
                    let signal: Vec<f64> = (0..len).map(|_| rng.random_range(-1.0..1.0)).collect();
                    let back = Transform::of(&signal, family, levels).inverse();
                    for (a, b) in signal.iter().zip(&back) {
                        assert!((a - b).abs() < 1e-10, "{family:?}, {len} values, {levels} levels");
                    }
                    assert_eq!(back.len(), len);
                }
            }
        }
        assert!(Transform::of(&[], Family::Sym4, 3).inverse().is_empty());
    }

    #[test]
    fn haar_of_four_values_is_that_of_a_calculation_by_hand() {
        let root = 2.0_f64.sqrt();
        let (averages, details) = split(&[1.0, 3.0, 2.0, 8.0], &HAAR);
        for (found, expected) in averages.iter().zip([4.0 / root, 10.0 / root]) {
            assert!((found - expected).abs() < 1e-12);
        }
        for (found, expected) in details.iter().zip([-2.0 / root, -6.0 / root]) {
            assert!((found - expected).abs() < 1e-12);
        }
        assert_eq!([-2, -1, 0, 2, 3, 4, 5, 6].map(|i| reflected(i, 3)), [1, 0, 0, 2, 2, 1, 0, 0]);
    }
}
