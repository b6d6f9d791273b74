//! Storage of three numbers that are computed together.
//!
//! The device stores three numbers. An x86-64 host stores three `f32` in one register of four and computes
//! with all at once. It does the same operations in the same order, so the bits are the same.

use core::fmt::Debug;

/// Three numbers; every operation is done component by component.
pub trait Storage3<T>: Copy + Debug {
    fn new(x: T, y: T, z: T) -> Self;
    fn x(self) -> T;
    fn y(self) -> T;
    fn z(self) -> T;
    fn plus(self, other: Self) -> Self;
    fn minus(self, other: Self) -> Self;
    /// Products of the components.
    fn component_mul(self, other: Self) -> Self;
    fn scaled(self, factor: T) -> Self;
    fn negated(self) -> Self;
}

/// Three separate numbers.
#[derive(Clone, Copy, Debug)]
pub struct ScalarStorage<T>(T, T, T);

#[cfg_attr(target_arch = "x86_64", expect(dead_code, reason = "the device's and the packed one's"))]
impl ScalarStorage<f32> {
    pub(crate) const ZERO: Self = Self(0.0, 0.0, 0.0);
}

impl ScalarStorage<f64> {
    pub(crate) const ZERO: Self = Self(0.0, 0.0, 0.0);
}

impl<T> Storage3<T> for ScalarStorage<T>
where
    T: Copy
        + Debug
        + core::ops::Add<Output = T>
        + core::ops::Sub<Output = T>
        + core::ops::Mul<Output = T>
        + core::ops::Neg<Output = T>,
{
    #[inline(always)]
    fn new(x: T, y: T, z: T) -> Self {
        Self(x, y, z)
    }
    #[inline(always)]
    fn x(self) -> T {
        self.0
    }
    #[inline(always)]
    fn y(self) -> T {
        self.1
    }
    #[inline(always)]
    fn z(self) -> T {
        self.2
    }
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self(self.0 + other.0, self.1 + other.1, self.2 + other.2)
    }
    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        Self(self.0 - other.0, self.1 - other.1, self.2 - other.2)
    }
    #[inline(always)]
    fn component_mul(self, other: Self) -> Self {
        Self(self.0 * other.0, self.1 * other.1, self.2 * other.2)
    }
    #[inline(always)]
    fn scaled(self, factor: T) -> Self {
        Self(self.0 * factor, self.1 * factor, self.2 * factor)
    }
    #[inline(always)]
    fn negated(self) -> Self {
        Self(-self.0, -self.1, -self.2)
    }
}

/// Storage of three `f32` on this target.
#[cfg(target_arch = "x86_64")]
pub type F32Storage = simd::SimdStorage;
#[cfg(not(target_arch = "x86_64"))]
pub type F32Storage = ScalarStorage<f32>;

#[cfg(target_arch = "x86_64")]
pub(crate) mod simd {
    use core::arch::x86_64::*;

    use super::Storage3;

    /// Three `f32` in the first lanes of a register. No result depends on the fourth lane.
    #[derive(Clone, Copy, Debug)]
    pub struct SimdStorage(pub(crate) __m128);

    impl SimdStorage {
        // SAFETY: both are four `f32`.
        pub(crate) const ZERO: Self =
            Self(unsafe { core::mem::transmute::<[f32; 4], __m128>([0.0; 4]) });
    }

    // SAFETY of all below: every x86-64 has SSE, and none of these touches memory.
    impl Storage3<f32> for SimdStorage {
        #[inline(always)]
        fn new(x: f32, y: f32, z: f32) -> Self {
            Self(unsafe { _mm_setr_ps(x, y, z, z) })
        }
        #[inline(always)]
        fn x(self) -> f32 {
            unsafe { _mm_cvtss_f32(self.0) }
        }
        #[inline(always)]
        fn y(self) -> f32 {
            unsafe { _mm_cvtss_f32(_mm_shuffle_ps::<0b01_01_01_01>(self.0, self.0)) }
        }
        #[inline(always)]
        fn z(self) -> f32 {
            unsafe { _mm_cvtss_f32(_mm_shuffle_ps::<0b10_10_10_10>(self.0, self.0)) }
        }
        #[inline(always)]
        fn plus(self, other: Self) -> Self {
            Self(unsafe { _mm_add_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn minus(self, other: Self) -> Self {
            Self(unsafe { _mm_sub_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn component_mul(self, other: Self) -> Self {
            Self(unsafe { _mm_mul_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn scaled(self, factor: f32) -> Self {
            Self(unsafe { _mm_mul_ps(self.0, _mm_set1_ps(factor)) })
        }
        #[inline(always)]
        fn negated(self) -> Self {
            Self(unsafe { _mm_xor_ps(self.0, _mm_set1_ps(-0.0)) })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Number;

    /// Every operation, number by number.
    fn bits<V: Storage3<f32>>([a, b]: [[f32; 3]; 2]) -> [[u32; 3]; 5] {
        let storage = |[x, y, z]: [f32; 3]| V::new(x, y, z);
        let (u, v) = (storage(a), storage(b));
        [u.plus(v), u.minus(v), u.component_mul(v), u.scaled(b[1]), u.negated()]
            .map(|t| [t.x(), t.y(), t.z()].map(f32::to_bits))
    }

    #[test]
    fn three_at_once_have_the_bits_of_one_after_the_other() {
        let values = [0.0f32, -0.0, 1.0, -1.0e-3, 0.1, 3.3e7, 1.0e-40, 7.0e-23, f32::INFINITY];
        let n = values.len();
        for k in 0..n * n * n {
            let a = [values[k % n], values[k / n % n], values[k / n / n]];
            for b in [[0.3, -7.1e5, 1.7e-20], [a[2], a[0], 0.25]] {
                let together = bits::<<f32 as Number>::Storage3>([a, b]);
                let apart = bits::<ScalarStorage<f32>>([a, b]);
                for (t, p) in together.iter().flatten().zip(apart.iter().flatten()) {
                    let lost = f32::from_bits(*t).is_nan() && f32::from_bits(*p).is_nan();
                    assert!(t == p || lost, "{a:?} {b:?}");
                }
            }
        }
    }
}
