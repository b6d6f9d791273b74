//! Packs in the registers of an x86-64 processor.

use core::arch::x86_64::*;
use core::ops::{Add, Div, Mul, Neg, Sub};

use crate::storage::simd::SimdStorage;
use crate::{Gather, Kernel, Number, Pack, PlainPack, ScalarStorage, Vector3};

/// Runs a kernel with the wider pack if the processor has AVX2.
#[inline(always)]
pub(crate) fn run_vectorised<T: Number, N: PlainPack<T>, Wide: PlainPack<T>, W: Kernel<T>>(
    work: W,
) -> W::Output {
    #[target_feature(enable = "avx2")]
    fn wide<T: Number, Wide: PlainPack<T>, W: Kernel<T>>(work: W) -> W::Output {
        work.run::<Wide>()
    }
    if std::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        unsafe { wide::<T, Wide, W>(work) }
    } else {
        work.run::<N>()
    }
}

/// Implements an operator by one instruction.
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

// SAFETY of all below: every x86-64 has SSE2. Packs of 256 bits are only used after `run_vectorised` has
// detected AVX2. None of these instructions accesses memory.
macro_rules! number {
    (
        $(#[$doc:meta])* $name:ident $register:ident: $number:ident, $lanes:literal, [$($lane:literal),*];
        $add:ident $sub:ident $mul:ident $div:ident $all:ident $zero:ident;
        $root:ident $max:ident $min:ident $less:ident $and:ident $or:ident $xor:ident;
        $below:ident $reaches:ident $choose:ident $bits:ident
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
            type Storage3 = ScalarStorage<Self>;
            const LANES: usize = $lanes;
            type Lanes<U> = [U; $lanes];

            #[inline(always)]
            fn per_lane<U>(mut of: impl FnMut(usize) -> U) -> [U; $lanes] {
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

            type Mask = $register;
            #[inline(always)]
            fn below(self, bound: Self) -> $register {
                $below(self.0, bound.0)
            }
            #[inline(always)]
            fn reaches(self, bound: Self) -> $register {
                $reaches(self.0, bound.0)
            }
            #[inline(always)]
            fn choose(mask: $register, yes: Self, no: Self) -> Self {
                Self($choose(mask, yes.0, no.0))
            }
            #[inline(always)]
            fn all(mask: $register) -> bool {
                unsafe { $bits(mask) == (1 << $lanes) - 1 }
            }
            #[inline(always)]
            fn any(mask: $register) -> bool {
                unsafe { $bits(mask) != 0 }
            }
        }
    };
}

#[inline(always)]
fn below_4(a: __m128, b: __m128) -> __m128 {
    unsafe { _mm_cmplt_ps(a, b) }
}
#[inline(always)]
fn reaches_4(a: __m128, b: __m128) -> __m128 {
    unsafe { _mm_cmpge_ps(a, b) }
}
#[inline(always)]
fn choose_4(mask: __m128, yes: __m128, no: __m128) -> __m128 {
    unsafe { _mm_or_ps(_mm_and_ps(mask, yes), _mm_andnot_ps(mask, no)) }
}
#[inline(always)]
fn below_2(a: __m128d, b: __m128d) -> __m128d {
    unsafe { _mm_cmplt_pd(a, b) }
}
#[inline(always)]
fn reaches_2(a: __m128d, b: __m128d) -> __m128d {
    unsafe { _mm_cmpge_pd(a, b) }
}
#[inline(always)]
fn choose_2(mask: __m128d, yes: __m128d, no: __m128d) -> __m128d {
    unsafe { _mm_or_pd(_mm_and_pd(mask, yes), _mm_andnot_pd(mask, no)) }
}

number! {
    /// Four `f32` in a register.
    F32x4 __m128: f32, 4, [0, 1, 2, 3];
    _mm_add_ps _mm_sub_ps _mm_mul_ps _mm_div_ps _mm_set1_ps _mm_setzero_ps;
    _mm_sqrt_ps _mm_max_ps _mm_min_ps _mm_cmplt_ps _mm_and_ps _mm_or_ps _mm_xor_ps;
    below_4 reaches_4 choose_4 _mm_movemask_ps
}

number! {
    /// Two `f64` in a register.
    F64x2 __m128d: f64, 2, [0, 1];
    _mm_add_pd _mm_sub_pd _mm_mul_pd _mm_div_pd _mm_set1_pd _mm_setzero_pd;
    _mm_sqrt_pd _mm_max_pd _mm_min_pd _mm_cmplt_pd _mm_and_pd _mm_or_pd _mm_xor_pd;
    below_2 reaches_2 choose_2 _mm_movemask_pd
}

#[inline(always)]
fn less_ps(a: __m256, b: __m256) -> __m256 {
    unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(a, b) }
}
#[inline(always)]
fn less_pd(a: __m256d, b: __m256d) -> __m256d {
    unsafe { _mm256_cmp_pd::<_CMP_LT_OQ>(a, b) }
}

#[inline(always)]
fn reaches_ps(a: __m256, b: __m256) -> __m256 {
    unsafe { _mm256_cmp_ps::<_CMP_GE_OQ>(a, b) }
}
#[inline(always)]
fn reaches_pd(a: __m256d, b: __m256d) -> __m256d {
    unsafe { _mm256_cmp_pd::<_CMP_GE_OQ>(a, b) }
}
#[inline(always)]
fn choose_ps(mask: __m256, yes: __m256, no: __m256) -> __m256 {
    unsafe { _mm256_blendv_ps(no, yes, mask) }
}
#[inline(always)]
fn choose_pd(mask: __m256d, yes: __m256d, no: __m256d) -> __m256d {
    unsafe { _mm256_blendv_pd(no, yes, mask) }
}

number! {
    /// Eight `f32` in a register.
    F32x8 __m256: f32, 8, [0, 1, 2, 3, 4, 5, 6, 7];
    _mm256_add_ps _mm256_sub_ps _mm256_mul_ps _mm256_div_ps _mm256_set1_ps _mm256_setzero_ps;
    _mm256_sqrt_ps _mm256_max_ps _mm256_min_ps less_ps _mm256_and_ps _mm256_or_ps _mm256_xor_ps;
    less_ps reaches_ps choose_ps _mm256_movemask_ps
}

number! {
    /// Four `f64` in a register.
    F64x4 __m256d: f64, 4, [0, 1, 2, 3];
    _mm256_add_pd _mm256_sub_pd _mm256_mul_pd _mm256_div_pd _mm256_set1_pd _mm256_setzero_pd;
    _mm256_sqrt_pd _mm256_max_pd _mm256_min_pd less_pd _mm256_and_pd _mm256_or_pd _mm256_xor_pd;
    less_pd reaches_pd choose_pd _mm256_movemask_pd
}

/// Upper bound before conversion: above every `most`, and within the range of `i32`.
const HIGH: i32 = 1 << 30;

impl Gather<f32> for F32x4 {
    #[inline(always)]
    fn from_lanes(of: impl FnMut(usize) -> f32) -> Self {
        let [a, b, c, d] = Self::per_lane(of);
        Self(unsafe { _mm_setr_ps(a, b, c, d) })
    }
    #[inline(always)]
    fn gather_vectors(of: impl FnMut(usize) -> Vector3<f32>) -> Vector3<Self> {
        let [a, b, c, d] = Self::per_lane(of).map(|v| v.0.0);
        // x x y y and z z of two vectors each.
        let (x, y, z) = unsafe {
            let (low, high) = (_mm_unpacklo_ps(a, b), _mm_unpacklo_ps(c, d));
            let rest = _mm_movelh_ps(_mm_unpackhi_ps(a, b), _mm_unpackhi_ps(c, d));
            (_mm_movelh_ps(low, high), _mm_movehl_ps(high, low), rest)
        };
        Vector3::new(Self(x), Self(y), Self(z))
    }
}

impl Pack<f32> for F32x4 {
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
    fn split_vectors(vectors: Vector3<Self>) -> [Vector3<f32>; 4] {
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
        [a, b, c, d].map(|v| Vector3(SimdStorage(v)))
    }
}

impl PlainPack<f32> for F32x4 {
    #[inline(always)]
    fn from_ints(of: impl FnMut(usize) -> i32) -> Self {
        let [a, b, c, d] = Self::per_lane(of);
        Self(unsafe { _mm_cvtepi32_ps(_mm_setr_epi32(a, b, c, d)) })
    }
    #[inline(always)]
    fn to_clamped_ints(self, most: i32) -> [i32; 4] {
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
    #[inline(always)]
    fn numbers(self) -> [f32; 4] {
        // SAFETY: both are 4 `f32`.
        unsafe { core::mem::transmute(self.0) }
    }
}

impl Gather<f64> for F64x2 {
    #[inline(always)]
    fn from_lanes(of: impl FnMut(usize) -> f64) -> Self {
        let [a, b] = Self::per_lane(of);
        Self(unsafe { _mm_setr_pd(a, b) })
    }
    #[inline(always)]
    fn gather_vectors(of: impl FnMut(usize) -> Vector3<f64>) -> Vector3<Self> {
        let [a, b] = Self::per_lane(of);
        let side = |of: fn(&Vector3<f64>) -> f64| Self(unsafe { _mm_setr_pd(of(&a), of(&b)) });
        Vector3::new(side(Vector3::x), side(Vector3::y), side(Vector3::z))
    }
}

impl Pack<f64> for F64x2 {
    #[inline(always)]
    fn lane(self, lane: usize) -> f64 {
        unsafe { _mm_cvtsd_f64(if lane == 0 { self.0 } else { _mm_unpackhi_pd(self.0, self.0) }) }
    }
    #[inline(always)]
    fn split_vectors(vectors: Vector3<Self>) -> [Vector3<f64>; 2] {
        let (x, y, z) = (vectors.x(), vectors.y(), vectors.z());
        Self::per_lane(|lane| Vector3::new(x.lane(lane), y.lane(lane), z.lane(lane)))
    }
}

impl PlainPack<f64> for F64x2 {
    #[inline(always)]
    fn from_ints(mut of: impl FnMut(usize) -> i32) -> Self {
        Self::from_lanes(|lane| f64::from(of(lane)))
    }
    #[inline(always)]
    fn to_clamped_ints(self, most: i32) -> [i32; 2] {
        debug_assert!(most <= HIGH);
        let ints = unsafe {
            let high = _mm_set1_pd(f64::from(HIGH));
            let within = _mm_min_pd(_mm_max_pd(self.0, _mm_setzero_pd()), high);
            let ints = _mm_cvttpd_epi32(within);
            [_mm_cvtsi128_si32(ints), _mm_cvtsi128_si32(_mm_shuffle_epi32::<0b01>(ints))]
        };
        ints.map(|int| int.min(most))
    }
    #[inline(always)]
    fn numbers(self) -> [f64; 2] {
        // SAFETY: both are 2 `f64`.
        unsafe { core::mem::transmute(self.0) }
    }
}

impl F32x8 {
    /// The lower or the upper four lanes.
    #[inline(always)]
    fn half(self, which: usize) -> F32x4 {
        F32x4(unsafe {
            if which == 0 {
                _mm256_castps256_ps128(self.0)
            } else {
                _mm256_extractf128_ps::<1>(self.0)
            }
        })
    }
}

impl Gather<f32> for F32x8 {
    #[inline(always)]
    fn from_lanes(of: impl FnMut(usize) -> f32) -> Self {
        let [a, b, c, d, e, f, g, h] = Self::per_lane(of);
        Self(unsafe { _mm256_setr_ps(a, b, c, d, e, f, g, h) })
    }
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self(unsafe { _mm256_set1_ps(value) })
    }
    #[inline(always)]
    fn gather_vectors(of: impl FnMut(usize) -> Vector3<f32>) -> Vector3<Self> {
        let v = Self::per_lane(of).map(|v| v.0.0);
        let (x, y, z) = unsafe {
            let [a, b, c, d] = [(v[0], v[4]), (v[1], v[5]), (v[2], v[6]), (v[3], v[7])]
                .map(|(low, high)| _mm256_set_m128(high, low));
            // x x y y and z z of two vectors each, in each half.
            let (low, high) = (_mm256_unpacklo_ps(a, b), _mm256_unpacklo_ps(c, d));
            let (rest, rest_high) = (_mm256_unpackhi_ps(a, b), _mm256_unpackhi_ps(c, d));
            (
                _mm256_shuffle_ps::<0b01_00_01_00>(low, high),
                _mm256_shuffle_ps::<0b11_10_11_10>(low, high),
                _mm256_shuffle_ps::<0b01_00_01_00>(rest, rest_high),
            )
        };
        Vector3::new(Self(x), Self(y), Self(z))
    }
}

impl Pack<f32> for F32x8 {
    #[inline(always)]
    fn lane(self, lane: usize) -> f32 {
        self.half(lane / 4).lane(lane % 4)
    }
    #[inline(always)]
    fn split_vectors(vectors: Vector3<Self>) -> [Vector3<f32>; 8] {
        let (x, y, z) = (vectors.x().0, vectors.y().0, vectors.z().0);
        // Lanes 0 and 4, 1 and 5, 2 and 6, 3 and 7.
        let two = unsafe {
            let (low, high) = (_mm256_unpacklo_ps(x, y), _mm256_unpackhi_ps(x, y));
            [
                _mm256_shuffle_ps::<0b00_00_01_00>(low, z),
                _mm256_shuffle_ps::<0b01_01_11_10>(low, z),
                _mm256_shuffle_ps::<0b10_10_01_00>(high, z),
                _mm256_shuffle_ps::<0b11_11_11_10>(high, z),
            ]
        };
        Self::per_lane(|lane| Vector3(SimdStorage(Self(two[lane % 4]).half(lane / 4).0)))
    }
}

impl PlainPack<f32> for F32x8 {
    #[inline(always)]
    fn from_ints(of: impl FnMut(usize) -> i32) -> Self {
        let [a, b, c, d, e, f, g, h] = Self::per_lane(of);
        Self(unsafe { _mm256_cvtepi32_ps(_mm256_setr_epi32(a, b, c, d, e, f, g, h)) })
    }
    #[inline(always)]
    fn to_clamped_ints(self, most: i32) -> [i32; 8] {
        debug_assert!(most <= HIGH);
        unsafe {
            let high = _mm256_set1_ps(HIGH as f32);
            let within = _mm256_min_ps(_mm256_max_ps(self.0, _mm256_setzero_ps()), high);
            let ints = _mm256_cvttps_epi32(within);
            core::mem::transmute(_mm256_min_epi32(ints, _mm256_set1_epi32(most)))
        }
    }
    #[inline(always)]
    fn numbers(self) -> [f32; 8] {
        // SAFETY: both are 8 `f32`.
        unsafe { core::mem::transmute(self.0) }
    }
}

impl F64x4 {
    /// The lower or the upper two lanes.
    #[inline(always)]
    fn half(self, which: usize) -> F64x2 {
        F64x2(unsafe {
            if which == 0 {
                _mm256_castpd256_pd128(self.0)
            } else {
                _mm256_extractf128_pd::<1>(self.0)
            }
        })
    }
}

impl Gather<f64> for F64x4 {
    #[inline(always)]
    fn from_lanes(of: impl FnMut(usize) -> f64) -> Self {
        let [a, b, c, d] = Self::per_lane(of);
        Self(unsafe { _mm256_setr_pd(a, b, c, d) })
    }
    #[inline(always)]
    fn gather_vectors(of: impl FnMut(usize) -> Vector3<f64>) -> Vector3<Self> {
        let [a, b, c, d] = Self::per_lane(of);
        let side = |of: fn(&Vector3<f64>) -> f64| {
            Self(unsafe { _mm256_setr_pd(of(&a), of(&b), of(&c), of(&d)) })
        };
        Vector3::new(side(Vector3::x), side(Vector3::y), side(Vector3::z))
    }
}

impl Pack<f64> for F64x4 {
    #[inline(always)]
    fn lane(self, lane: usize) -> f64 {
        self.half(lane / 2).lane(lane % 2)
    }
    #[inline(always)]
    fn split_vectors(vectors: Vector3<Self>) -> [Vector3<f64>; 4] {
        let (x, y, z) = (vectors.x(), vectors.y(), vectors.z());
        Self::per_lane(|lane| Vector3::new(x.lane(lane), y.lane(lane), z.lane(lane)))
    }
}

impl PlainPack<f64> for F64x4 {
    #[inline(always)]
    fn from_ints(of: impl FnMut(usize) -> i32) -> Self {
        let [a, b, c, d] = Self::per_lane(of);
        Self(unsafe { _mm256_cvtepi32_pd(_mm_setr_epi32(a, b, c, d)) })
    }
    #[inline(always)]
    fn to_clamped_ints(self, most: i32) -> [i32; 4] {
        debug_assert!(most <= HIGH);
        unsafe {
            let high = _mm256_set1_pd(f64::from(HIGH));
            let within = _mm256_min_pd(_mm256_max_pd(self.0, _mm256_setzero_pd()), high);
            core::mem::transmute(_mm_min_epi32(_mm256_cvttpd_epi32(within), _mm_set1_epi32(most)))
        }
    }
    #[inline(always)]
    fn numbers(self) -> [f64; 4] {
        // SAFETY: both are 4 `f64`.
        unsafe { core::mem::transmute(self.0) }
    }
}
