//! Small dense algebra of the recursion: 3 × 3 matrices and rotations.
//!
//! Operations are written out, so that a step compiles to straight-line code.

use core::ops::{Mul, Sub};
use core::sync::atomic::{Ordering, compiler_fence};

use cathforce_scalar::{Blend, Gather, Number, Pack, Real, Vector3};

/// A compiler barrier on the device: no load moves before it, and stored values are loaded again.
///
/// The recursion works on more numbers than the 32 registers of a Cortex-M7's FPU hold. Without
/// barriers the compiler loads early and spills. On a host the compiler does better without them. No
/// value changes.
#[inline(always)]
pub(crate) fn reload_barrier() {
    if cfg!(target_arch = "arm") {
        compiler_fence(Ordering::SeqCst);
    }
}

/// A 3 × 3 matrix.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Matrix3<T: Number> {
    pub rows: [Vector3<T>; 3],
}

impl<T: Real> Matrix3<T> {
    pub const fn zeros() -> Self {
        Self { rows: [T::ORIGIN; 3] }
    }
}

impl<T: Number> Matrix3<T> {
    /// [`Matrix3::zeros`] of any number.
    #[inline(always)]
    pub fn nothing() -> Self {
        Self { rows: [Vector3::zeros(); 3] }
    }

    /// u vᵀ
    #[inline(always)]
    pub fn outer(u: &Vector3<T>, v: &Vector3<T>) -> Self {
        Self { rows: [v * u.x(), v * u.y(), v * u.z()] }
    }

    #[inline(always)]
    pub fn columns(&self) -> [Vector3<T>; 3] {
        let [x, y, z] = &self.rows;
        [
            Vector3::new(x.x(), y.x(), z.x()),
            Vector3::new(x.y(), y.y(), z.y()),
            Vector3::new(x.z(), y.z(), z.z()),
        ]
    }

    #[inline(always)]
    pub fn from_columns(columns: &[Vector3<T>; 3]) -> Self {
        Self { rows: Self { rows: *columns }.columns() }
    }

    /// Mᵀ v
    #[inline(always)]
    pub fn mul_transposed(&self, v: &Vector3<T>) -> Vector3<T> {
        let [x, y, z] = &self.rows;
        x * v.x() + y * v.y() + z * v.z()
    }

    /// self += u vᵀ
    #[inline(always)]
    pub fn add_outer(&mut self, u: &Vector3<T>, v: &Vector3<T>) {
        let [x, y, z] = &mut self.rows;
        *x += v * u.x();
        *y += v * u.y();
        *z += v * u.z();
    }

    /// self −= u vᵀ
    #[inline(always)]
    pub fn sub_outer(&mut self, u: &Vector3<T>, v: &Vector3<T>) {
        let [x, y, z] = &mut self.rows;
        *x -= v * u.x();
        *y -= v * u.y();
        *z -= v * u.z();
    }

    /// self −= \[v\]ₓ
    #[inline(always)]
    pub fn sub_cross(&mut self, v: &Vector3<T>) {
        let [x, y, z] = &mut self.rows;
        let o = T::lit(0.0);
        *x -= Vector3::new(o, -v.z(), v.y());
        *y -= Vector3::new(v.z(), o, -v.x());
        *z -= Vector3::new(-v.y(), v.x(), o);
    }

    /// self −= A \[l\]ₓ
    #[inline(always)]
    pub fn sub_product_cross(&mut self, a: &Sym3<T>, l: &Vector3<T>) {
        for (row, a) in self.rows.iter_mut().zip(a.columns()) {
            *row = row.minus_cross(&a, l);
        }
    }
}

/// A symmetric 3 × 3 matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sym3<T: Number> {
    /// xx, xy, xz
    first: Vector3<T>,
    /// yy, yz, zz
    rest: Vector3<T>,
}

impl<T: Real> Sym3<T> {
    pub const fn zero() -> Self {
        Self { first: T::ORIGIN, rest: T::ORIGIN }
    }
}

impl<T: Number> Sym3<T> {
    /// [`Sym3::zero`] of any number.
    #[inline(always)]
    pub fn nothing() -> Self {
        Self { first: Vector3::zeros(), rest: Vector3::zeros() }
    }

    /// u vᵀ, which must be symmetric.
    #[inline(always)]
    pub fn outer(u: &Vector3<T>, v: &Vector3<T>) -> Self {
        let rest = Vector3::new(u.y(), u.y(), u.z());
        Self { first: v * u.x(), rest: rest.component_mul(&Vector3::new(v.y(), v.z(), v.z())) }
    }

    /// self + other
    #[inline(always)]
    pub fn plus(&self, other: &Self) -> Self {
        Self { first: self.first + other.first, rest: self.rest + other.rest }
    }

    #[inline(always)]
    pub fn columns(&self) -> [Vector3<T>; 3] {
        let Self { first, rest } = self;
        [
            *first,
            Vector3::new(first.y(), rest.x(), rest.y()),
            Vector3::new(first.z(), rest.y(), rest.z()),
        ]
    }

    /// self += s I
    #[inline(always)]
    pub fn add_identity(&mut self, s: T) {
        // Subtracting −0 keeps a negative zero, adding 0 would not.
        let (o, minus) = (T::lit(0.0), -s);
        self.first -= Vector3::new(minus, o, o);
        self.rest -= Vector3::new(minus, o, minus);
    }

    /// self += u vᵀ, which must be symmetric.
    #[inline(always)]
    pub fn add_outer(&mut self, u: &Vector3<T>, v: &Vector3<T>) {
        *self = self.plus(&Self::outer(u, v));
    }

    /// self −= u vᵀ, which must be symmetric.
    #[inline(always)]
    pub fn sub_outer(&mut self, u: &Vector3<T>, v: &Vector3<T>) {
        let product = Self::outer(u, v);
        self.first -= product.first;
        self.rest -= product.rest;
    }

    #[inline(always)]
    pub fn mul_vec(&self, v: &Vector3<T>) -> Vector3<T> {
        let [x, y, z] = self.columns();
        x * v.x() + y * v.y() + z * v.z()
    }

    /// self += \[l\]ₓ M, upper triangle only. The sum becomes symmetric with
    /// [`Self::add_cross_product_transposed`].
    #[inline(always)]
    pub fn add_cross_product(&mut self, l: &Vector3<T>, m: &Matrix3<T>) {
        let [x, y, z] = &m.rows;
        self.first = self.first + z * l.y() - y * l.z();
        let added =
            Vector3::new(x.y(), x.z(), y.z()).component_mul(&Vector3::new(l.z(), l.z(), l.x()));
        let taken =
            Vector3::new(z.y(), z.z(), x.z()).component_mul(&Vector3::new(l.x(), l.x(), l.y()));
        self.rest = self.rest + added - taken;
    }

    /// self += (\[l\]ₓ M)ᵀ, upper triangle only.
    #[inline(always)]
    pub fn add_cross_product_transposed(&mut self, l: &Vector3<T>, m: &Matrix3<T>) {
        let [x, y, z] = m.columns();
        self.first = self.first.plus_cross(l, &x);
        let added =
            Vector3::new(y.x(), y.y(), z.y()).component_mul(&Vector3::new(l.z(), l.x(), l.x()));
        let taken =
            Vector3::new(y.z(), y.x(), z.x()).component_mul(&Vector3::new(l.x(), l.y(), l.y()));
        self.rest = self.rest + added - taken;
    }
}

impl<N: Number> Sym3<N> {
    /// Splits into the matrices of the lanes.
    #[inline(always)]
    pub fn split<S: Number>(self) -> N::Lanes<Sym3<S>>
    where
        N: Pack<S>,
    {
        let (first, rest) = (N::split_vectors(self.first), N::split_vectors(self.rest));
        N::per_lane(|lane| Sym3 { first: first[lane], rest: rest[lane] })
    }
}

/// Factors of a symmetric matrix L Δ Lᵀ: L is lower triangular with a unit diagonal, Δ is diagonal.
///
/// The Schur complement A − B D⁻¹ Bᵀ must use the factors where a stiff wall meets a soft joint. With
/// the inverse of D, the error grows with the square of the condition number, and the result becomes
/// indefinite.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LdltFactor<T> {
    yx: T,
    zx: T,
    zy: T,
    /// The diagonal of Δ⁻¹.
    pub inverse: [T; 3],
}

impl<T: Real> LdltFactor<T> {
    pub const fn identity() -> Self {
        let (o, one) = (T::ZERO, T::ONE);
        Self { yx: o, zx: o, zy: o, inverse: [one; 3] }
    }
}

impl<T: Number> LdltFactor<T> {
    /// Factors a matrix whose eigenvalues, and therefore pivots, are at least `smallest`. A pivot that
    /// rounding has made smaller is raised to it, so the inverse stays finite and positive.
    #[inline(always)]
    pub fn new(m: &Sym3<T>, smallest: T) -> Self {
        let invert = |pivot: T| T::lit(1.0) / pivot.larger(smallest);
        let [xx, xy, xz] = m.first.into();
        let [yy, yz, zz] = m.rest.into();
        let x = invert(xx);
        let (yx, zx) = (xy * x, xz * x);
        let y = invert(yy - yx * xy);
        let rest = yz - yx * xz;
        let zy = rest * y;
        let z = invert(zz - zx * xz - zy * rest);
        Self { yx, zx, zy, inverse: [x, y, z] }
    }

    /// v L⁻ᵀ, for a row `v` of numbers or of columns.
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
        let [x, y, z] = (*v).into();
        let y = y - self.zy * z;
        let x = x - self.yx * y - self.zx * z;
        Vector3::new(x, y, z)
    }
}

impl<T: Number> Blend<T> for Matrix3<T> {
    #[inline(always)]
    fn blend(mask: T::Mask, yes: Self, no: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (yes.rows, no.rows);
        let row = |yes, no| Blend::blend(mask, yes, no);
        Self { rows: [row(a, x), row(b, y), row(c, z)] }
    }
}

impl<T: Number> Blend<T> for Sym3<T> {
    #[inline(always)]
    fn blend(mask: T::Mask, yes: Self, no: Self) -> Self {
        Self {
            first: Blend::blend(mask, yes.first, no.first),
            rest: Blend::blend(mask, yes.rest, no.rest),
        }
    }
}

impl<T: Number> Blend<T> for Rotation<T> {
    #[inline(always)]
    fn blend(mask: T::Mask, yes: Self, no: Self) -> Self {
        Self { w: T::choose(mask, yes.w, no.w), v: Blend::blend(mask, yes.v, no.v) }
    }
}

/// A rotation as a quaternion with scalar part w and vector part v, of unit norm up to rounding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rotation<T: Number> {
    pub w: T,
    pub v: Vector3<T>,
}

impl<T: Real> Rotation<T> {
    pub const fn identity() -> Self {
        Self { w: T::ONE, v: T::ORIGIN }
    }

    /// The rotation whose columns are the given right-handed orthonormal axes.
    pub fn from_axes(x: &Vector3<T>, y: &Vector3<T>, z: &Vector3<T>) -> Self {
        // The largest component keeps the argument of the square root away from 0.
        let (one, half) = (T::one(), T::lit(0.5));
        let squares = [
            one + x.x() + y.y() + z.z(),
            one + x.x() - y.y() - z.z(),
            one - x.x() + y.y() - z.z(),
            one - x.x() - y.y() + z.z(),
        ];
        let mut largest = 0;
        for (i, s) in squares.iter().enumerate() {
            if *s > squares[largest] {
                largest = i;
            }
        }
        let root = squares[largest].root();
        let s = half / root;
        let (wx, wy, wz) = ((y.z() - z.y()) * s, (z.x() - x.z()) * s, (x.y() - y.x()) * s);
        let (xy, xz, yz) = ((x.y() + y.x()) * s, (x.z() + z.x()) * s, (y.z() + z.y()) * s);
        let main = half * root;
        match largest {
            0 => Self { w: main, v: Vector3::new(wx, wy, wz) },
            1 => Self { w: wx, v: Vector3::new(main, xy, xz) },
            2 => Self { w: wy, v: Vector3::new(xy, main, yz) },
            _ => Self { w: wz, v: Vector3::new(xz, yz, main) },
        }
    }
}

impl<N: Number> Rotation<N> {
    /// Gathers those of several lanes.
    #[inline(always)]
    pub fn gather<'a, S: Number + 'a>(of: impl Fn(usize) -> &'a Rotation<S>) -> Self
    where
        N: Gather<S>,
    {
        Self { w: N::from_lanes(|lane| of(lane).w), v: N::gather_vectors(|lane| of(lane).v) }
    }

    /// Splits into the rotations of the lanes.
    #[inline(always)]
    pub fn split<S: Number>(self) -> N::Lanes<Rotation<S>>
    where
        N: Pack<S>,
    {
        let v = N::split_vectors(self.v);
        N::per_lane(|lane| Rotation { w: self.w.lane(lane), v: v[lane] })
    }
}

impl<T: Number> Rotation<T> {
    /// The normalised quaternion (1, half) times this rotation: a rotation about `half` by
    /// 2 atan |half|. For small rotations `half` is half the rotation vector. The angle stays below π
    /// for any `half`.
    #[inline(always)]
    pub fn turned(&self, half: &Vector3<T>) -> Self {
        let w = self.w - half.x() * self.v.x() - half.y() * self.v.y() - half.z() * self.v.z();
        let v = (self.v + half * self.w).plus_cross(half, &self.v);
        Self { w, v }.normalised()
    }

    #[inline(always)]
    pub fn normalised(&self) -> Self {
        let s = T::lit(1.0) / (self.w * self.w + self.v.dot(&self.v)).root();
        Self { w: self.w * s, v: self.v * s }
    }

    /// R v
    #[inline(always)]
    pub fn rotate(&self, v: &Vector3<T>) -> Vector3<T> {
        let c = self.v.cross(v);
        let c = c + c;
        *v + c * self.w + self.v.cross(&c)
    }

    /// R e_z, the tangent of a link.
    #[inline(always)]
    pub fn tangent(&self) -> Vector3<T> {
        let two = T::lit(2.0);
        Vector3::new(
            two * (self.v.x() * self.v.z() + self.w * self.v.y()),
            two * (self.v.y() * self.v.z() - self.w * self.v.x()),
            T::lit(1.0) - two * (self.v.x() * self.v.x() + self.v.y() * self.v.y()),
        )
    }
}

/// The rotation from one orientation to another, by less than π.
pub(crate) struct RelativeRotation<T: Number> {
    /// Rotation vector, material axes \[rad\].
    pub angle: Vector3<T>,
    /// The orientation halfway, as a quaternion that is not normalised.
    w: T,
    v: Vector3<T>,
    /// 2 over the square of its norm.
    scale: T,
}

impl<T: Number> RelativeRotation<T> {
    /// q = log(nearᵀ far) = 4 atan(|m|)/|m| m, with m = v/(1 + w) of the relative quaternion.
    /// docs/explanation/model.md (8)
    ///
    /// The series of atan is exact to `f32` up to 0.7 rad and to 0.1 % at 2 rad; |q| stays below π.
    #[inline(always)]
    pub fn between(near: &Rotation<T>, far: &Rotation<T>) -> Self {
        let w = near.w * far.w + near.v.dot(&far.v);
        let v = (far.v * near.w - near.v * far.w).plus_cross(&far.v, &near.v);
        // A quaternion and its negative are the same rotation; the sign selects the shorter way.
        let sign = w.sign();
        // The sum of the two unit quaternions has the squared norm 2 + 2 |w|.
        let scale = T::lit(1.0) / (T::lit(1.0) + sign * w);
        let m = v * (sign * scale);
        let s = m.dot(&m);
        let c = |x: f64| T::lit(x);
        let series = c(4.0) - s * (c(4.0 / 3.0) - s * (c(4.0 / 5.0) - s * c(4.0 / 7.0)));
        Self { angle: m * series, w: near.w + sign * far.w, v: near.v + far.v * sign, scale }
    }

    /// R_mid x
    #[inline(always)]
    pub fn rotate_midway(&self, x: &Vector3<T>) -> Vector3<T> {
        *x + self.v.cross(&(x * self.w).plus_cross(&self.v, x)) * self.scale
    }

    /// R_mid e_z
    #[inline(always)]
    pub fn midway_tangent(&self) -> Vector3<T> {
        let Self { w, v, scale, .. } = self;
        Vector3::new(
            *scale * (v.x() * v.z() + *w * v.y()),
            *scale * (v.y() * v.z() - *w * v.x()),
            T::lit(1.0) - *scale * (v.x() * v.x() + v.y() * v.y()),
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
            b.sub_product_cross(&a, &lever);
            c.add_identity(wall);
            c.sub_outer(&(lever * wall), &lever);
            c.add_identity(1.0);
            let factor = LdltFactor::new(&c, 1.0);
            let z = factor.forward(b.columns());
            for (z, inverse) in z.iter().zip(factor.inverse) {
                a.sub_outer(&(z * inverse), z);
            }
            let across = Vector3::new(0.0, 0.8, 0.6);
            let left = across.dot(&a.mul_vec(&across));
            let exact = wall / (1.0 + wall);
            assert!((left / exact - 1.0).abs() < 0.2, "wall {wall}: {left}, not {exact}");

            let [x, y, z] = factor.forward(c.mul_vec(&across).into());
            let [i, j, k] = factor.inverse;
            let product = factor.backward(&Vector3::new(x * i, y * j, z * k));
            assert!((product - across).norm() < 2e-7 * wall.max(10.0), "{product:?}");
        }
    }
}
