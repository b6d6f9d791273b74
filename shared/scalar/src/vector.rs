//! A vector of three numbers.

use core::ops::{Add, AddAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use crate::number::Number;
use crate::storage::Storage3;

/// A vector in space.
#[derive(Clone, Copy, Debug)]
pub struct Vector3<T: Number>(pub(crate) T::Storage3);

impl<T: Number> Vector3<T> {
    #[inline(always)]
    pub fn new(x: T, y: T, z: T) -> Self {
        Self(T::Storage3::new(x, y, z))
    }

    #[inline(always)]
    pub fn zeros() -> Self {
        let o = T::lit(0.0);
        Self::new(o, o, o)
    }

    #[inline(always)]
    pub fn x(&self) -> T {
        self.0.x()
    }

    #[inline(always)]
    pub fn y(&self) -> T {
        self.0.y()
    }

    #[inline(always)]
    pub fn z(&self) -> T {
        self.0.z()
    }

    /// Subtracts a number from z.
    #[inline(always)]
    pub fn subtract_z(&mut self, less: T) {
        *self = Self::new(self.x(), self.y(), self.z() - less);
    }

    /// (x a, y b, z c) of (x, y, z) and (a, b, c)
    #[inline(always)]
    pub fn component_mul(&self, other: &Self) -> Self {
        Self(self.0.component_mul(other.0))
    }

    /// (y, z, x)
    #[inline(always)]
    pub fn yzx(&self) -> Self {
        Self::new(self.y(), self.z(), self.x())
    }

    /// (z, x, y)
    #[inline(always)]
    pub fn zxy(&self) -> Self {
        Self::new(self.z(), self.x(), self.y())
    }

    /// Scalar product.
    #[inline(always)]
    pub fn dot(&self, other: &Self) -> T {
        let products = self.component_mul(other);
        products.x() + products.y() + products.z()
    }

    /// self × other
    #[inline(always)]
    pub fn cross(&self, other: &Self) -> Self {
        self.yzx().component_mul(&other.zxy()) - self.zxy().component_mul(&other.yzx())
    }

    /// self + a × b, as a sum that begins with self. Each product is then one multiply-accumulate, which is
    /// one instruction on the device (and rounds twice).
    #[inline(always)]
    pub fn plus_cross(&self, a: &Self, b: &Self) -> Self {
        *self + a.yzx().component_mul(&b.zxy()) - a.zxy().component_mul(&b.yzx())
    }

    /// self − a × b, likewise.
    #[inline(always)]
    pub fn minus_cross(&self, a: &Self, b: &Self) -> Self {
        *self - a.yzx().component_mul(&b.zxy()) + a.zxy().component_mul(&b.yzx())
    }

    /// Square of the length.
    #[inline(always)]
    pub fn norm_squared(&self) -> T {
        self.dot(self)
    }

    /// Length.
    #[inline(always)]
    pub fn norm(&self) -> T {
        self.norm_squared().root()
    }
}

impl<T: Number> From<[T; 3]> for Vector3<T> {
    #[inline(always)]
    fn from([x, y, z]: [T; 3]) -> Self {
        Self::new(x, y, z)
    }
}

impl<T: Number> From<Vector3<T>> for [T; 3] {
    #[inline(always)]
    fn from(v: Vector3<T>) -> Self {
        [v.x(), v.y(), v.z()]
    }
}

impl<T: Number + PartialEq> PartialEq for Vector3<T> {
    fn eq(&self, other: &Self) -> bool {
        <[T; 3]>::from(*self) == <[T; 3]>::from(*other)
    }
}

impl<T: Number> Add for Vector3<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0.plus(other.0))
    }
}

impl<T: Number> Sub for Vector3<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0.minus(other.0))
    }
}

impl<T: Number> Mul<T> for Vector3<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: T) -> Self {
        Self(self.0.scaled(factor))
    }
}

impl<T: Number> Mul<T> for &Vector3<T> {
    type Output = Vector3<T>;
    #[inline(always)]
    fn mul(self, factor: T) -> Vector3<T> {
        *self * factor
    }
}

impl<T: Number> Neg for Vector3<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.negated())
    }
}

impl<T: Number> AddAssign for Vector3<T> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<T: Number> SubAssign for Vector3<T> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<T: Number> MulAssign<T> for Vector3<T> {
    #[inline(always)]
    fn mul_assign(&mut self, factor: T) {
        *self = *self * factor;
    }
}
