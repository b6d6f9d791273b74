//! A number of the model.

use nalgebra::RealField;

use crate::catheters::Catheters;
use crate::number::Number;
use crate::pack::{Kernel, PlainPack};
use crate::storage::{F32Storage, ScalarStorage};
use crate::vector::Vector3;
#[cfg(target_arch = "x86_64")]
use crate::x86_64;

/// A number of the model: `f32` or `f64`.
pub trait Real:
    RealField + Default + PlainPack<Self> + Number<Mask = bool> + Catheters<Count = usize, Index = u16>
{
    // Constants, because the empty state of the model is a constant.
    const ZERO: Self;
    const ONE: Self;
    /// 10⁻¹²
    const PICO: Self;
    const ORIGIN: Vector3<Self>;
    /// Runs a kernel with the widest pack of the processor.
    fn run_vectorised<W: Kernel<Self>>(work: W) -> W::Output;
    /// The number nearest to an integer.
    fn int(value: i32) -> Self;
    /// Nearest `f32`, for reports.
    fn to_f32(self) -> f32;
    /// The same number as `f64`.
    fn to_f64(self) -> f64;
    /// Largest integer not above `self`, saturating; 0 for NaN.
    fn floor_int(self) -> i32;
    /// `self` truncated towards zero, saturating; 0 for NaN.
    fn truncated(self) -> i32;
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const PICO: Self = 1e-12;
    const ORIGIN: Vector3<Self> = Vector3(F32Storage::ZERO);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Number;

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
