//! The number type of the model.
//!
//! The model is written once, generic over [`Real`]: `f32` on the device and in every
//! host computation that must agree with it to the last bit, `f64` as the twin that
//! shows what single precision costs.
//!
//! Only operations that IEEE 754 rounds correctly (+ − × ÷ √) and functions built from
//! them may be used in the model; that, and no fused multiply-add, is why host and
//! device agree to the last bit.

#![no_std]

// On a host it knows what the processor can do.
#[cfg(target_arch = "x86_64")]
extern crate std;

mod pack;
mod storage;
mod vector;
#[cfg(target_arch = "x86_64")]
mod x86_64;

use core::fmt::Debug;
use core::ops::{Add, Div, IndexMut, Mul, Neg, Sub};

use nalgebra::RealField;

pub use pack::{Kernel, Pack};
pub use storage::{ScalarStorage, Storage3};
pub use vector::Vector3;

/// What laws are written in: one number, or several at a time that are computed with lane by
/// lane ([`Pack`]).
pub trait Number:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Three of them, as the target computes with them best.
    type Storage3: Storage3<Self>;
    /// How many they are.
    const LANES: usize;
    /// Anything else that goes by lanes.
    type Lanes<U>: IndexMut<usize, Output = U>;
    /// What `of` says of each lane, asked in turn.
    fn per_lane<U>(of: impl FnMut(usize) -> U) -> Self::Lanes<U>;
    /// The nearest number to a constant of the source text.
    fn lit(value: f64) -> Self;
    /// Square root, correctly rounded, hence the same bits on host and device.
    fn root(self) -> Self;
    /// The larger of this and a bound; the bound for NaN.
    ///
    /// One instruction on every machine, and the same bits, as long as the bound is a number and
    /// the two are not zeros of different signs.
    fn larger(self, bound: Self) -> Self;
    /// The smaller of this and a bound; likewise.
    fn smaller(self, bound: Self) -> Self;
    /// The number if it is above 0, else 0; 0 for NaN.
    fn positive(self) -> Self;
    /// −1 below 0, else 1.
    fn sign(self) -> Self;
}

/// A number of the model: `f32` or `f64`.
pub trait Real: RealField + Default + Pack<Self> {
    // Constants, for what must be one itself: an empty state of the model.
    const ZERO: Self;
    const ONE: Self;
    /// 10⁻¹²
    const PICO: Self;
    const ORIGIN: Vector3<Self>;
    /// Does something with as many numbers at a time as the processor computes with.
    fn run_vectorised<W: Kernel<Self>>(work: W) -> W::Output;
    /// The nearest number to an integer.
    fn int(value: i32) -> Self;
    /// Nearest `f32`, for reports.
    fn to_f32(self) -> f32;
    /// Widened to `f64`, exact.
    fn to_f64(self) -> f64;
    /// Largest integer not above `self`, saturating; 0 for NaN.
    fn floor_int(self) -> i32;
    /// The integer next to `self` towards zero, saturating; 0 for NaN.
    fn truncated(self) -> i32;
}

impl Number for f32 {
    type Storage3 = storage::F32Storage;
    const LANES: usize = 1;
    type Lanes<U> = [U; 1];
    #[inline(always)]
    fn per_lane<U>(mut of: impl FnMut(usize) -> U) -> [U; 1] {
        [of(0)]
    }
    #[inline(always)]
    fn lit(value: f64) -> Self {
        value as f32
    }
    #[inline(always)]
    fn root(self) -> Self {
        sqrt_f32(self)
    }
    #[inline(always)]
    fn larger(self, bound: Self) -> Self {
        larger_f32(self, bound)
    }
    #[inline(always)]
    fn smaller(self, bound: Self) -> Self {
        smaller_f32(self, bound)
    }
    #[inline(always)]
    fn positive(self) -> Self {
        larger_f32(self, 0.0)
    }
    #[inline(always)]
    fn sign(self) -> Self {
        if self < 0.0 { -1.0 } else { 1.0 }
    }
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const PICO: Self = 1e-12;
    const ORIGIN: Vector3<Self> = Vector3(storage::F32Storage::ZERO);
    #[inline(always)]
    fn run_vectorised<W: Kernel<Self>>(work: W) -> W::Output {
        #[cfg(target_arch = "x86_64")]
        {
            x86_64::run_vectorised::<Self, x86_64::F32x4, x86_64::F32x8, W>(work)
        }
        #[cfg(not(target_arch = "x86_64"))]
        {
            work.run::<Self>()
        }
    }
    #[inline(always)]
    fn int(value: i32) -> Self {
        value as f32
    }
    #[inline(always)]
    fn to_f32(self) -> f32 {
        self
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    #[inline(always)]
    fn floor_int(self) -> i32 {
        let truncated = self as i32;
        truncated.saturating_sub(i32::from(self < truncated as f32))
    }
    #[inline(always)]
    fn truncated(self) -> i32 {
        self as i32
    }
}

impl Number for f64 {
    type Storage3 = ScalarStorage<f64>;
    const LANES: usize = 1;
    type Lanes<U> = [U; 1];
    #[inline(always)]
    fn per_lane<U>(mut of: impl FnMut(usize) -> U) -> [U; 1] {
        [of(0)]
    }
    #[inline(always)]
    fn lit(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn root(self) -> Self {
        libm::sqrt(self)
    }
    #[inline(always)]
    fn larger(self, bound: Self) -> Self {
        if self > bound { self } else { bound }
    }
    #[inline(always)]
    fn smaller(self, bound: Self) -> Self {
        if self < bound { self } else { bound }
    }
    #[inline(always)]
    fn positive(self) -> Self {
        if self > 0.0 { self } else { 0.0 }
    }
    #[inline(always)]
    fn sign(self) -> Self {
        if self < 0.0 { -1.0 } else { 1.0 }
    }
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const PICO: Self = 1e-12;
    const ORIGIN: Vector3<Self> = Vector3(ScalarStorage::<Self>::ZERO);
    #[inline(always)]
    fn run_vectorised<W: Kernel<Self>>(work: W) -> W::Output {
        #[cfg(target_arch = "x86_64")]
        {
            x86_64::run_vectorised::<Self, x86_64::F64x2, x86_64::F64x4, W>(work)
        }
        #[cfg(not(target_arch = "x86_64"))]
        {
            work.run::<Self>()
        }
    }
    #[inline(always)]
    fn int(value: i32) -> Self {
        f64::from(value)
    }
    #[inline(always)]
    fn to_f32(self) -> f32 {
        self as f32
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }
    #[inline(always)]
    fn floor_int(self) -> i32 {
        let truncated = self as i32;
        truncated.saturating_sub(i32::from(self < f64::from(truncated)))
    }
    #[inline(always)]
    fn truncated(self) -> i32 {
        self as i32
    }
}

/// `libm`'s square root is some hundred instructions on a Cortex-M, a comparison and a choice
/// three; the FPU has one for each.
#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
#[inline(always)]
fn sqrt_f32(value: f32) -> f32 {
    let root: f32;
    // SAFETY: one register in, one register out; no memory, no flags.
    unsafe {
        core::arch::asm!("vsqrt.f32 {0}, {1}", out(sreg) root, in(sreg) value,
            options(pure, nomem, nostack, preserves_flags));
    }
    root
}

#[cfg(not(all(target_arch = "arm", target_abi = "eabihf")))]
#[inline(always)]
fn sqrt_f32(value: f32) -> f32 {
    libm::sqrtf(value)
}

#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
#[inline(always)]
fn larger_f32(a: f32, b: f32) -> f32 {
    let larger: f32;
    // SAFETY: two registers in, one register out; no memory, no flags.
    unsafe {
        core::arch::asm!("vmaxnm.f32 {0}, {1}, {2}", out(sreg) larger, in(sreg) a, in(sreg) b,
            options(pure, nomem, nostack, preserves_flags));
    }
    larger
}

#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
#[inline(always)]
fn smaller_f32(a: f32, b: f32) -> f32 {
    let smaller: f32;
    // SAFETY: two registers in, one register out; no memory, no flags.
    unsafe {
        core::arch::asm!("vminnm.f32 {0}, {1}, {2}", out(sreg) smaller, in(sreg) a, in(sreg) b,
            options(pure, nomem, nostack, preserves_flags));
    }
    smaller
}

#[cfg(not(all(target_arch = "arm", target_abi = "eabihf")))]
#[inline(always)]
fn larger_f32(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[cfg(not(all(target_arch = "arm", target_abi = "eabihf")))]
#[inline(always)]
fn smaller_f32(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_no_number_and_a_bound_the_bound_is_left() {
        fn check<T: Real>() {
            let [low, high] = [-1.0, 2.0].map(T::lit);
            assert_eq!((low.larger(high), low.smaller(high)), (high, low));
            assert_eq!((high.larger(low), high.smaller(low)), (high, low));
            let nan = T::zero() / T::zero();
            assert_eq!((nan.larger(high), nan.smaller(low)), (high, low));
        }
        check::<f32>();
        check::<f64>();
    }

    #[test]
    fn what_is_not_above_0_is_0() {
        for (x, positive) in [(1.5f32, 1.5f32), (0.0, 0.0), (-0.0, 0.0), (-1.5, 0.0)] {
            assert_eq!(x.positive().to_bits(), positive.to_bits());
        }
        assert_eq!(f32::NAN.positive().to_bits(), 0);
        assert_eq!(f64::NAN.positive().to_bits(), 0);
    }

    #[test]
    fn integers_saturate_on_both_sides() {
        fn check<T: Real>() {
            for (x, floor) in [(-1.5, -2), (-2.0, -2), (0.0, 0), (1.5, 1)] {
                assert_eq!(T::lit(x).floor_int(), floor);
            }
            for (x, floor) in [(f64::NEG_INFINITY, i32::MIN), (-1e30, i32::MIN), (1e30, i32::MAX)] {
                assert_eq!(T::lit(x).floor_int(), floor);
            }
            assert_eq!(T::lit(f64::NAN).floor_int(), 0);
            assert_eq!(T::lit(-1.5).truncated(), -1);
            assert_eq!(T::lit(1e30).truncated(), i32::MAX);
            assert_eq!(T::lit(f64::NAN).truncated(), 0);
        }
        check::<f32>();
        check::<f64>();
    }
}
