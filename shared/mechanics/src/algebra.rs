//! Small dense algebra of the recursion: symmetric 3 × 3 matrices and rotations.
//!
//! General vectors and matrices are nalgebra's. What stands here is what nalgebra has no
//! type for, written out so that a step compiles to straight-line code.

use cathforce_scalar::Real;
use nalgebra::{Matrix3, Vector3};

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

    /// self += s I
    #[inline(always)]
    pub fn add_identity(&mut self, s: T) {
        self.xx += s;
        self.yy += s;
        self.zz += s;
    }

    /// self += s v vᵀ
    #[inline(always)]
    pub fn add_outer(&mut self, s: T, v: &Vector3<T>) {
        let w = v * s;
        self.xx += w.x * v.x;
        self.xy += w.x * v.y;
        self.xz += w.x * v.z;
        self.yy += w.y * v.y;
        self.yz += w.y * v.z;
        self.zz += w.z * v.z;
    }

    /// self += s (u vᵀ + v uᵀ)
    #[inline(always)]
    pub fn add_outer_pair(&mut self, s: T, u: &Vector3<T>, v: &Vector3<T>) {
        let w = u * s;
        self.xx += (w.x * v.x) + (w.x * v.x);
        self.xy += (w.x * v.y) + (w.y * v.x);
        self.xz += (w.x * v.z) + (w.z * v.x);
        self.yy += (w.y * v.y) + (w.y * v.y);
        self.yz += (w.y * v.z) + (w.z * v.y);
        self.zz += (w.z * v.z) + (w.z * v.z);
    }

    /// self + s I + p v vᵀ
    #[inline(always)]
    pub fn plus_axial(&self, s: T, p: T, v: &Vector3<T>) -> Self {
        let mut sum = *self;
        sum.add_outer(p, v);
        sum.add_identity(s);
        sum
    }

    #[inline(always)]
    pub fn mul_vec(&self, v: &Vector3<T>) -> Vector3<T> {
        Vector3::new(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )
    }

    /// Inverse by cofactors. A determinant below `floor` is raised to it: the result stays
    /// finite and points downhill, which is all that a Newton step asks of it.
    #[inline(always)]
    pub fn inverse(&self, floor: T) -> Self {
        let xx = self.yy * self.zz - self.yz * self.yz;
        let xy = self.xz * self.yz - self.xy * self.zz;
        let xz = self.xy * self.yz - self.xz * self.yy;
        let yy = self.xx * self.zz - self.xz * self.xz;
        let yz = self.xy * self.xz - self.xx * self.yz;
        let zz = self.xx * self.yy - self.xy * self.xy;
        let determinant = self.xx * xx + self.xy * xy + self.xz * xz;
        let s = T::one() / if determinant > floor { determinant } else { floor };
        Self { xx: xx * s, xy: xy * s, xz: xz * s, yy: yy * s, yz: yz * s, zz: zz * s }
    }

    /// M self
    #[inline(always)]
    pub fn left_mul(&self, m: &Matrix3<T>) -> Matrix3<T> {
        let row = |x: T, y: T, z: T| {
            (
                x * self.xx + y * self.xy + z * self.xz,
                x * self.xy + y * self.yy + z * self.yz,
                x * self.xz + y * self.yz + z * self.zz,
            )
        };
        let (a, b, c) = row(m.m11, m.m12, m.m13);
        let (d, e, f) = row(m.m21, m.m22, m.m23);
        let (g, h, i) = row(m.m31, m.m32, m.m33);
        Matrix3::new(a, b, c, d, e, f, g, h, i)
    }

    /// self −= X Yᵀ, of which the caller knows that it is symmetric.
    #[inline(always)]
    pub fn sub_product_transposed(&mut self, x: &Matrix3<T>, y: &Matrix3<T>) {
        self.xx -= x.m11 * y.m11 + x.m12 * y.m12 + x.m13 * y.m13;
        self.xy -= x.m11 * y.m21 + x.m12 * y.m22 + x.m13 * y.m23;
        self.xz -= x.m11 * y.m31 + x.m12 * y.m32 + x.m13 * y.m33;
        self.yy -= x.m21 * y.m21 + x.m22 * y.m22 + x.m23 * y.m23;
        self.yz -= x.m21 * y.m31 + x.m22 * y.m32 + x.m23 * y.m33;
        self.zz -= x.m31 * y.m31 + x.m32 * y.m32 + x.m33 * y.m33;
    }

    /// self \[l\]ₓ
    #[inline(always)]
    pub fn mul_cross(&self, l: &Vector3<T>) -> Matrix3<T> {
        let row = |x: T, y: T, z: T| (y * l.z - z * l.y, z * l.x - x * l.z, x * l.y - y * l.x);
        let (a, b, c) = row(self.xx, self.xy, self.xz);
        let (d, e, f) = row(self.xy, self.yy, self.yz);
        let (g, h, i) = row(self.xz, self.yz, self.zz);
        Matrix3::new(a, b, c, d, e, f, g, h, i)
    }

    /// self += \[l\]ₓ X + (\[l\]ₓ Y)ᵀ, of which the caller knows that it is symmetric.
    #[inline(always)]
    pub fn add_cross_products(&mut self, l: &Vector3<T>, x: &Matrix3<T>, y: &Matrix3<T>) {
        self.xx += (l.y * x.m31 - l.z * x.m21) + (l.y * y.m31 - l.z * y.m21);
        self.xy += (l.y * x.m32 - l.z * x.m22) + (l.z * y.m11 - l.x * y.m31);
        self.xz += (l.y * x.m33 - l.z * x.m23) + (l.x * y.m21 - l.y * y.m11);
        self.yy += (l.z * x.m12 - l.x * x.m32) + (l.z * y.m12 - l.x * y.m32);
        self.yz += (l.z * x.m13 - l.x * x.m33) + (l.x * y.m22 - l.y * y.m12);
        self.zz += (l.x * x.m23 - l.y * x.m13) + (l.x * y.m23 - l.y * y.m13);
    }
}

/// M v for a general matrix, written out.
#[inline(always)]
pub(crate) fn mul<T: Real>(m: &Matrix3<T>, v: &Vector3<T>) -> Vector3<T> {
    Vector3::new(
        m.m11 * v.x + m.m12 * v.y + m.m13 * v.z,
        m.m21 * v.x + m.m22 * v.y + m.m23 * v.z,
        m.m31 * v.x + m.m32 * v.y + m.m33 * v.z,
    )
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

/// M += s u vᵀ
#[inline(always)]
pub(crate) fn add_outer<T: Real>(m: &mut Matrix3<T>, s: T, u: &Vector3<T>, v: &Vector3<T>) {
    let w = u * s;
    m.m11 += w.x * v.x;
    m.m12 += w.x * v.y;
    m.m13 += w.x * v.z;
    m.m21 += w.y * v.x;
    m.m22 += w.y * v.y;
    m.m23 += w.y * v.z;
    m.m31 += w.z * v.x;
    m.m32 += w.z * v.y;
    m.m33 += w.z * v.z;
}

/// M += s \[v\]ₓ
#[inline(always)]
pub(crate) fn add_cross<T: Real>(m: &mut Matrix3<T>, s: T, v: &Vector3<T>) {
    let (x, y, z) = (s * v.x, s * v.y, s * v.z);
    m.m12 -= z;
    m.m13 += y;
    m.m21 += z;
    m.m23 -= x;
    m.m31 -= y;
    m.m32 += x;
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
        let w = self.w - dot(half, &self.v);
        let v = self.v + half * self.w + cross(half, &self.v);
        Self { w, v }.normalised()
    }

    #[inline(always)]
    pub fn normalised(&self) -> Self {
        let s = T::one() / (self.w * self.w + dot(&self.v, &self.v)).root();
        Self { w: self.w * s, v: self.v * s }
    }

    /// conj(self) · other
    #[inline(always)]
    pub fn to(&self, other: &Self) -> Self {
        Self {
            w: self.w * other.w + dot(&self.v, &other.v),
            v: other.v * self.w - self.v * other.w - cross(&self.v, &other.v),
        }
    }

    /// The rotation halfway between two that are less than a turn apart.
    #[inline(always)]
    pub fn midway(&self, other: &Self) -> Self {
        let same = self.w * other.w + dot(&self.v, &other.v) >= T::zero();
        let sum = if same {
            Self { w: self.w + other.w, v: self.v + other.v }
        } else {
            Self { w: self.w - other.w, v: self.v - other.v }
        };
        sum.normalised()
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

    /// Rotation vector, for angles well below π.     2 asin(|v|)/|v| · v     docs/model.md (4)
    ///
    /// The series is exact to f32 up to 0.7 rad, to 1 % at 2 rad, and finite everywhere.
    #[inline(always)]
    pub fn log(&self) -> Vector3<T> {
        let s = dot(&self.v, &self.v);
        let c = |x: f64| T::lit(x);
        let series = c(2.0)
            + s * (c(1.0 / 3.0)
                + s * (c(3.0 / 20.0)
                    + s * (c(5.0 / 56.0) + s * (c(35.0 / 576.0) + s * c(63.0 / 1408.0)))));
        // q and −q are the same rotation: the short way is meant.
        self.v * if self.w < T::zero() { -series } else { series }
    }
}
