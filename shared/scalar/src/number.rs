//! The numbers in which the laws of the model are written.

use core::fmt::Debug;
use core::ops::{Add, Div, IndexMut, Mul, Neg, Sub};

use crate::storage::{self, ScalarStorage, Storage3};

/// One number, or several numbers in lanes that are computed at once ([`Pack`](crate::Pack)).
pub trait Number:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Storage of a vector of three, as the target computes with it best.
    type Storage3: Storage3<Self>;
    /// Number of lanes.
    const LANES: usize;
    /// One value of any type for each lane.
    type Lanes<U>: IndexMut<usize, Output = U>;
    /// Calls `of` for each lane, in order.
    fn per_lane<U>(of: impl FnMut(usize) -> U) -> Self::Lanes<U>;
    /// The nearest number to a constant in the source, in each lane.
    fn lit(value: f64) -> Self;
    /// Square root, correctly rounded, so that host and device have the same bits.
    fn root(self) -> Self;
    /// The larger of this and a bound; the bound for NaN.
    ///
    /// It is one instruction on every machine, with the same bits as long as the bound is not NaN and the
    /// two are not zeros of different signs.
    fn larger(self, bound: Self) -> Self;
    /// The smaller of this and a bound; likewise.
    fn smaller(self, bound: Self) -> Self;
    /// The number if it is above 0, else 0; 0 for NaN.
    fn positive(self) -> Self;
    /// −1 below 0, else 1.
    fn sign(self) -> Self;
    /// Yes or no in each lane.
    type Mask: Copy;
    /// Where this is below a bound; nowhere for NaN.
    fn below(self, bound: Self) -> Self::Mask;
    /// Where this is a bound or above it; nowhere for NaN.
    fn reaches(self, bound: Self) -> Self::Mask;
    /// `yes` where the mask says so, else `no`.
    fn choose(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// The mask says yes in every lane.
    fn all(mask: Self::Mask) -> bool;
    /// The mask says yes in a lane.
    fn any(mask: Self::Mask) -> bool;
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
    type Mask = bool;
    #[inline(always)]
    fn below(self, bound: Self) -> bool {
        self < bound
    }
    #[inline(always)]
    fn reaches(self, bound: Self) -> bool {
        self >= bound
    }
    #[inline(always)]
    fn choose(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    #[inline(always)]
    fn all(mask: bool) -> bool {
        mask
    }
    #[inline(always)]
    fn any(mask: bool) -> bool {
        mask
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
    type Mask = bool;
    #[inline(always)]
    fn below(self, bound: Self) -> bool {
        self < bound
    }
    #[inline(always)]
    fn reaches(self, bound: Self) -> bool {
        self >= bound
    }
    #[inline(always)]
    fn choose(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    #[inline(always)]
    fn all(mask: bool) -> bool {
        mask
    }
    #[inline(always)]
    fn any(mask: bool) -> bool {
        mask
    }
}

/// On a Cortex-M, `libm`'s square root takes about a hundred instructions, and a comparison with a
/// selection takes three. The FPU has one instruction for each.
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
