//! Several numbers that are computed with at a time.
//!
//! What no link has to wait for another for is computed for as many links at a time as the target
//! has lanes: one on the device, four `f32` on a host of the x86-64 kind. Every lane does the same
//! operations in the same order as one number would, so the bits are the same.

use crate::{Number, Real, Vector3};

/// Numbers side by side; every operation goes lane by lane.
pub trait Pack<T: Number>: Number {
    /// The number of each lane.
    fn each(of: impl FnMut(usize) -> T) -> Self;
    fn lane(self, lane: usize) -> T;
    /// The same number in each lane.
    #[inline(always)]
    fn all(value: T) -> Self {
        Self::each(|_| value)
    }
    /// The vector of each lane, side by side.
    fn vectors(of: impl FnMut(usize) -> Vector3<T>) -> Vector3<Self>;
    /// The other way round.
    fn apart(vectors: Vector3<Self>) -> Self::Lanes<Vector3<T>>;
    /// The nearest number to the integer of each lane.
    fn ints(of: impl FnMut(usize) -> i32) -> Self;
    /// The integer next to each number towards zero, not below 0 nor above `most`; 0 for NaN.
    fn clipped(self, most: i32) -> Self::Lanes<i32>;
}

/// As many `f32` as the target has lanes.
#[cfg(target_arch = "x86_64")]
pub type Pack32 = four::Four;
#[cfg(not(target_arch = "x86_64"))]
pub type Pack32 = f32;

/// One lane.
macro_rules! alone {
    ($number:ty) => {
        impl Pack<$number> for $number {
            #[inline(always)]
            fn each(mut of: impl FnMut(usize) -> $number) -> Self {
                of(0)
            }
            #[inline(always)]
            fn lane(self, _lane: usize) -> $number {
                self
            }
            #[inline(always)]
            fn vectors(mut of: impl FnMut(usize) -> Vector3<$number>) -> Vector3<Self> {
                of(0)
            }
            #[inline(always)]
            fn apart(vectors: Vector3<Self>) -> [Vector3<$number>; 1] {
                [vectors]
            }
            #[inline(always)]
            fn ints(mut of: impl FnMut(usize) -> i32) -> Self {
                <$number>::int(of(0))
            }
            #[inline(always)]
            fn clipped(self, most: i32) -> [i32; 1] {
                [self.truncated().max(0).min(most)]
            }
        }
    };
}
alone!(f32);
alone!(f64);

#[cfg(target_arch = "x86_64")]
mod four {
    use core::arch::x86_64::*;
    use core::ops::{Add, Div, Mul, Neg, Sub};

    use super::Pack;
    use crate::triple::packed::Packed;
    use crate::{Number, Plain, Vector3};

    /// In the four lanes of a register.
    #[derive(Clone, Copy, Debug)]
    pub struct Four(__m128);

    // SAFETY of all below: every x86-64 has SSE2, and none of these touches memory.
    impl Add for Four {
        type Output = Self;
        #[inline(always)]
        fn add(self, other: Self) -> Self {
            Self(unsafe { _mm_add_ps(self.0, other.0) })
        }
    }

    impl Sub for Four {
        type Output = Self;
        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            Self(unsafe { _mm_sub_ps(self.0, other.0) })
        }
    }

    impl Mul for Four {
        type Output = Self;
        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            Self(unsafe { _mm_mul_ps(self.0, other.0) })
        }
    }

    impl Div for Four {
        type Output = Self;
        #[inline(always)]
        fn div(self, other: Self) -> Self {
            Self(unsafe { _mm_div_ps(self.0, other.0) })
        }
    }

    impl Neg for Four {
        type Output = Self;
        #[inline(always)]
        fn neg(self) -> Self {
            Self(unsafe { _mm_xor_ps(self.0, _mm_set1_ps(-0.0)) })
        }
    }

    impl Number for Four {
        type Triple = Plain<Self>;
        const LANES: usize = 4;
        type Lanes<U> = [U; 4];

        #[inline(always)]
        fn lanes<U>(mut of: impl FnMut(usize) -> U) -> [U; 4] {
            [of(0), of(1), of(2), of(3)]
        }
        #[inline(always)]
        fn lit(value: f64) -> Self {
            Self(unsafe { _mm_set1_ps(value as f32) })
        }
        #[inline(always)]
        fn root(self) -> Self {
            Self(unsafe { _mm_sqrt_ps(self.0) })
        }
        #[inline(always)]
        fn larger(self, bound: Self) -> Self {
            Self(unsafe { _mm_max_ps(self.0, bound.0) })
        }
        #[inline(always)]
        fn smaller(self, bound: Self) -> Self {
            Self(unsafe { _mm_min_ps(self.0, bound.0) })
        }
        #[inline(always)]
        fn positive(self) -> Self {
            Self(unsafe { _mm_max_ps(self.0, _mm_setzero_ps()) })
        }
        #[inline(always)]
        fn sign(self) -> Self {
            Self(unsafe {
                let below = _mm_cmplt_ps(self.0, _mm_setzero_ps());
                _mm_or_ps(_mm_and_ps(below, _mm_set1_ps(-0.0)), _mm_set1_ps(1.0))
            })
        }
    }

    impl Pack<f32> for Four {
        #[inline(always)]
        fn each(of: impl FnMut(usize) -> f32) -> Self {
            let [a, b, c, d] = Self::lanes(of);
            Self(unsafe { _mm_setr_ps(a, b, c, d) })
        }
        #[inline(always)]
        fn lane(self, lane: usize) -> f32 {
            unsafe {
                _mm_cvtss_f32(match lane {
                    0 => self.0,
                    1 => _mm_shuffle_ps::<0b01_01_01_01>(self.0, self.0),
                    2 => _mm_movehl_ps(self.0, self.0),
                    _ => _mm_shuffle_ps::<0b11_11_11_11>(self.0, self.0),
                })
            }
        }
        #[inline(always)]
        fn vectors(of: impl FnMut(usize) -> Vector3<f32>) -> Vector3<Self> {
            let [a, b, c, d] = Self::lanes(of).map(|v| v.0.0);
            // x x y y and z z of two each.
            let (x, y, z) = unsafe {
                let (low, high) = (_mm_unpacklo_ps(a, b), _mm_unpacklo_ps(c, d));
                let rest = _mm_movelh_ps(_mm_unpackhi_ps(a, b), _mm_unpackhi_ps(c, d));
                (_mm_movelh_ps(low, high), _mm_movehl_ps(high, low), rest)
            };
            Vector3::new(Self(x), Self(y), Self(z))
        }
        #[inline(always)]
        fn apart(vectors: Vector3<Self>) -> [Vector3<f32>; 4] {
            let (x, y, z) = (vectors.x().0, vectors.y().0, vectors.z().0);
            let [a, b, c, d] = unsafe {
                let (low, high) = (_mm_unpacklo_ps(x, y), _mm_unpackhi_ps(x, y));
                [
                    _mm_shuffle_ps::<0b00_00_01_00>(low, z),
                    _mm_shuffle_ps::<0b01_01_11_10>(low, z),
                    _mm_shuffle_ps::<0b10_10_01_00>(high, z),
                    _mm_shuffle_ps::<0b11_11_11_10>(high, z),
                ]
            };
            [a, b, c, d].map(|v| Vector3(Packed(v)))
        }
        #[inline(always)]
        fn ints(of: impl FnMut(usize) -> i32) -> Self {
            let [a, b, c, d] = Self::lanes(of);
            Self(unsafe { _mm_cvtepi32_ps(_mm_setr_epi32(a, b, c, d)) })
        }
        #[inline(always)]
        fn clipped(self, most: i32) -> [i32; 4] {
            /// Above every integer that is asked for, below what does not fit.
            const HIGH: f32 = (1 << 30) as f32;
            debug_assert!(most <= 1 << 30);
            let ints = unsafe {
                let within = _mm_min_ps(_mm_max_ps(self.0, _mm_setzero_ps()), _mm_set1_ps(HIGH));
                let ints = _mm_cvttps_epi32(within);
                [
                    _mm_cvtsi128_si32(ints),
                    _mm_cvtsi128_si32(_mm_shuffle_epi32::<0b01>(ints)),
                    _mm_cvtsi128_si32(_mm_shuffle_epi32::<0b10>(ints)),
                    _mm_cvtsi128_si32(_mm_shuffle_epi32::<0b11>(ints)),
                ]
            };
            ints.map(|int| int.min(most))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const VALUES: [f32; 12] = [
        0.0,
        -0.0,
        1.0,
        -1.0e-3,
        0.1,
        3.3e7,
        -2.5e9,
        1.0e-40,
        7.0e-23,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
    ];

    type Side = <f32 as Real>::Pack;

    /// The same bits, or no number both.
    fn same(a: f32, b: f32) -> bool {
        a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
    }

    /// Every operation; the bound of the last two is a number other than 0.
    fn all<N: Number>(a: N, b: N, bound: N) -> [N; 10] {
        let sum = [a + b, a - b, a * b, a / b, -a];
        let rest = [a.root(), a.positive(), a.sign(), a.larger(bound), a.smaller(bound)];
        [sum[0], sum[1], sum[2], sum[3], sum[4], rest[0], rest[1], rest[2], rest[3], rest[4]]
    }

    #[test]
    fn side_by_side_has_the_bits_of_one_alone() {
        let n = VALUES.len();
        for k in 0..n * n {
            let a = |lane: usize| VALUES[(k + lane) % n];
            let b = |lane: usize| VALUES[(k / n + 5 * lane) % n];
            let bound = |lane: usize| [0.3, -7.1e5, 1.7e-20, 4.0][lane % 4];
            let each = |of: &dyn Fn(usize) -> f32| Side::each(of);
            let found = all(each(&a), each(&b), each(&bound));
            for lane in 0..Side::LANES {
                let alone = all(a(lane), b(lane), bound(lane));
                for (found, alone) in found.iter().zip(alone) {
                    let found = found.lane(lane);
                    assert!(same(found, alone), "{} {}: {found} {alone}", a(lane), b(lane));
                }
            }
        }
    }

    #[test]
    fn integers_are_cut_off_and_clipped_alike() {
        for most in [0, 7, 1 << 27] {
            for k in 0..VALUES.len() {
                let value = |lane: usize| VALUES[(k + lane) % VALUES.len()] * 1.7;
                let found = Side::each(value).clipped(most);
                for (lane, found) in found.into_iter().enumerate() {
                    assert_eq!(found, value(lane).clipped(most)[0], "{}", value(lane));
                }
            }
        }
        let int = |lane: usize| [i32::MIN, -3, 16_777_217, i32::MAX][lane];
        for lane in 0..Side::LANES {
            assert_eq!(Side::ints(int).lane(lane), int(lane) as f32);
        }
    }

    #[test]
    fn vectors_come_apart_as_they_were() {
        let vector = |lane: usize| Vector3::new(1.0, 2.0, 3.0) * (1.0 + lane as f32);
        let side_by_side = Side::vectors(vector);
        let apart = Side::apart(side_by_side);
        for (lane, apart) in apart.into_iter().enumerate() {
            assert_eq!(apart, vector(lane));
            assert_eq!(side_by_side.y().lane(lane), vector(lane).y());
            assert_eq!(Side::all(0.7).lane(lane), 0.7);
        }
    }
}
