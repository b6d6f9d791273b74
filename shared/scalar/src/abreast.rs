//! Several catheters abreast, computed as if they were one.

use core::ops::{Add, Div, Mul, Neg, Sub};

use crate::{Blend, Catheters, Gather, Number, Pack, PlainPack, Real, ScalarStorage, Vector3};

/// The numbers of several catheters, one in each lane of the pack `P`.
///
/// To the equations of motion it is one number: none of their lanes holds another link. Each catheter has the
/// bits that it has alone, because every lane does the same operations in the same order as a single number.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct Abreast<P>(pub P);

macro_rules! operator {
    ($($operator:ident $method:ident),+) => { $(
        impl<P: Number> $operator for Abreast<P> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0.$method(other.0))
            }
        }
    )+ };
}
operator!(Add add, Sub sub, Mul mul, Div div);

impl<P: Number> Neg for Abreast<P> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl<P: Number> Number for Abreast<P> {
    type Storage3 = ScalarStorage<Self>;
    const LANES: usize = 1;
    type Lanes<U> = [U; 1];
    #[inline(always)]
    fn per_lane<U>(mut of: impl FnMut(usize) -> U) -> [U; 1] {
        [of(0)]
    }
    #[inline(always)]
    fn lit(value: f64) -> Self {
        Self(P::lit(value))
    }
    #[inline(always)]
    fn root(self) -> Self {
        Self(self.0.root())
    }
    #[inline(always)]
    fn larger(self, bound: Self) -> Self {
        Self(self.0.larger(bound.0))
    }
    #[inline(always)]
    fn smaller(self, bound: Self) -> Self {
        Self(self.0.smaller(bound.0))
    }
    #[inline(always)]
    fn positive(self) -> Self {
        Self(self.0.positive())
    }
    #[inline(always)]
    fn sign(self) -> Self {
        Self(self.0.sign())
    }
    type Mask = P::Mask;
    #[inline(always)]
    fn below(self, bound: Self) -> P::Mask {
        self.0.below(bound.0)
    }
    #[inline(always)]
    fn reaches(self, bound: Self) -> P::Mask {
        self.0.reaches(bound.0)
    }
    #[inline(always)]
    fn choose(mask: P::Mask, yes: Self, no: Self) -> Self {
        Self(P::choose(mask, yes.0, no.0))
    }
    #[inline(always)]
    fn all(mask: P::Mask) -> bool {
        P::all(mask)
    }
    #[inline(always)]
    fn any(mask: P::Mask) -> bool {
        P::any(mask)
    }
}

impl<P: Number> Gather<Self> for Abreast<P> {
    #[inline(always)]
    fn from_lanes(mut of: impl FnMut(usize) -> Self) -> Self {
        of(0)
    }
    #[inline(always)]
    fn gather_vectors(mut of: impl FnMut(usize) -> Vector3<Self>) -> Vector3<Self> {
        of(0)
    }
}

impl<P: Number> Pack<Self> for Abreast<P> {
    #[inline(always)]
    fn lane(self, _lane: usize) -> Self {
        self
    }
    #[inline(always)]
    fn split_vectors(vectors: Vector3<Self>) -> [Vector3<Self>; 1] {
        [vectors]
    }
    #[inline(always)]
    fn where_present(present: P::Mask, yes: Self, no: Self) -> Self {
        Self::choose(present, yes, no)
    }
}

/// Gathers the number of each catheter.
impl<T: Real, P: PlainPack<T>> Gather<T> for Abreast<P> {
    #[inline(always)]
    fn from_lanes(of: impl FnMut(usize) -> T) -> Self {
        Self(P::from_lanes(of))
    }
    #[inline(always)]
    fn gather_vectors(of: impl FnMut(usize) -> Vector3<T>) -> Vector3<Self> {
        let found = P::gather_vectors(of);
        Vector3::new(Self(found.x()), Self(found.y()), Self(found.z()))
    }
}

impl<P: Number> Catheters for Abreast<P> {
    const ABREAST: bool = true;
    type Count = Self;
    type Index = Self;
    #[inline(always)]
    fn index(link: usize) -> Self {
        Self::lit(link as f64)
    }
    #[inline(always)]
    fn present(count: Self, link: usize) -> P::Mask {
        Self::has(count, link)
    }
    #[inline(always)]
    fn has(count: Self, link: usize) -> P::Mask {
        Self::lit(link as f64).below(count)
    }
    #[inline(always)]
    fn not(mask: P::Mask) -> P::Mask {
        Self::choose(mask, Self::lit(1.0), Self::lit(0.0)).below(Self::lit(0.5))
    }
    #[inline(always)]
    fn either<X: Blend<Self>>(mask: P::Mask, yes: impl FnOnce() -> X, no: impl FnOnce() -> X) -> X {
        X::blend(mask, yes(), no())
    }
}

impl<P: Number> Abreast<P> {
    /// How many catheters there are.
    pub const CATHETERS: usize = P::LANES;

    /// The number of each catheter.
    #[inline(always)]
    pub fn numbers<T: Real>(self) -> P::Lanes<T>
    where
        P: PlainPack<T>,
    {
        self.0.numbers()
    }

    /// Replaces the number of the catheters of a mask.
    #[inline(always)]
    pub fn put<T: Real>(&mut self, only: P::Mask, number: T)
    where
        P: PlainPack<T>,
    {
        self.0 = P::choose(only, P::splat(number), self.0);
    }

    /// Replaces the vector of the catheters of a mask.
    #[inline(always)]
    pub fn put_vector<T: Real>(to: &mut Vector3<Self>, only: P::Mask, vector: Vector3<T>)
    where
        P: PlainPack<T>,
    {
        let splat = |number: T| Self(P::splat(number));
        let vector = Vector3::new(splat(vector.x()), splat(vector.y()), splat(vector.z()));
        *to = Blend::blend(only, vector, *to);
    }

    /// The vector of each catheter.
    #[inline(always)]
    pub fn split<T: Real>(vectors: &Vector3<Self>) -> P::Lanes<Vector3<T>>
    where
        P: PlainPack<T>,
    {
        P::split_vectors(Self::pack(vectors))
    }

    /// The vectors without the wrapping.
    #[inline(always)]
    pub fn pack(vectors: &Vector3<Self>) -> Vector3<P> {
        Vector3::new(vectors.x().0, vectors.y().0, vectors.z().0)
    }

    /// The mask of a part of the catheters.
    #[inline(always)]
    pub fn mask<T: Real>(of: impl Fn(usize) -> bool) -> P::Mask
    where
        P: PlainPack<T>,
    {
        let chosen = P::from_lanes(|catheter| if of(catheter) { T::ZERO } else { T::ONE });
        chosen.below(P::lit(0.5))
    }
}
