//! Small dense algebra of the recursion: symmetric 3 × 3 matrices and rotations.
//!
//! General vectors and matrices are nalgebra's. What stands here is what nalgebra has no
//! type for, written out so that a step compiles to straight-line code.

use core::ops::{Mul, Sub};
use core::sync::atomic::{Ordering, compiler_fence};

use cathforce_scalar::Real;
use nalgebra::{Matrix3, Vector3};

/// Nothing is read from memory ahead of here, and what was stored is read again after it.
///
/// A sweep has more numbers under way than the 32 registers of a Cortex-M7's FPU: left to
/// itself the compiler reads early and then parks what does not fit. A host is better left to
/// itself. A value is not changed.
#[inline(always)]
pub(crate) fn read_here() {
    if cfg!(target_arch = "arm") {
        compiler_fence(Ordering::SeqCst);
    }
}

/// A symmetric 3 × 3 matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sym3<T> {
    pub xx: T,
    pub xy: T,
    pub xz: T,
    pub yy: T,
    pub yz: T,
    pub zz: T,
}

impl<T: Real> Sym3<T> {
    pub fn zero() -> Self {
        let o = T::zero();
        Self { xx: o, xy: o, xz: o, yy: o, yz: o, zz: o }
    }

    /// u vᵀ, of which the caller knows that it is symmetric.
    #[inline(always)]
    pub fn outer(u: &Vector3<T>, v: &Vector3<T>) -> Self {
        Self {
            xx: u.x * v.x,
            xy: u.x * v.y,
            xz: u.x * v.z,
            yy: u.y * v.y,
            yz: u.y * v.z,
            zz: u.z * v.z,
        }
    }

    /// self + other
    #[inline(always)]
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            xx: self.xx + other.xx,
            xy: self.xy + other.xy,
            xz: self.xz + other.xz,
            yy: self.yy + other.yy,
            yz: self.yz + other.yz,
            zz: self.zz + other.zz,
        }
    }

    #[inline(always)]
    pub fn columns(&self) -> [Vector3<T>; 3] {
        [
            Vector3::new(self.xx, self.xy, self.xz),
            Vector3::new(self.xy, self.yy, self.yz),
            Vector3::new(self.xz, self.yz, self.zz),
        ]
    }

    /// self += s I
    #[inline(always)]
    pub fn add_identity(&mut self, s: T) {
        self.xx += s;
        self.yy += s;
        self.zz += s;
    }

    /// self += u vᵀ, of which the caller knows that it is symmetric.
    #[inline(always)]
    pub fn add_outer(&mut self, u: &Vector3<T>, v: &Vector3<T>) {
        self.xx += u.x * v.x;
        self.xy += u.x * v.y;
        self.xz += u.x * v.z;
        self.yy += u.y * v.y;
        self.yz += u.y * v.z;
        self.zz += u.z * v.z;
    }

    /// self −= u vᵀ, of which the caller knows that it is symmetric.
    #[inline(always)]
    pub fn sub_outer(&mut self, u: &Vector3<T>, v: &Vector3<T>) {
        self.xx -= u.x * v.x;
        self.xy -= u.x * v.y;
        self.xz -= u.x * v.z;
        self.yy -= u.y * v.y;
        self.yz -= u.y * v.z;
        self.zz -= u.z * v.z;
    }

    /// self −= u uᵀ
    #[inline(always)]
    pub fn sub_square(&mut self, u: &Vector3<T>) {
        self.sub_outer(u, u);
    }

    #[inline(always)]
    pub fn mul_vec(&self, v: &Vector3<T>) -> Vector3<T> {
        Vector3::new(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )
    }

    /// self += \[l\]ₓ M; what this makes of the lower triangle, the caller makes good.
    #[inline(always)]
    pub fn add_cross_product(&mut self, l: &Vector3<T>, m: &Matrix3<T>) {
        self.xx = self.xx + l.y * m.m31 - l.z * m.m21;
        self.xy = self.xy + l.y * m.m32 - l.z * m.m22;
        self.xz = self.xz + l.y * m.m33 - l.z * m.m23;
        self.yy = self.yy + l.z * m.m12 - l.x * m.m32;
        self.yz = self.yz + l.z * m.m13 - l.x * m.m33;
        self.zz = self.zz + l.x * m.m23 - l.y * m.m13;
    }

    /// self += (\[l\]ₓ M)ᵀ, likewise.
    #[inline(always)]
    pub fn add_cross_product_transposed(&mut self, l: &Vector3<T>, m: &Matrix3<T>) {
        self.xx = self.xx + l.y * m.m31 - l.z * m.m21;
        self.xy = self.xy + l.z * m.m11 - l.x * m.m31;
        self.xz = self.xz + l.x * m.m21 - l.y * m.m11;
        self.yy = self.yy + l.z * m.m12 - l.x * m.m32;
        self.yz = self.yz + l.x * m.m22 - l.y * m.m12;
        self.zz = self.zz + l.x * m.m23 - l.y * m.m13;
    }
}

/// Factors L and Δ of a symmetric matrix L Δ Lᵀ: L with ones on its diagonal, Δ diagonal.
///
/// Where a stiff wall meets a soft joint, A − B D⁻¹ Bᵀ must be taken through the factors: by
/// the inverse, the error grows with the square of the condition and the result turns negative.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Factor<T> {
    yx: T,
    zx: T,
    zy: T,
    /// The diagonal of Δ⁻¹.
    pub inverse: [T; 3],
}

impl<T: Real> Factor<T> {
    pub fn identity() -> Self {
        let (o, one) = (T::zero(), T::one());
        Self { yx: o, zx: o, zy: o, inverse: [one; 3] }
    }

    /// Of a matrix whose eigenvalues, and so its pivots, are `smallest` or more. A pivot that
    /// rounding has put below is raised to it: the inverse stays finite and points downhill.
    #[inline(always)]
    pub fn new(m: &Sym3<T>, smallest: T) -> Self {
        let invert = |pivot: T| T::one() / pivot.larger(smallest);
        let x = invert(m.xx);
        let (yx, zx) = (m.xy * x, m.xz * x);
        let y = invert(m.yy - yx * m.xy);
        let rest = m.yz - yx * m.xz;
        let zy = rest * y;
        let z = invert(m.zz - zx * m.xz - zy * rest);
        Self { yx, zx, zy, inverse: [x, y, z] }
    }

    /// v L⁻ᵀ, of a row of numbers or of columns.
    #[inline(always)]
    pub fn forward<V>(&self, [x, y, z]: [V; 3]) -> [V; 3]
    where
        V: Copy + Sub<Output = V> + Mul<T, Output = V>,
    {
        let y = y - x * self.yx;
        let z = z - x * self.zx - y * self.zy;
        [x, y, z]
    }

    /// L⁻ᵀ v
    #[inline(always)]
    pub fn backward(&self, v: &Vector3<T>) -> Vector3<T> {
        let y = v.y - self.zy * v.z;
        let x = v.x - self.yx * y - self.zx * v.z;
        Vector3::new(x, y, v.z)
    }
}

/// Mᵀ v
#[inline(always)]
pub(crate) fn mul_transposed<T: Real>(m: &Matrix3<T>, v: &Vector3<T>) -> Vector3<T> {
    Vector3::new(
        m.m11 * v.x + m.m21 * v.y + m.m31 * v.z,
        m.m12 * v.x + m.m22 * v.y + m.m32 * v.z,
        m.m13 * v.x + m.m23 * v.y + m.m33 * v.z,
    )
}

// Sums that begin with what is added to: each product is one multiply-accumulate, which on
// the device is one instruction (and rounds twice).

/// u + a × b
#[inline(always)]
pub(crate) fn plus_cross<T: Real>(u: &Vector3<T>, a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(
        u.x + a.y * b.z - a.z * b.y,
        u.y + a.z * b.x - a.x * b.z,
        u.z + a.x * b.y - a.y * b.x,
    )
}

/// u vᵀ
#[inline(always)]
pub(crate) fn outer<T: Real>(u: &Vector3<T>, v: &Vector3<T>) -> Matrix3<T> {
    Matrix3::from_columns(&[u * v.x, u * v.y, u * v.z])
}

/// M += u vᵀ
#[inline(always)]
pub(crate) fn add_outer<T: Real>(m: &mut Matrix3<T>, u: &Vector3<T>, v: &Vector3<T>) {
    m.m11 += u.x * v.x;
    m.m12 += u.x * v.y;
    m.m13 += u.x * v.z;
    m.m21 += u.y * v.x;
    m.m22 += u.y * v.y;
    m.m23 += u.y * v.z;
    m.m31 += u.z * v.x;
    m.m32 += u.z * v.y;
    m.m33 += u.z * v.z;
}

/// M −= u vᵀ
#[inline(always)]
pub(crate) fn sub_outer<T: Real>(m: &mut Matrix3<T>, u: &Vector3<T>, v: &Vector3<T>) {
    m.m11 -= u.x * v.x;
    m.m12 -= u.x * v.y;
    m.m13 -= u.x * v.z;
    m.m21 -= u.y * v.x;
    m.m22 -= u.y * v.y;
    m.m23 -= u.y * v.z;
    m.m31 -= u.z * v.x;
    m.m32 -= u.z * v.y;
    m.m33 -= u.z * v.z;
}

/// M −= \[v\]ₓ
#[inline(always)]
pub(crate) fn sub_cross<T: Real>(m: &mut Matrix3<T>, v: &Vector3<T>) {
    m.m12 += v.z;
    m.m13 -= v.y;
    m.m21 -= v.z;
    m.m23 += v.x;
    m.m31 += v.y;
    m.m32 -= v.x;
}

/// M −= A \[l\]ₓ
#[inline(always)]
pub(crate) fn sub_product_cross<T: Real>(m: &mut Matrix3<T>, a: &Sym3<T>, l: &Vector3<T>) {
    m.m11 = m.m11 - a.xy * l.z + a.xz * l.y;
    m.m12 = m.m12 - a.xz * l.x + a.xx * l.z;
    m.m13 = m.m13 - a.xx * l.y + a.xy * l.x;
    m.m21 = m.m21 - a.yy * l.z + a.yz * l.y;
    m.m22 = m.m22 - a.yz * l.x + a.xy * l.z;
    m.m23 = m.m23 - a.xy * l.y + a.yy * l.x;
    m.m31 = m.m31 - a.yz * l.z + a.zz * l.y;
    m.m32 = m.m32 - a.zz * l.x + a.xz * l.z;
    m.m33 = m.m33 - a.xz * l.y + a.yz * l.x;
}

#[inline(always)]
pub(crate) fn dot<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> T {
    a.x * b.x + a.y * b.y + a.z * b.z
}

#[inline(always)]
pub(crate) fn cross<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
}

/// A rotation as a quaternion w + v, of unit norm up to rounding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rotation<T: Real> {
    pub w: T,
    pub v: Vector3<T>,
}

impl<T: Real> Rotation<T> {
    pub fn identity() -> Self {
        Self { w: T::one(), v: Vector3::zeros() }
    }

    /// The rotation whose columns are the given right-handed orthonormal axes.
    pub fn from_axes(x: &Vector3<T>, y: &Vector3<T>, z: &Vector3<T>) -> Self {
        // The branch with the largest component keeps the square root well away from 0.
        let (one, half) = (T::one(), T::lit(0.5));
        let squares = [
            one + x.x + y.y + z.z,
            one + x.x - y.y - z.z,
            one - x.x + y.y - z.z,
            one - x.x - y.y + z.z,
        ];
        let mut largest = 0;
        for (i, s) in squares.iter().enumerate() {
            if *s > squares[largest] {
                largest = i;
            }
        }
        let root = squares[largest].root();
        let s = half / root;
        let (wx, wy, wz) = ((y.z - z.y) * s, (z.x - x.z) * s, (x.y - y.x) * s);
        let (xy, xz, yz) = ((x.y + y.x) * s, (x.z + z.x) * s, (y.z + z.y) * s);
        let main = half * root;
        match largest {
            0 => Self { w: main, v: Vector3::new(wx, wy, wz) },
            1 => Self { w: wx, v: Vector3::new(main, xy, xz) },
            2 => Self { w: wy, v: Vector3::new(xy, main, yz) },
            _ => Self { w: wz, v: Vector3::new(xz, yz, main) },
        }
    }

    /// (1, half) normalised, times this rotation: a turn about the axis `half` by
    /// 2 atan |half|. For a small rotation `half` is half its rotation vector; for a large
    /// one the turn stays below π, whatever a solve asks for.
    #[inline(always)]
    pub fn turned(&self, half: &Vector3<T>) -> Self {
        let w = self.w - half.x * self.v.x - half.y * self.v.y - half.z * self.v.z;
        let v = plus_cross(&(self.v + half * self.w), half, &self.v);
        Self { w, v }.normalised()
    }

    #[inline(always)]
    pub fn normalised(&self) -> Self {
        let s = T::one() / (self.w * self.w + dot(&self.v, &self.v)).root();
        Self { w: self.w * s, v: self.v * s }
    }

    /// R v
    #[inline(always)]
    pub fn rotate(&self, v: &Vector3<T>) -> Vector3<T> {
        let c = cross(&self.v, v);
        let c = c + c;
        v + c * self.w + cross(&self.v, &c)
    }

    /// R e_z, the tangent of a link.
    #[inline(always)]
    pub fn tangent(&self) -> Vector3<T> {
        let two = T::lit(2.0);
        Vector3::new(
            two * (self.v.x * self.v.z + self.w * self.v.y),
            two * (self.v.y * self.v.z - self.w * self.v.x),
            T::one() - two * (self.v.x * self.v.x + self.v.y * self.v.y),
        )
    }
}

/// The way from one rotation to another, less than half a turn.
pub(crate) struct Bend<T: Real> {
    /// Rotation vector, material axes \[rad\].
    pub angle: Vector3<T>,
    /// The rotation halfway, as a quaternion of no particular norm.
    w: T,
    v: Vector3<T>,
    /// 2 over that norm's square.
    scale: T,
}

impl<T: Real> Bend<T> {
    /// q = log(nearᵀ far) = 4 atan(|m|)/|m| m, with m = v/(1 + w) of the quaternion between
    /// them.     docs/model.md (4)
    ///
    /// The series is exact to f32 up to 0.7 rad, to 0.1 % at 2 rad, and bounded by π.
    #[inline(always)]
    pub fn between(near: &Rotation<T>, far: &Rotation<T>) -> Self {
        let w = near.w * far.w + dot(&near.v, &far.v);
        let v = plus_cross(&(far.v * near.w - near.v * far.w), &far.v, &near.v);
        // q and −q are the same rotation: the short way is meant.
        let sign = if w < T::zero() { -T::one() } else { T::one() };
        // The sum of two unit quaternions has the norm's square 2 + 2 |w|.
        let scale = T::one() / (T::one() + sign * w);
        let m = v * (sign * scale);
        let s = dot(&m, &m);
        let c = |x: f64| T::lit(x);
        let series = c(4.0) - s * (c(4.0 / 3.0) - s * (c(4.0 / 5.0) - s * c(4.0 / 7.0)));
        Self { angle: m * series, w: near.w + sign * far.w, v: near.v + far.v * sign, scale }
    }

    /// R_mid x
    #[inline(always)]
    pub fn rotate_midway(&self, x: &Vector3<T>) -> Vector3<T> {
        x + cross(&self.v, &plus_cross(&(x * self.w), &self.v, x)) * self.scale
    }

    /// R_mid e_z
    #[inline(always)]
    pub fn midway_tangent(&self) -> Vector3<T> {
        let Self { w, v, scale, .. } = self;
        Vector3::new(
            *scale * (v.x * v.z + *w * v.y),
            *scale * (v.y * v.z - *w * v.x),
            T::one() - *scale * (v.x * v.x + v.y * v.y),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elimination_through_the_factors_survives_a_wall_far_stiffer_than_the_joint() {
        // A point held by `wall`, a lever away from a joint of stiffness 1: seen from beyond
        // the joint, what is left across the lever is wall / (1 + wall · lever²).
        for wall in [1.0f32, 1e3, 1e5, 1e6] {
            let lever = Vector3::new(0.6, -0.48, 0.64);
            let (mut a, mut c) = (Sym3::zero(), Sym3::zero());
            a.add_identity(wall);
            let mut b = Matrix3::zeros();
            sub_product_cross(&mut b, &a, &lever);
            c.add_identity(wall);
            c.sub_outer(&(lever * wall), &lever);
            c.add_identity(1.0);
            let factor = Factor::new(&c, 1.0);
            let z = factor.forward([0, 1, 2].map(|i| b.column(i).into_owned()));
            for (z, inverse) in z.iter().zip(factor.inverse) {
                a.sub_outer(&(z * inverse), z);
            }
            let across = Vector3::new(0.0, 0.8, 0.6);
            let left = dot(&across, &a.mul_vec(&across));
            let exact = wall / (1.0 + wall);
            assert!((left / exact - 1.0).abs() < 0.2, "wall {wall}: {left}, not {exact}");

            let [x, y, z] = factor.forward(c.mul_vec(&across).into());
            let [i, j, k] = factor.inverse;
            let product = factor.backward(&Vector3::new(x * i, y * j, z * k));
            assert!((product - across).norm() < 2e-7 * wall.max(10.0), "{product:?}");
        }
    }
}
