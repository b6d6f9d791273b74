//! Several numbers that are computed with at a time.
//!
//! What no link has to wait for another for is computed for as many links at a time as the target
//! has lanes: one on the device, four `f32` or two `f64` on a host of the x86-64 kind. Every lane does the same
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
pub type Pack32 = lanes::Four;
#[cfg(not(target_arch = "x86_64"))]
pub type Pack32 = f32;

/// As many `f64` as the target has lanes.
#[cfg(target_arch = "x86_64")]
pub type Pack64 = lanes::Two;
#[cfg(not(target_arch = "x86_64"))]
pub type Pack64 = f64;

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
mod lanes {
    use core::arch::x86_64::*;
    use core::ops::{Add, Div, Mul, Neg, Sub};

    use super::Pack;
    use crate::triple::packed::Packed;
    use crate::{Number, Plain, Vector3};

    /// An operator that one instruction has.
    macro_rules! operator {
        ($name:ident: $operator:ident $method:ident $instruction:ident) => {
            impl $operator for $name {
                type Output = Self;
                #[inline(always)]
                fn $method(self, other: Self) -> Self {
                    Self(unsafe { $instruction(self.0, other.0) })
                }
            }
        };
    }

    // SAFETY of all below: every x86-64 has SSE2, and none of these touches memory.
    macro_rules! number {
        (
            $(#[$doc:meta])* $name:ident $register:ident: $number:ident, $lanes:literal, [$($lane:literal),*];
            $add:ident $sub:ident $mul:ident $div:ident $all:ident $zero:ident;
            $root:ident $max:ident $min:ident $less:ident $and:ident $or:ident $xor:ident
        ) => {
            $(#[$doc])*
            #[derive(Clone, Copy, Debug)]
            pub struct $name($register);

            operator!($name: Add add $add);
            operator!($name: Sub sub $sub);
            operator!($name: Mul mul $mul);
            operator!($name: Div div $div);

            impl Neg for $name {
                type Output = Self;
                #[inline(always)]
                fn neg(self) -> Self {
                    Self(unsafe { $xor(self.0, $all(-0.0)) })
                }
            }

            impl Number for $name {
                type Triple = Plain<Self>;
                const LANES: usize = $lanes;
                type Lanes<U> = [U; $lanes];

                #[inline(always)]
                fn lanes<U>(mut of: impl FnMut(usize) -> U) -> [U; $lanes] {
                    [$(of($lane)),*]
                }
                #[inline(always)]
                fn lit(value: f64) -> Self {
                    Self(unsafe { $all(value as $number) })
                }
                #[inline(always)]
                fn root(self) -> Self {
                    Self(unsafe { $root(self.0) })
                }
                #[inline(always)]
                fn larger(self, bound: Self) -> Self {
                    Self(unsafe { $max(self.0, bound.0) })
                }
                #[inline(always)]
                fn smaller(self, bound: Self) -> Self {
                    Self(unsafe { $min(self.0, bound.0) })
                }
                #[inline(always)]
                fn positive(self) -> Self {
                    Self(unsafe { $max(self.0, $zero()) })
                }
                #[inline(always)]
                fn sign(self) -> Self {
                    Self(unsafe {
                        let below = $less(self.0, $zero());
                        $or($and(below, $all(-0.0)), $all(1.0))
                    })
                }
            }
        };
    }

    number! {
        /// In the four lanes of a register.
        Four __m128: f32, 4, [0, 1, 2, 3];
        _mm_add_ps _mm_sub_ps _mm_mul_ps _mm_div_ps _mm_set1_ps _mm_setzero_ps;
        _mm_sqrt_ps _mm_max_ps _mm_min_ps _mm_cmplt_ps _mm_and_ps _mm_or_ps _mm_xor_ps
    }

    number! {
        /// In the two lanes of a register.
        Two __m128d: f64, 2, [0, 1];
        _mm_add_pd _mm_sub_pd _mm_mul_pd _mm_div_pd _mm_set1_pd _mm_setzero_pd;
        _mm_sqrt_pd _mm_max_pd _mm_min_pd _mm_cmplt_pd _mm_and_pd _mm_or_pd _mm_xor_pd
    }

    /// Above every integer that is asked for, below what does not fit.
    const HIGH: i32 = 1 << 30;

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
            debug_assert!(most <= HIGH);
            let ints = unsafe {
                let high = _mm_set1_ps(HIGH as f32);
                let within = _mm_min_ps(_mm_max_ps(self.0, _mm_setzero_ps()), high);
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

    impl Pack<f64> for Two {
        #[inline(always)]
        fn each(of: impl FnMut(usize) -> f64) -> Self {
            let [a, b] = Self::lanes(of);
            Self(unsafe { _mm_setr_pd(a, b) })
        }
        #[inline(always)]
        fn lane(self, lane: usize) -> f64 {
            unsafe {
                _mm_cvtsd_f64(if lane == 0 { self.0 } else { _mm_unpackhi_pd(self.0, self.0) })
            }
        }
        #[inline(always)]
        fn vectors(of: impl FnMut(usize) -> Vector3<f64>) -> Vector3<Self> {
            let [a, b] = Self::lanes(of);
            let side = |of: fn(&Vector3<f64>) -> f64| Self(unsafe { _mm_setr_pd(of(&a), of(&b)) });
            Vector3::new(side(Vector3::x), side(Vector3::y), side(Vector3::z))
        }
        #[inline(always)]
        fn apart(vectors: Vector3<Self>) -> [Vector3<f64>; 2] {
            let (x, y, z) = (vectors.x(), vectors.y(), vectors.z());
            Self::lanes(|lane| Vector3::new(x.lane(lane), y.lane(lane), z.lane(lane)))
        }
        #[inline(always)]
        fn ints(mut of: impl FnMut(usize) -> i32) -> Self {
            Self::each(|lane| f64::from(of(lane)))
        }
        #[inline(always)]
        fn clipped(self, most: i32) -> [i32; 2] {
            debug_assert!(most <= HIGH);
            let ints = unsafe {
                let high = _mm_set1_pd(f64::from(HIGH));
                let within = _mm_min_pd(_mm_max_pd(self.0, _mm_setzero_pd()), high);
                let ints = _mm_cvttpd_epi32(within);
                [_mm_cvtsi128_si32(ints), _mm_cvtsi128_si32(_mm_shuffle_epi32::<0b01>(ints))]
            };
            ints.map(|int| int.min(most))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const VALUES: [f64; 12] = [
        0.0,
        -0.0,
        1.0,
        -1.0e-3,
        0.1,
        3.3e7,
        -2.5e9,
        1.0e-40,
        7.0e-23,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::NAN,
    ];

    /// The same bits, or no number both.
    fn same<T: Real>(a: T, b: T) -> bool {
        let bits = |x: T| x.to_f64().to_bits();
        bits(a) == bits(b) || (a.to_f64().is_nan() && b.to_f64().is_nan())
    }

    /// Every operation; the bound of the last two is a number other than 0.
    fn all<N: Number>(a: N, b: N, bound: N) -> [N; 10] {
        let sum = [a + b, a - b, a * b, a / b, -a];
        let rest = [a.root(), a.positive(), a.sign(), a.larger(bound), a.smaller(bound)];
        [sum[0], sum[1], sum[2], sum[3], sum[4], rest[0], rest[1], rest[2], rest[3], rest[4]]
    }

    fn has_the_bits_of_one_alone<T: Real>() {
        let n = VALUES.len();
        for k in 0..n * n {
            let a = |lane: usize| T::lit(VALUES[(k + lane) % n]);
            let b = |lane: usize| T::lit(VALUES[(k / n + 5 * lane) % n]);
            let bound = |lane: usize| T::lit([0.3, -7.1e5, 1.7e-20, 4.0][lane % 4]);
            let each = |of: &dyn Fn(usize) -> T| T::Pack::each(of);
            let found = all(each(&a), each(&b), each(&bound));
            for lane in 0..T::Pack::LANES {
                let alone = all(a(lane), b(lane), bound(lane));
                for (found, alone) in found.iter().zip(alone) {
                    let found = found.lane(lane);
                    assert!(same(found, alone), "{} {}: {found} {alone}", a(lane), b(lane));
                }
            }
        }
    }

    #[test]
    fn side_by_side_has_the_bits_of_one_alone() {
        has_the_bits_of_one_alone::<f32>();
        has_the_bits_of_one_alone::<f64>();
    }

    fn integers_are_cut_off<T: Real>() {
        for most in [0, 7, 1 << 27] {
            for k in 0..VALUES.len() {
                let value = |lane: usize| T::lit(VALUES[(k + lane) % VALUES.len()] * 1.7);
                let found = T::Pack::each(value).clipped(most);
                for lane in 0..T::Pack::LANES {
                    let alone = value(lane).truncated().max(0).min(most);
                    assert_eq!(found[lane], alone, "{}", value(lane));
                }
            }
        }
        let int = |lane: usize| [i32::MIN, 16_777_217, -3, i32::MAX][lane];
        for lane in 0..T::Pack::LANES {
            assert_eq!(T::Pack::ints(int).lane(lane), T::int(int(lane)));
        }
    }

    #[test]
    fn integers_are_cut_off_and_clipped_alike() {
        integers_are_cut_off::<f32>();
        integers_are_cut_off::<f64>();
    }

    fn vectors_come_apart<T: Real>() {
        let vector = |lane: usize| {
            Vector3::new(T::lit(1.0), T::lit(2.0), T::lit(3.0)) * T::int(lane as i32 + 1)
        };
        let side_by_side = T::Pack::vectors(vector);
        let apart = T::Pack::apart(side_by_side);
        for lane in 0..T::Pack::LANES {
            assert_eq!(apart[lane], vector(lane));
            assert_eq!(side_by_side.y().lane(lane), vector(lane).y());
            assert_eq!(T::Pack::all(T::lit(0.7)).lane(lane), T::lit(0.7));
        }
    }

    #[test]
    fn vectors_come_apart_as_they_were() {
        vectors_come_apart::<f32>();
        vectors_come_apart::<f64>();
    }
}
